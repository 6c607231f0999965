"""Cells of surfaces, each with a norm in which every tick of the loop contracts: checked by norms alone.

A surface is (K, B). A cell is what lies between two lines K + B/theta and two damping times B/K: a quadrilateral. For a
position arm the loop's matrix is affine in (K, B), in the gain and in which reading is used, so that what contracts at
the corners contracts everywhere between, also if it changes from tick to tick. For a torque arm it is a matrix
exponential of what is affine: the distance from the corners' hull is bounded by its second derivative.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from palpate.force.sampled_loop import Law, SampledLoop

Array = NDArray[np.float64]

EPS = float(np.finfo(np.float64).eps)


@dataclass(frozen=True)
class Box:
    """Surfaces between two bounds and two damping times.

    Args:
        low: K + B/theta from [N/m].
        high: to [N/m].
        least: B/K from [s].
        most: to [s].
    """

    low: float
    high: float
    least: float
    most: float

    def corners(self, theta: float) -> list[tuple[float, float]]:
        """(K, B) of the corners; one where the box is a point in that direction."""
        times = dict.fromkeys((self.least, self.most))
        return [
            (bound / (1.0 + t / theta), t * bound / (1.0 + t / theta))
            for bound in dict.fromkeys((self.low, self.high))
            for t in times
        ]

    def halves(self, theta: float) -> tuple[Box, Box]:
        """The box cut across its longer side: bounds by their ratio, damping times against theta."""
        if np.log(self.high / self.low) >= np.log((self.most + theta) / (self.least + theta)):
            middle = float(np.sqrt(self.low * self.high))
            return Box(self.low, middle, self.least, self.most), Box(middle, self.high, self.least, self.most)
        middle = float(np.sqrt((self.most + theta) * (self.least + theta)) - theta)
        return Box(self.low, self.high, self.least, middle), Box(self.low, self.high, middle, self.most)


@dataclass(frozen=True)
class Prover:
    """The loops that have to contract in every cell.

    Args:
        loop: the sampled loop; with `jitter`, of the oldest reading.
        theta: of the law [s].
        gains: g of a tick may be anything between these two [m/(s N)]; if `relative`, g theta K_eff(K + B/theta) may.
        jitter: ticks by which a reading may be younger, from tick to tick.
        kept: of the command's low-pass.
        relative: see `gains`.
    """

    loop: SampledLoop
    theta: float
    gains: tuple[float, float]
    jitter: int = 0
    kept: float = 0.0
    relative: bool = False

    @property
    def affine(self) -> bool:
        """Whether the matrix is affine in (K, B), so that corners tell everything."""
        return self.loop.arm.kind == "position"

    def laws(self, box: Box) -> list[tuple[Law, int]]:
        """The extreme laws and readings within a box."""
        low, high = self.gains
        if self.relative:
            low, high = low * self._gain(box.high), high * self._gain(box.low)
        return [
            (Law(g, self.kept), loss)
            for g, loss in product(dict.fromkeys((low, high)), range(self.jitter + 1))
        ]

    def _gain(self, bound: float) -> float:
        """1/(theta K_eff) for a bound [N/m] as the law has it [m/(s N)]."""
        series = 0.0 if self.affine else 1.0 / self.loop.arm.series
        return (series + 1.0 / bound) / self.theta

    def matrices(self, box: Box) -> list[Array]:
        """Of all corners, shape (size, size) each."""
        laws = self.laws(box)
        return [self.loop.phi(K, B, law, loss) for K, B in box.corners(self.theta) for law, loss in laws]

    def contraction(self, box: Box, L: Array) -> tuple[float, float]:
        """The largest norm |L^T Phi L^-T| within the box, and how far rounding may have moved it.

        Both are upper bounds; the box is proved if their sum is below 1.
        """
        back = np.linalg.inv(L.T)
        condition = float(np.linalg.norm(L) * np.linalg.norm(back))
        worst, size = 0.0, 0.0
        for Phi in self.matrices(box):
            worst = max(worst, float(np.linalg.norm(L.T @ Phi @ back, 2)))
            size = max(size, float(np.linalg.norm(Phi)))
        n = len(L)
        return worst + self.curvature(box, L, np.asarray(back)), 16.0 * n * EPS * condition * size

    def curvature(self, box: Box, L: Array, back: Array) -> float:
        """How far within the box the matrix may lie from its corners' hull, in the norm of L; 0 where it is affine.

        E(p) = exp(T A(p)) with A affine: |E''[d, d]| <= T^2 |A[d]|^2 exp(T mu), mu the largest logarithmic norm; a
        function lies within half of that, d from corner to corner, of the hull of its corners.
        """
        loop = self.loop
        if self.affine:
            return 0.0
        tick = loop.arm.tick
        rates = [self._rates(K, B) for K, B in box.corners(self.theta)]
        p = len(rates[0]) - 1
        W = self._weight(L, p)
        inverse = np.linalg.inv(W)
        turned = [W @ A @ inverse for A in rates]
        mu = max(float(np.linalg.eigvalsh(0.5 * (A + A.T))[-1]) for A in turned)
        across = max(float(np.linalg.norm(a - b, 2)) for a in turned for b in turned)
        outside = float(np.linalg.norm(L.T[:, :p] @ inverse[:p], 2))
        feeding = max(
            float(np.linalg.norm(W @ self._fed(law, loss) @ back, 2)) for law, loss in self.laws(box)
        )
        return 0.5 * tick**2 * across**2 * float(np.exp(tick * max(mu, 0.0))) * outside * feeding

    def _rates(self, K: float, B: float) -> Array:
        A, b = self.loop.rates(K, B)
        M = np.zeros((len(b) + 1, len(b) + 1))
        M[:-1, :-1], M[:-1, -1] = A, b
        return M

    def _fed(self, law: Law, loss: int) -> Array:
        """From the state to z and the held input, shape (p + 1, size): what the exponential acts on."""
        p = len(self.loop.rates(1.0, 0.0)[1])
        into = np.zeros(p)
        into[0] = 1.0
        Phi = self.loop.assembled(np.zeros((p, p)), into, np.zeros(p), law, loss)
        return np.vstack([np.eye(p, self.loop.size), Phi[:1]])

    @staticmethod
    def _weight(L: Array, p: int) -> Array:
        """A norm for z and the held input, in which the exponential is bounded: that of L on z."""
        P = L @ L.T
        W = np.zeros((p + 1, p + 1))
        W[:p, :p] = np.linalg.cholesky(P[:p, :p]).T
        W[p, p] = float(np.sqrt(np.trace(P[:p, :p]) / p))
        return W
