"""Weigh a tool by a log of free motion: mass, centre, and the sensor's bias and drift, with intervals.

While nothing is touched a sensor shows f = R^T w + b + d t, and the torque c x R^T w + b' + d' t: the weight w keeps
its direction in the base, the bias b, its drift d and the centre c of mass turn with the tool. All are linear but c,
which is so once w is known.

What a log says of them is not what its rows would say were their errors independent: a cable or a bent flange errs
alike in all rows of one orientation. So the intervals are from leaving out one orientation after another (the jackknife
of groups: Efron, The jackknife, the bootstrap and other resampling plans, 1982, with Student's t), and poses that tell
nothing without one of them are seen to tell nothing.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from palpate.arrays import Array, Indices
from palpate.signals.rotations import to_base, to_tool
from palpate.units import GRAVITY

GROUP_ANGLE = np.radians(30.0)
"""Orientations nearer than this are one group: what errs alike in them is not counted as many readings [rad]."""
_MIN_SCALED_EIGENVALUE = 1e-9
"""Least eigenvalue of scaled equations: the square of 3e-5 rad, and no pose is read finer."""


@dataclass(frozen=True)
class Estimated:
    """A number, or a vector, with its uncertainty.

    Args:
        value: shape () or (3,).
        std: standard deviation, likewise.
        half: half-width of the 95 % interval, likewise; infinite if the log does not determine it.
        unit: SI.
    """

    value: Array
    std: Array
    half: Array
    unit: str


@dataclass(frozen=True)
class Poses:
    """Stretches of one orientation each.

    Args:
        first: row with which each begins, shape (g,).
        count: rows of each, shape (g,).
        turns: mean of the rotations, shape (g, 3, 3).
        turns_t: mean of rotations times time, likewise.
        times: mean time and mean squared time, shape (g, 2).
        signal: mean of the signal, shape (g, 3).
        signal_t: mean of signal times time, likewise.
        in_base: mean of the signal turned into the base, likewise.
    """

    first: Indices
    count: Array
    turns: Array
    turns_t: Array
    times: Array
    signal: Array
    signal_t: Array
    in_base: Array

    @cached_property
    def effective(self) -> float:
        """Number of stretches of equal length that would be worth as much."""
        return float(self.count.sum() ** 2 / (self.count**2).sum())


def groups_of(rotations: Array, apart: float = GROUP_ANGLE) -> Indices:
    """Rows at which another orientation begins, by so much [rad], of rotations of shape (n, 3, 3)."""
    begins, at = [0], 0
    limit = 1.0 + 2.0 * np.cos(apart)
    step = 4096
    while at < len(rotations):
        chunk = rotations[at : at + step]
        turned_rows = np.flatnonzero(np.einsum("ij,nij->n", rotations[begins[-1]], chunk) < limit)
        if len(turned_rows):
            at += int(turned_rows[0])
            begins.append(at)
        else:
            at += len(chunk)
    return np.array(begins)


def poses_of(time: Array, rotations: Array, signal: Array, first: Indices) -> Poses:
    """Means over each stretch; `time` is counted from the middle of the log."""
    count = np.diff(np.r_[first, len(time)]).astype(float)

    def mean(values: Array) -> Array:
        wide = count.reshape(-1, *[1] * (values.ndim - 1))
        means: Array = np.add.reduceat(values, first, axis=0) / wide
        return means

    return Poses(
        first, count, mean(rotations), mean(rotations * time[:, None, None]),
        mean(np.column_stack([time, time**2])), mean(signal), mean(signal * time[:, None]),
        mean(to_base(rotations, signal)),
    )  # fmt: skip


@dataclass(frozen=True)
class WeighingFit:
    """Weight, bias and drift, from all rows and with each stretch left out.

    Args:
        solution: w, b, d of all rows, shape (9,); (6,) without the drift.
        left_out: the same without each stretch, shape (g, 9).
        information: of the weight once all else is known, over the rows: about the square of the angle by which the
            tool turns each of three axes, shape (3,).
        axes: these axes in the base, as columns.
        dof: degrees of freedom of Student's t.
    """

    solution: Array
    left_out: Array
    information: Array
    axes: Array
    dof: float

    def jackknife(self, replicas: Array, value: Array, unit: str) -> Estimated:
        """A number with its interval, from its replicas, shape (g,) or (g, 3)."""
        from scipy.special import stdtrit

        g = len(replicas)
        if np.isfinite(replicas).all() and g > 1:
            squares = np.sum((replicas - replicas.mean(axis=0)) ** 2, axis=0)
            std = np.sqrt((g - 1) / g * squares)
        else:
            std = np.full(replicas.shape[1:], np.inf)
        half = np.full(np.shape(std), np.inf) if self.dof <= 0 else std * float(stdtrit(self.dof, 0.975))
        return Estimated(np.asarray(value), np.asarray(std), np.asarray(half), unit)

    @property
    def weight(self) -> Estimated:
        """The weight w of the tool [N]."""
        return self.jackknife(self.left_out[:, :3], self.solution[:3], "N")

    @property
    def bias(self) -> Estimated:
        """b in the middle of the log [N]."""
        return self.jackknife(self.left_out[:, 3:6], self.solution[3:6], "N")

    @property
    def drift(self) -> Estimated | None:
        """The drift d of the bias [N/s]."""
        return (
            self.jackknife(self.left_out[:, 6:], self.solution[6:], "N/s") if len(self.solution) > 6 else None
        )

    @property
    def mass(self) -> Estimated:
        """The mass |w|/g of the tool [kg]."""
        sizes = np.linalg.norm(self.left_out[:, :3], axis=1) / GRAVITY
        return self.jackknife(sizes, np.asarray(np.linalg.norm(self.solution[:3]) / GRAVITY), "kg")


@dataclass(frozen=True)
class PoseFit:
    """A fit of a whole log.

    Args:
        poses: the orientations.
        fitted: weight, bias and drift.
        parameters: by name, with intervals.
        means: residual of the model in each orientation [N], shape (g, 3).
    """

    poses: Poses
    fitted: WeighingFit
    parameters: dict[str, Estimated]
    means: Array


def solve_force(poses: Poses, drift: bool) -> Array:
    """Weight, bias and drift of a force, w, b, d; not finite if the poses do not determine them, shape (9,) or (6,)."""
    A, r = _normal_equations(poses)
    n = 9 if drift else 6
    return _solve(A[:, :n, :n].sum(axis=0), r[:, :n].sum(axis=0))


def fit_force(poses: Poses, drift: bool) -> WeighingFit:
    """Weight, bias and drift of a force, with each orientation left out once."""
    A, r = _normal_equations(poses)
    n = 9 if drift else 6
    A = A[:, :n, :n]
    r = r[:, :n]
    normal_matrix = A.sum(axis=0)
    coupling = normal_matrix[:3, 3:]
    nuisance_inverse = np.linalg.pinv(normal_matrix[3:, 3:], hermitian=True)
    schur = normal_matrix[:3, :3] - coupling @ nuisance_inverse @ normal_matrix[3:, :3]
    information, axes = np.linalg.eigh(schur / poses.count.sum())
    dof = poses.effective - 1.0
    solution = _solve(normal_matrix, r.sum(axis=0))
    return WeighingFit(solution, _solve_without_each(A, r), np.maximum(information, 0.0), axes, dof)


def fit_centre(poses: Poses, weight: Array, drift: bool) -> WeighingFit:
    """Centre of mass, bias and drift of a torque, with the weight known; the solution begins with the centre [m]."""
    weight_in_tool = to_tool(poses.turns, weight)
    weight_in_tool_t = to_tool(poses.turns_t, weight)
    count, (t, tt) = poses.count, poses.times.T
    n = 9 if drift else 6
    A = np.zeros((len(count), 9, 9))
    r = np.zeros((len(count), 9))
    arm, arm_t = -_crosses(weight_in_tool), -_crosses(weight_in_tool_t)  # c x f = -[f]x c
    eye = np.eye(3)
    A[:, :3, :3] = np.einsum("gji,gjk->gik", arm, arm)
    A[:, 3:6, :3] = arm
    A[:, 6:, :3] = arm_t
    _fill_bias(A, eye, t, tt)
    r[:, :3] = np.einsum("gji,gj->gi", arm, poses.signal)
    r[:, 3:6] = poses.signal
    r[:, 6:] = poses.signal_t
    A = (A * count[:, None, None])[:, :n, :n]
    r = (r * count[:, None])[:, :n]
    solution = _solve(A.sum(axis=0), r.sum(axis=0))
    return WeighingFit(solution, _solve_without_each(A, r), np.ones(3), eye, poses.effective - 1.0)


def _normal_equations(poses: Poses) -> tuple[Array, Array]:
    """Normal equations of each stretch, shape (g, 9, 9) and (g, 9)."""
    count, (t, tt) = poses.count, poses.times.T
    A = np.zeros((len(count), 9, 9))
    r = np.zeros((len(count), 9))
    eye = np.eye(3)
    A[:, :3, :3] = eye  # R R^T, summed
    A[:, 3:6, :3] = poses.turns.transpose(0, 2, 1)
    A[:, 6:, :3] = poses.turns_t.transpose(0, 2, 1)
    _fill_bias(A, eye, t, tt)
    r[:, :3] = poses.in_base
    r[:, 3:6] = poses.signal
    r[:, 6:] = poses.signal_t
    return A * count[:, None, None], r * count[:, None]


def _fill_bias(A: Array, eye: Array, t: Array, tt: Array) -> None:
    """Complete normal equations that have the columns of weight or centre alone."""
    A[:, :3, 3:] = A[:, 3:, :3].transpose(0, 2, 1)
    A[:, 3:6, 3:6] = eye
    A[:, 3:6, 6:] = A[:, 6:, 3:6] = t[:, None, None] * eye
    A[:, 6:, 6:] = tt[:, None, None] * eye


def _solve_without_each(A: Array, r: Array) -> Array:
    """Solutions with each stretch left out, shape (g, n)."""
    total, right = A.sum(axis=0), r.sum(axis=0)
    return np.array([_solve(total - a, right - b) for a, b in zip(A, r, strict=True)])


def _solve(A: Array, r: Array) -> Array:
    """The solution; not finite where there is none."""
    scale = np.sqrt(np.maximum(np.diag(A), 1e-300))
    scaled = A / np.outer(scale, scale)
    if np.linalg.eigvalsh(scaled)[0] < _MIN_SCALED_EIGENVALUE:
        return np.full(len(r), np.nan)
    solution: Array = np.linalg.solve(scaled, r / scale) / scale
    return solution


def _crosses(vectors: Array) -> Array:
    """The matrices [v]x with [v]x u = v x u, shape (g, 3, 3)."""
    x, y, z = vectors.T
    o = np.zeros_like(x)
    rows = [(o, -z, y), (z, o, -x), (-y, x, o)]
    return np.stack([np.stack(row, axis=1) for row in rows], axis=1)
