"""Weight and bias of a force sensor in free motion, and the contact's normal.

The weight w keeps its direction in the base, the bias b in the sensor: f = R^T w + b with the tool's rotation R. Only
a tool that turns distinguishes the two. Least squares over all orientations: with R' the mean of R,

    (1 - R' R'^T) w = mean(R f) - R' mean(f),    b = mean(f) - R'^T w

whose matrix has an eigenvalue of about the square of the angle for each direction that the tool turns w in, and 0 for
one that it leaves as it is. The part of w that is not determined is left to b: their sum is right where the tool
stands so.

The normal is the direction in which the force changes: a bias of the sensor that nobody has taken off has a direction
of its own and does not change. A force with friction stands off the normal by up to the arctangent of the coefficient
of friction, and no log of one motion tells; so the direction of the force is estimated. A normal that is off by a
small angle d turns both the force and the position. K, B and M scale as F(n)/x(n), so where tool and force go along
the normal the two cosines cancel up to d^2; where the tool moves along the surface by s for each unit of penetration
they leave an error of s d.
"""

from dataclasses import dataclass

import numpy as np

from palpate.arrays import Array
from palpate.contact_frame.free_motion import BLOCKS
from palpate.contact_frame.payload import Payload
from palpate.signals.rotations import to_base, to_tool

_MIN_EIGENVALUE = np.radians(3.0) ** 2
"""Least eigenvalue for which a weight is told from a bias: by a smaller turn, a pose that errs by 0.3 deg makes a tenth
of the weight."""
_REWEIGHTING_ROUNDS = 30
"""Rounds of reweighting. Their load only begins the search for the free rows, which fits the load anew."""
_MAX_ROWS = 20_000
"""Rows that are used, evenly spaced in a longer log; more would cost time and change nothing."""


@dataclass(frozen=True)
class Load:
    """Weight and bias of a force sensor.

    Args:
        weight: in the base's axes, as the sensor shows it [N], shape (3,).
        bias: in the tool's axes [N], shape (3,).
        std: standard deviation of an axis of their sum [N].
        separable: whether the log separates the whole weight from the bias.
        weight_std: standard deviation of an axis of the weight [N]; infinite if it is not separable.
    """

    weight: Array
    bias: Array
    std: float
    separable: bool
    weight_std: float

    def taken_off(self, force: Array, rotations: Array) -> Array:
        """The force in the base's axes without weight and bias, of one in the tool's axes, shape (n, 3)."""
        return to_base(rotations, force - self.bias) - self.weight


def zero_load() -> Load:
    """The load while nothing is known."""
    return Load(np.zeros(3), np.zeros(3), 0.0, False, np.inf)


def turns(rotations: Array) -> bool:
    """True if rotations, shape (n, 3, 3), differ by enough to tell a weight from a bias, at least in part."""
    mean = rotations.mean(axis=0)
    return bool(np.linalg.eigvalsh(np.eye(3) - mean @ mean.T)[-1] > _MIN_EIGENVALUE)


def load_with_payload(force: Array, rotations: Array, payload: Payload) -> Load:
    """The bias by least squares over free rows, shape (n, 3), with the weight known; the payload's where n is 0."""
    weight = np.array(payload.weight)
    if not len(force):
        return Load(weight, np.array(payload.bias), payload.bias_std, True, payload.weight_std)
    residual = force - to_tool(rotations, weight)
    bias = residual.mean(axis=0)
    return Load(weight, bias, _std_of_mean(residual - bias), True, payload.weight_std)


def fit_load(force: Array, rotations: Array, *, weighs: bool, weights: Array | None = None) -> Load:
    """Weight and bias by least squares over free rows.

    Args:
        force: in the tool's axes [N], shape (n, 3).
        rotations: of the tool, shape (n, 3, 3).
        weighs: whether the tool's weight is in it.
        weights: of the rows, shape (n,).
    """
    weights_of_rows = np.full(len(force), 1 / len(force)) if weights is None else weights / weights.sum()
    mean_turn = np.einsum("n,nij->ij", weights_of_rows, rotations)
    mean_force = weights_of_rows @ force
    in_base = weights_of_rows @ to_base(rotations, force)
    values, axes = np.linalg.eigh(np.eye(3) - mean_turn @ mean_turn.T)
    determined = (values > _MIN_EIGENVALUE) & weighs
    weight = axes[:, determined] @ (
        (axes[:, determined].T @ (in_base - mean_turn @ mean_force)) / values[determined]
    )
    bias = mean_force - mean_turn.T @ weight
    std = _std_of_mean(force - to_tool(rotations, weight) - bias)
    separable = bool(determined.all())
    return Load(weight, bias, std, separable, std / float(np.sqrt(values[0])) if separable else np.inf)


def fit_load_robustly(force: Array, rotations: Array, *, weighs: bool) -> Load:
    """Weight and bias where rows in contact are among the others, the fewer: by least absolute deviations."""
    rows = slice(None, None, -(-len(force) // _MAX_ROWS))
    force = force[rows]
    rotations = rotations[rows]
    load = fit_load(force, rotations, weighs=weighs)
    for _ in range(_REWEIGHTING_ROUNDS):
        far = np.linalg.norm(load.taken_off(force, rotations), axis=1)
        weights = 1 / np.maximum(far, 1e-3 * float(np.median(far)) + 1e-12)
        load = fit_load(force, rotations, weighs=weighs, weights=weights)
    return load


def _std_of_mean(residual: Array) -> float:
    """Standard deviation of the mean of coloured noise, shape (n, 3), of an axis, by the means of blocks."""
    blocks = [block.mean(axis=0) for block in np.array_split(residual, min(BLOCKS, len(residual)))]
    return float(np.sqrt(np.mean(np.var(blocks, axis=0, ddof=1)) / len(blocks))) if len(blocks) > 1 else 0.0


NOTABLE_SCALE_STD = 0.02
"""Relative standard deviation that the normal may add to K, B and M unsaid: 4 % at 95 %, which in quadrature takes a
hundredth from the 25 % that an identified parameter may have."""
_UNKNOWN_SCALE_STD = 0.99
"""Relative standard deviation of a number of which nothing is known; at 1 the interval holds zero for certain."""
_MAX_NORMAL_STD = NOTABLE_SCALE_STD**0.5
"""Standard deviation of the angle d above which the force has no direction [rad]: its square alone matters then."""


@dataclass(frozen=True)
class Normal:
    """A direction in the base's axes.

    Args:
        direction: of unit length, shape (3,).
        std: standard deviation of its angle about each of the two axes across it [rad]; 0 for one that was given.
        estimated: True if estimated from the force, False if given.
    """

    direction: Array
    std: float
    estimated: bool

    @property
    def shown(self) -> bool:
        """True if the log shows a normal at all."""
        return self.std <= _MAX_NORMAL_STD


def main_axis(force: Array) -> tuple[Array, float]:
    """The axis along which a force, shape (n, 3), changes most, and the standard deviation of its angle [rad].

    It is the first axis of the covariance. To first order, noise turns it towards another axis by what the covariance
    between the two should not be, over the difference of their variances; the scatter of that from block to block of
    the log says how well the axis is known, whatever the noise's colour. A force that changes in all directions alike,
    as noise does, has no axis, and the angle's deviation says so.
    """
    changes = force - force.mean(axis=0)
    variances, axes = np.linalg.eigh(changes.T @ changes)
    along = changes @ axes[:, 2]
    across = changes @ axes[:, :2]
    blocks = np.array([block.sum(axis=0) for block in np.array_split(along[:, None] * across, BLOCKS)])
    tilt_variances = np.sum(blocks**2, axis=0) * BLOCKS / (BLOCKS - 1) / (variances[2] - variances[:2]) ** 2
    return axes[:, 2], float(np.sqrt(np.mean(tilt_variances)))


def slope_across(vectors: Array, axis: Array) -> Array:
    """Slope of vectors, shape (n, 3), across an axis over their component along it, shape (3,)."""
    changes = vectors - vectors.mean(axis=0)
    along = changes @ axis
    slope: Array = (along @ changes) / (along @ along)
    return slope - axis


def scale_std(normal: Normal, force: Array, position: Array) -> float:
    """Effect of the normal's uncertainty on K, B and M, as a relative standard deviation.

    Args:
        normal: with its uncertainty.
        force: in contact [N], shape (n, 3).
        position: of the point that touches, in contact [m], shape (m, 3).

    Returns:
        Below 1: at that, nothing is known.
    """
    if not normal.std:
        return 0.0
    if not normal.shown:
        return _UNKNOWN_SCALE_STD
    slip = slope_across(position, normal.direction) - slope_across(force, normal.direction)
    return min(float(np.hypot(np.linalg.norm(slip) * normal.std, normal.std**2)), _UNKNOWN_SCALE_STD)
