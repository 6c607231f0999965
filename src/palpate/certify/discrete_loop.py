"""One axis of a sampled force loop that presses a spring: the stable stiffnesses, and a proof in exact arithmetic.

The surface pulls the reading to f = u - K x, so a position or velocity arm gives x+ = A(K) x + b u with A(K) affine in
K. A torque arm (`palpate.certify.torque_loop`) swings on the spring between two ticks, and bends a little in K.
"""

from __future__ import annotations

from fractions import Fraction
from math import floor
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

import numpy as np

from palpate.certify.force_certificate import Ball, is_positive, symmetric

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from palpate.arrays import Array

SCANNED_STIFFNESS = (1.0, 1e7)
"""Stiffnesses that are scanned [N/m]: from far softer than skin to stiffer than any arm's own structure."""
POINTS_PER_DECADE = 80
"""An island of stability or of instability wider than 3 % holds a point of the scan."""
STABILITY_MARGIN = 1e-9
"""Distance of the eigenvalues from the unit circle: their rounding error where two of them nearly coincide."""
PROVED_FRACTION = 0.99
"""Fraction of the edge up to which a proof is tried; nearer to the edge its cells become too many."""
MAX_CELLS = 600
BALANCING_ROUNDS = 10
GROWTH_SPARES = tuple(2.0**-i for i in range(2, 40, 2))
"""Values of s in (|a| + |b|)^2 <= (1 + s) a^2 + (1 + 1/s) b^2 that are tried."""
STRICTNESSES = (1e-6, 1e-4, 1e-2)
"""Least decreases of the norm in the balanced states that are tried: they pay for rounding, and for what bends."""
MIN_CELL_RATIO, MAX_CELL_RATIO = 1.0002, 4.0
MAX_STEP_TICKS = 60_000
"""Ticks of a step response: a minute at 1 kHz."""


class LoopOnSpring(Protocol):
    """One axis in contact with a spring, as a linear system of one tick."""

    def matrices(self, stiffness: Array) -> Array:
        """A(K) for each stiffness [N/m]; shape (m, n, n)."""
        ...

    def inputs(self, stiffness: Array) -> Array:
        """Change of the state by one newton of commanded force, for each stiffness; shape (m, n)."""
        ...

    def exact_matrix(self, stiffness: Fraction) -> Any:
        """A(K) in fractions, each within 2^-400 of the true element; shape (n, n)."""
        ...

    def bend(self, low: float, high: float) -> Array | None:
        """Bounds of the distance of A(K) from the chord between the ends, for each element; None for a straight one."""
        ...

    @property
    def pressed(self) -> int:
        """Index, among the states, of the position whose force is read."""
        ...


class AffineLoop(NamedTuple):
    """Loop of a position or velocity arm, in exact fractions.

    Args:
        rows: next state from the state and, in the last column, from the reading of the force; shape (n, n + 1).
        pressed: index, among the states, of the position whose force is read.
    """

    rows: Any
    pressed: int

    def matrices(self, stiffness: Array) -> Array:
        """A(K) for each stiffness [N/m]; shape (m, n, n)."""
        rows = self.rows.astype(float)
        A = np.repeat(rows[None, :, :-1], len(stiffness), axis=0)
        A[:, :, self.pressed] -= np.asarray(stiffness)[:, None] * rows[:, -1]
        return A

    def inputs(self, stiffness: Array) -> Array:
        """Change of the state by one newton of commanded force, for each stiffness; shape (m, n)."""
        return np.repeat(self.rows[None, :, -1].astype(float), len(stiffness), axis=0)

    def exact_matrix(self, stiffness: Fraction) -> Any:
        """A(K) in fractions; shape (n, n)."""
        A = self.rows[:, :-1].copy()
        A[:, self.pressed] -= stiffness * self.rows[:, -1]
        return A

    def bend(self, _low: float, _high: float) -> Array | None:
        """None, because A is affine in K."""
        return None


def split_delay(delay: float, rate: float) -> tuple[int, Fraction]:
    """Whole ticks of a delay [s], and its rest as a fraction of a tick; a rest below 1e-9 is rounding."""
    ticks = delay * rate
    whole = floor(ticks + 1e-9)
    return whole, Fraction(max(0.0, ticks - whole)) if ticks - whole > 1e-9 else Fraction(0)


def growth(loop: LoopOnSpring, stiffness: Array) -> Array:
    """Largest magnitude of the eigenvalues of A(K), for each stiffness [N/m]."""
    parts = np.array_split(stiffness, max(1, len(stiffness) // 64))
    return np.concatenate([abs(np.linalg.eigvals(loop.matrices(part))).max(axis=1) for part in parts])


def is_stable(loop: LoopOnSpring, stiffness: float) -> bool:
    """True if all eigenvalues of A(K) lie within the unit circle by the margin."""
    return bool(growth(loop, np.array([stiffness]))[0] < 1.0 - STABILITY_MARGIN)


def runs_away_in_free_motion(loop: LoopOnSpring) -> bool:
    """True if some eigenvalue without a surface lies outside the unit circle; on the circle is a tip that drifts."""
    return bool(growth(loop, np.zeros(1))[0] > 1.0 + 1e-6)


def stable_ranges(loop: LoopOnSpring) -> list[tuple[float, float]]:
    """Intervals of stiffness on which the eigenvalues are stable [N/m]: the whole range is scanned, edges bisected."""
    low, high = SCANNED_STIFFNESS
    count = round(np.log10(high / low) * POINTS_PER_DECADE) + 1
    grid = np.geomspace(low, high, count)
    stable = growth(loop, grid) < 1.0 - STABILITY_MARGIN
    changes = np.flatnonzero(stable[1:] != stable[:-1])
    edges = [_edge(loop, float(grid[i]), float(grid[i + 1]), rising=bool(stable[i + 1])) for i in changes]
    ends = [*[low][: int(stable[0])], *edges, *[high][: int(stable[-1])]]
    return list(zip(ends[::2], ends[1::2], strict=True))


def _edge(loop: LoopOnSpring, low: float, high: float, *, rising: bool) -> float:
    """Stiffness at which stability changes, on its stable side."""
    for _ in range(30):
        middle = float(np.sqrt(low * high))
        if is_stable(loop, middle) == rising:
            high = middle
        else:
            low = middle
    return high if rising else low


def prove(loops: Sequence[LoopOnSpring], low: float, high: float) -> tuple[float, float] | None:
    """Interval from `low` on which every loop is proved stable; None if not even its first cell is.

    In a cell from K1 to K2 one norm has to shrink at both ends, x^T (P - A^T P A) x > 0 in exact arithmetic. Where A is
    affine in K, A^T P A is convex in K and the norm shrinks in between as well. Otherwise A is off the chord between
    the ends by E, |E x|^2 <= x^T W x in that norm, and (1 + s) A^T P A + (1 + 1/s) W has to be below P at both ends.
    """
    reached = high
    for loop in loops:
        reached = min(reached, _proved_end(loop, low, reached))
    return (low, reached) if reached > low else None


def _proved_end(loop: LoopOnSpring, low: float, high: float) -> float:
    ratio = 2.0
    for _ in range(MAX_CELLS):
        if low >= high or ratio < MIN_CELL_RATIO:
            break
        end = min(high, low * ratio)
        if _cell_shrinks(loop, low, end):
            low, ratio = end, min(ratio * ratio, MAX_CELL_RATIO)
        else:
            ratio = min(ratio, end / low) ** 0.5
    return low


def _cell_shrinks(loop: LoopOnSpring, low: float, high: float) -> bool:
    middle, *ends = loop.matrices(np.array([0.5 * (low + high), low, high]))
    scale = _balance(middle)
    middle, *ends = (matrix * scale / scale[:, None] for matrix in (middle, *ends))
    bend = loop.bend(low, high)
    if bend is not None and not np.isfinite(bend).all():
        return False
    factors = [Fraction(float(s)) for s in scale]
    for strictness in STRICTNESSES:
        P = _norm(middle, 0.5 * (ends[1] - ends[0]), strictness)
        if P is None:
            continue
        W = None if bend is None else _weights(P, bend * scale / scale[:, None])
        spare = _growth_spare(P, W, ends)
        if spare is None:
            continue
        exact = _exact(P)
        left = exact if W is None else _exact(P, W, Fraction(spare))
        return is_positive(exact) and all(
            _shrinks(left, exact, _scaled(loop.exact_matrix(Fraction(K)), factors), Fraction(spare))
            for K in (low, high)
        )
    return False


def _growth_spare(P: Array, W: Array | None, ends: Sequence[Array]) -> float | None:
    """Growth s for which P - (1 + 1/s) W - (1 + s) A^T P A is positive at both ends in floats; None without."""
    for spare in (0.0,) if W is None else GROWTH_SPARES:
        left = P if W is None else P - np.diag(W * (1.0 + 1.0 / spare))
        if all(np.linalg.eigvalsh(left - (1.0 + spare) * A.T @ P @ A)[0] > 0.0 for A in ends):
            return spare
    return None


def _weights(P: Array, bend: Array) -> Array:
    """Diagonal of W with |E x|^2 <= x^T W x in the norm P, from bounds of E (Cauchy and Schwarz); shape (n,)."""
    sizes = np.einsum("ij,ik,kj->j", bend, abs(P), bend)
    return np.asarray(sizes * np.count_nonzero(sizes) * (1.0 + 1e-9))


def _exact(P: Array, W: Array | None = None, spare: Fraction = Fraction(1)) -> Ball:
    """P, less (1 + 1/spare) W on its diagonal."""
    rows = [[Fraction(value) for value in row] for row in P.tolist()]
    for i, weight in enumerate([] if W is None else W.tolist()):
        rows[i][i] -= (1 + 1 / spare) * Fraction(weight)
    return Ball.of(rows)


def _scaled(A: Any, factors: list[Fraction]) -> Ball:
    rows = [[value * b / a if value else value for value, b in zip(row, factors, strict=True)]
            for row, a in zip(A, factors, strict=True)]  # fmt: skip
    return Ball.of(rows, 2)


def _shrinks(left: Ball, P: Ball, A: Ball, spare: Fraction) -> bool:
    """True if (1 + spare) A^T P A is below `left`."""
    after = symmetric(P, A).times(1 + spare)
    return is_positive(Ball(left.middle - after.middle, left.error + after.error))


def _balance(A: Array) -> Array:
    """Powers of two that bring rows and columns of a matrix to like size (Osborne's iteration); shape (n,)."""
    size = abs(A) * (1.0 - np.eye(len(A)))
    exponents = np.zeros(len(A))
    for i in [*range(len(A))] * BALANCING_ROUNDS:
        row, column = size[i].sum(), size[:, i].sum()
        if row > 0.0 and column > 0.0:
            step = np.round(0.5 * (np.log2(row) - np.log2(column)))
            step = np.clip(exponents[i] + step, -100.0, 100.0) - exponents[i]
            exponents[i] += step
            size[i] *= 2.0**-step
            size[:, i] *= 2.0**step
    return 2.0**exponents


def _norm(A: Array, change: Array, strictness: float) -> Array | None:
    """P that shrinks by A + s change for every |s| <= 1 (bounded real lemma); None without.

    Args:
        A: of the middle of the cell, balanced.
        change: half the change of A over the cell; a force on the position changes it in one direction, or nearly.
        strictness: least decrease in any state, beside that along the change.
    """
    from scipy.linalg import solve_discrete_are

    left, sizes, right = np.linalg.svd(change)
    column, row = left[:, 0] * sizes[0], right[0]
    Q = strictness * np.eye(len(A)) + np.outer(row, row)
    try:
        P: Array = solve_discrete_are(A, column[:, None], Q, -np.eye(1))
    except (np.linalg.LinAlgError, ValueError):
        return None
    P = 0.5 * (P + P.T)
    return P / abs(P).max() if np.isfinite(P).all() else None


def overshoot(loop: LoopOnSpring, stiffness: Iterable[float]) -> Array:
    """Overshoot of the contact force after a step of the commanded force, relative to its final value; shape (m,).

    Infinite where the loop is unstable, or not settled after `MAX_STEP_TICKS`.
    """
    K = np.fromiter(stiffness, float)
    largest = growth(loop, K)
    result = np.full(len(K), np.inf)
    settled = np.flatnonzero(largest < 1.0 - STABILITY_MARGIN)
    ticks = np.log(1e-3) / np.log(np.minimum(largest, 1.0 - STABILITY_MARGIN))
    settled = settled[ticks[settled] <= MAX_STEP_TICKS]
    if not len(settled):
        return result
    A, b = loop.matrices(K[settled]), loop.inputs(K[settled])
    final = np.linalg.solve(np.eye(A.shape[1]) - A, b[..., None])[:, loop.pressed, 0]
    x, peak = np.zeros_like(b), np.zeros(len(settled))
    for _ in range(int(ticks[settled].max()) + 10):
        x = np.einsum("mij,mj->mi", A, x) + b
        peak = np.maximum(peak, x[:, loop.pressed] / final)
    result[settled] = np.maximum(0.0, peak - 1.0)
    return result
