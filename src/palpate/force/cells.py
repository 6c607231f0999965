"""Cells of surfaces, each with a norm in which every tick of the loop contracts: checked by norms alone.

A surface is (K, B). A cell is what lies between two lines K + B/theta and two damping times B/K: a quadrilateral. For a
position arm the loop's matrix is affine in (K, B), in the gain and in which reading is used, so that what contracts at
the corners contracts everywhere between, also if it changes from tick to tick. For a torque arm, and in what is not
known of a position arm's inner loop, it is a matrix exponential of what is affine: the distance from the corners' hull
is bounded by its second derivatives.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import product
from typing import Literal

import numpy as np

from palpate.arrays import Array
from palpate.force.arm import PositionLoop
from palpate.force.sampled_loop import Law, SampledLoop, law_for

EPS = float(np.finfo(np.float64).eps)


@dataclass(frozen=True)
class Box:
    """Surfaces between two bounds and two damping times.

    Args:
        low: K + B/theta from [N/m].
        high: to [N/m].
        least: B/K from [s].
        most: to [s].
        part: which part of what the inner loop may be.
        loss: ticks by which the delay is shorter than the longest it may be.
    """

    low: float
    high: float
    least: float
    most: float
    part: int = 0
    loss: int = 0

    def corners(self, theta: float) -> list[tuple[float, float]]:
        """(K, B) of the corners; one where the box is a point in that direction."""
        times = dict.fromkeys((self.least, self.most))
        return [
            (bound / (1.0 + t / theta), t * bound / (1.0 + t / theta))
            for bound in dict.fromkeys((self.low, self.high))
            for t in times
        ]

    def halves(self, theta: float, damping: bool) -> tuple[Box, Box]:
        """The box cut across its damping times, or across its bounds: each at the mean of its logarithm."""
        if damping:
            middle = float(np.sqrt((self.most + theta) * (self.least + theta)) - theta)
            return replace(self, most=middle), replace(self, least=middle)
        middle = float(np.sqrt(self.low * self.high))
        return replace(self, high=middle), replace(self, low=middle)

    def middle(self, theta: float) -> tuple[float, float]:
        """K + B/theta and B/K in the middle of the box."""
        time = float(np.sqrt((self.least + theta) * (self.most + theta)) - theta)
        return float(np.sqrt(self.low * self.high)), time


@dataclass(frozen=True)
class Prover:
    """Loops that have to contract in every cell.

    Args:
        loop: the sampled loop, of the oldest reading.
        theta: of the law [s].
        gains: g of a tick may be anything between these two [m/(s N)]; if `relative`, g theta K_eff(K + B/theta) may.
        younger: ticks by which a reading may be younger than the oldest, from tick to tick.
        bound: K_u where the gain is constant, on which a servo's lead depends [N/m].
        at: the law of a servo at a K_u [N/m] within what `gains` then are: least and most (K + B/theta)/K_u of a tick.
        relative: see `gains`.
        fading: what may come near to nothing within a cell, "gain" or "surface"; empty if neither does.
        parts: into how many parts w^2 and 2 z w of an inner loop known to intervals are cut, each.
        wider: factor of these parts, so that a norm that is searched leaves room for the curvature.
    """

    loop: SampledLoop
    theta: float
    gains: tuple[float, float]
    younger: int = 0
    bound: float = 0.0
    at: Callable[[float], Law] | None = None
    relative: bool = False
    fading: Literal["", "gain", "surface"] = ""
    parts: int = 1
    wider: float = 1.0

    @property
    def exact(self) -> bool:
        """True if the matrix is affine in all that may vary, so that its corners decide."""
        inner = self.loop.arm.inner
        return isinstance(inner, PositionLoop) and len(inner.corners) == 1

    def inner(self, part: int) -> list[tuple[float, float] | None]:
        """Corners of a part of what the inner loop may be; its own but for a position arm."""
        inner = self.loop.arm.inner
        if not isinstance(inner, PositionLoop):
            return [None]
        if self.exact:
            return [inner.squared]
        corners = np.array(inner.corners)
        size = np.ptp(corners, axis=0) / self.parts
        middle = corners.min(axis=0) + (np.array(divmod(part, self.parts)) + 0.5) * size
        signs = product((-0.5, 0.5), repeat=2)
        return [tuple((middle + self.wider * np.array(sign) * size).tolist()) for sign in signs]

    def laws(self, box: Box) -> list[tuple[Law, int]]:
        """The extreme laws and readings within a box."""
        low, high = self.gains
        losses = range(self.younger + 1) if self.relative else (box.loss,)
        if self.at is not None:  # gain and lead fall with K_u, and the matrix is affine in each
            ends = [self.at(bound) for bound in (box.low / high, box.high / low)]
            return [(replace(a, gain=b.gain), loss) for a, b, loss in product(ends, ends, losses)]
        if self.relative:
            low = low * self._gain(box.high)
            high = high * self._gain(box.low)
        if self.fading == "gain":
            low = low / (1.0 + box.most / self.theta)
            high = high / (1.0 + box.least / self.theta)
        lead = law_for(self.loop.arm, 0.0, self.bound)
        return [(replace(lead, gain=g), loss) for g, loss in product(dict.fromkeys((low, high)), losses)]

    def corners(self, box: Box) -> list[tuple[float, float]]:
        """(K, B) of the corners; where the gain fades, of a fixed K, since g K alone counts and rest has to be one."""
        if self.fading == "gain":
            return [(box.high, t * box.high) for t in dict.fromkeys((box.least, box.most))]
        return box.corners(self.theta)

    def _gain(self, bound: float) -> float:
        """1/(theta K_eff) for a bound [N/m] as the law has it [m/(s N)]."""
        series = 0.0 if self.loop.arm.kind == "position" else 1.0 / self.loop.arm.series
        return (series + 1.0 / bound) / self.theta

    def matrices(self, box: Box) -> list[Array]:
        """Matrices of a tick at all corners, shape (size, size) each."""
        return [
            loop.phi(K, B, law, loss)
            for loop in self.loops(box.part)
            for K, B in self.corners(box)
            for law, loss in self.laws(box)
        ]

    def equilibrium(self, box: Box) -> Array:
        """The matrix without what fades: the command stands still."""
        if self.fading == "surface":
            return self.loop.phi(0.0, 0.0, Law(self.gains[0]), box.loss)
        return self.loop.phi(box.high, 0.0, Law(0.0))

    def loops(self, part: int) -> list[SampledLoop]:
        """One for each corner of a part of what the inner loop may be."""
        return [self.loop if c is None else replace(self.loop, inner=c) for c in self.inner(part)]

    def contraction(self, box: Box, L: Array) -> tuple[float, float]:
        """A bound of |L^T Phi L^-T| within the box, and how far rounding may have moved it.

        Both are upper bounds; the box is proved if their sum is below 1.
        """
        back = np.asarray(np.linalg.inv(L.T))
        condition = float(np.linalg.norm(L) * np.linalg.norm(back))
        matrices = self.matrices(box)
        transformed = np.array([L.T @ Phi @ back for Phi in matrices])
        size = max(float(np.linalg.norm(Phi)) for Phi in matrices)
        largest = float(np.linalg.norm(transformed, 2, axis=(1, 2)).max())
        if not self.exact and largest < 1.0:
            largest = _with_rest(transformed, self._rest(box, L, back), largest)
        return largest, 16.0 * len(L) * EPS * condition * size

    def _rest(self, box: Box, L: Array, back: Array) -> Array:
        """R with |L^T D x| <= |R L^T x| for D the distance of any matrix of the box from its corners' hull."""
        bound = curvature_bound(self, box)
        p = len(bound)
        columns = np.flatnonzero(bound.any(axis=0))
        sizes = np.linalg.norm(np.abs(L.T[:, :p]) @ bound[:, columns], axis=0) * np.sqrt(len(columns))
        fed = [self._input_map(law, loss)[columns] for law, loss in self.laws(box)]
        return np.array([sizes[:, None] * (f @ back) for f in fed])

    def _input_map(self, law: Law, loss: int) -> Array:
        """Map from the state to z and the held input, shape (p + 1, size), on which the exponential acts.

        For a position arm z's first number is counted from the held input: at rest it is nothing.
        """
        p = len(self.loop.rates(1.0, 0.0)[1])
        into = np.zeros(p)
        into[0] = 1.0
        Phi = self.loop.tick_matrix(np.zeros((p, p)), into, self.loop.force_gain(0.0, 0.0), law, loss)
        fed = np.vstack([np.eye(p, self.loop.size), Phi[:1]])
        if self.loop.arm.kind == "position":
            fed[0] -= fed[p]
        return fed


def _with_rest(turned: Array, rests: Array, alone: float) -> float:
    """A bound of |T x| + |R x| over |x|, by (1 + h) T^T T + (1 + 1/h) R^T R; of the best h tried.

    Args:
        turned: T, shape (m, n, n).
        rests: R, shape (r, k, n).
        alone: the largest norm of a T.
    """
    rest_norm = float(np.linalg.norm(rests, 2, axis=(1, 2)).max())
    if rest_norm == 0.0:
        return alone
    best = alone + rest_norm
    room = max(1.0 - alone**2, 1e-300)
    if best < 1.0:
        return best
    wide = rests.reshape(-1, rests.shape[2])  # all of them at once bound each of them
    for h in (0.75 * room, 0.5 * room, 0.25 * room, 0.1 * room):
        below = np.broadcast_to(np.sqrt(1.0 + 1.0 / h) * wide, (len(turned), *wide.shape))
        both = np.concatenate([np.sqrt(1.0 + h) * turned, below], axis=1)
        best = min(best, float(np.linalg.norm(both, 2, axis=(1, 2)).max()))
    return best


def curvature_bound(prover: Prover, box: Box) -> Array:
    """Bound of the distance of E = exp(T A) from the multilinear function through its corners, shape (p, p + 1).

    The parameters are w^2 and 2 z w for a position arm, K + B/theta and 1/(1 + B/(K theta)) for others: A is
    affine in each alone, so that the distance is at most sum of h^2/8 |E''|, and |E''| at most twice the last block of
    the exponential of [[M, |D|, 0], [0, M, |D|], [0, 0, M]], where M has the largest sizes of A's elements, and on its
    diagonal their largest values: |exp(t A)| <= exp(t M), since |1 + t a/n| = 1 + t a/n for all large n.
    """
    from scipy.linalg import expm

    tick = prover.loop.arm.tick
    rates = [_rates(loop, K, B) for loop in prover.loops(box.part) for K, B in prover.corners(box)]
    size = np.abs(rates).max(axis=0)
    np.fill_diagonal(size, np.max([np.diag(A) for A in rates], axis=0))
    n = len(size)
    bound = np.zeros((n, n))
    for D in _directions(prover, box, rates):
        both = np.zeros((3 * n, 3 * n))
        for i in range(3):
            both[i * n : (i + 1) * n, i * n : (i + 1) * n] = size
        both[:n, n : 2 * n] = both[n : 2 * n, 2 * n :] = D
        bound += 0.25 * (1.0 + 1e-9) * expm(tick * both)[:n, 2 * n :]
    return bound[: n - 1]


def _directions(prover: Prover, box: Box, rates: list[Array]) -> list[Array]:
    """Change of A from one end of each parameter to the other, by element."""
    if prover.loop.arm.kind == "position":
        square, rate = zip(*(corner for corner in prover.inner(box.part) if corner is not None), strict=True)
        unit = prover.loop.rate_unit
        first = np.zeros_like(rates[0])
        second = np.zeros_like(rates[0])
        first[1, 0], second[1, 1] = (max(square) - min(square)) / unit, max(rate) - min(rate)
        return [first, second]
    theta = prover.theta
    loop = prover.loop
    none = _rates(loop, 0.0, 0.0)
    K = np.abs(_rates(loop, 1.0, 0.0) - none)
    B = np.abs(_rates(loop, 0.0, 1.0) - none)
    fractions = [1.0 / (1.0 + t / theta) for t in (box.most, box.least)]
    along = (box.high - box.low) * np.maximum(
        fractions[0] * K + theta * (1.0 - fractions[0]) * B,
        fractions[1] * K + theta * (1.0 - fractions[1]) * B,
    )
    return [along, (fractions[1] - fractions[0]) * box.high * (K + theta * B)]


def _rates(loop: SampledLoop, K: float, B: float) -> Array:
    """d/dt of z and the held input; for a position arm, z's first number counted from the input."""
    A, b = loop.rates(K, B)
    M = np.zeros((len(b) + 1, len(b) + 1))
    M[:-1, :-1], M[:-1, -1] = A, b
    if loop.arm.kind == "position":
        M[:-1, -1] += A[:, 0]
    return M
