"""One axis of a sampled force loop that presses a spring: the stable stiffnesses, and a proof in exact arithmetic.

The surface pulls the reading to f = u - K x, so a position or velocity arm gives x+ = A(K) x + b u with A(K) affine in
K. A torque arm of mass m swings on the spring between two ticks; its A(K) follows from the exact oscillation.
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
MAX_STATES = 400
PROVED_FRACTION = 0.99
"""Fraction of the edge up to which a proof is tried; nearer to the edge its cells become too many."""
MAX_CELLS = 600
BALANCING_ROUNDS = 10
STRICTNESS = 1e-6
"""Decrease of the norm in the balanced states, beside that of the position: it pays for the rounding of floats."""
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

    @property
    def position_row(self) -> Array:
        """Row that gives the tip's position [m] from the state; shape (n,)."""
        ...


class AffineLoop(NamedTuple):
    """Loop of a position or velocity arm, in exact fractions.

    Args:
        rows: next state from the state and, in the last column, from the reading of the force; shape (n, n + 1).
        position: index, among the states, of the position whose force is read.
    """

    rows: Any
    position: int

    def matrices(self, stiffness: Array) -> Array:
        """A(K) for each stiffness [N/m]; shape (m, n, n)."""
        rows = self.rows.astype(float)
        A = np.repeat(rows[None, :, :-1], len(stiffness), axis=0)
        A[:, :, self.position] -= np.asarray(stiffness)[:, None] * rows[:, -1]
        return A

    def inputs(self, stiffness: Array) -> Array:
        """Change of the state by one newton of commanded force, for each stiffness; shape (m, n)."""
        return np.repeat(self.rows[None, :, -1].astype(float), len(stiffness), axis=0)

    @property
    def position_row(self) -> Array:
        """Row that gives the tip's position [m] from the state; shape (n,)."""
        return np.eye(len(self.rows))[self.position]

    def exact_matrix(self, stiffness: Fraction) -> Any:
        """A(K) in fractions; shape (n, n)."""
        A = self.rows[:, :-1].copy()
        A[:, self.position] -= stiffness * self.rows[:, -1]
        return A


class TorqueSpringLoop(NamedTuple):
    """Loop of a torque arm: a mass on the surface's spring, driven by the force of the latest commands.

    State: position, velocity, and the commanded forces of the last ticks, the newest first.

    Args:
        feedback: commanded force from position and velocity [N/m, N s/m].
        mass: of the arm at its tip along the axis [kg].
        period: of a tick [s].
        whole: whole ticks of the delay.
        part: rest of the delay, as a fraction of a tick.
    """

    feedback: tuple[float, float]
    mass: float
    period: float
    whole: int
    part: float

    def matrices(self, stiffness: Array) -> Array:
        """A(K) for each stiffness [N/m]; shape (m, n, n)."""
        return self._system(stiffness)[..., :-1]

    def inputs(self, stiffness: Array) -> Array:
        """Change of the state by one newton of commanded force, for each stiffness; shape (m, n)."""
        return self._system(stiffness)[..., -1]

    @property
    def position_row(self) -> Array:
        """Row that gives the tip's position [m] from the state; shape (n,)."""
        return np.eye(self.whole + 3)[0]

    def _system(self, stiffness: Array) -> Array:
        n = self.whole + 3
        signals = np.eye(n, n + 1)
        command = -self.feedback[0] * signals[0] - self.feedback[1] * signals[1]
        command[-1] = 1.0
        commands = [command, *signals[2:]]
        swing, _ = self._oscillation(stiffness, self.period)
        rest, newer = self._oscillation(stiffness, self.period * (1.0 - self.part))
        _, older = self._oscillation(stiffness, self.period * self.part)
        older = np.einsum("mij,mj->mi", rest, older)
        system = np.zeros((len(stiffness), n, n + 1))
        system[:, :2] = np.einsum("mij,jk->mik", swing, signals[:2])
        system[:, :2] += newer[:, :, None] * commands[self.whole]
        system[:, :2] += older[:, :, None] * commands[self.whole + 1]
        system[:, 2:] = np.array(commands[:-1])
        return system

    def _oscillation(self, stiffness: Array, time: float) -> tuple[Array, Array]:
        """Position and velocity after a time from those before it, and from a constant force of one newton."""
        omega = np.sqrt(np.maximum(stiffness, 1e-9) / self.mass)
        cosine, sine = np.cos(omega * time), np.sin(omega * time)
        swing = np.array([[cosine, sine / omega], [-omega * sine, cosine]])
        forced = np.array([2.0 * np.sin(0.5 * omega * time) ** 2 / omega**2, sine / omega]) / self.mass
        return swing.transpose(2, 0, 1), forced.T


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
    ranges: list[tuple[float, float]] = []
    begin = low if stable[0] else None
    for i in range(1, count):
        if stable[i] != stable[i - 1]:
            edge = _edge(loop, float(grid[i - 1]), float(grid[i]), rising=bool(stable[i]))
            if begin is None:
                begin = edge
            else:
                ranges.append((begin, edge))
                begin = None
    return ranges if begin is None else [*ranges, (begin, high)]


def _edge(loop: LoopOnSpring, low: float, high: float, *, rising: bool) -> float:
    """Stiffness at which stability changes, on its stable side."""
    for _ in range(30):
        middle = float(np.sqrt(low * high))
        if is_stable(loop, middle) == rising:
            high = middle
        else:
            low = middle
    return high if rising else low


def prove(loops: Sequence[AffineLoop], low: float, high: float) -> tuple[float, float] | None:
    """Interval from `low` on which every loop is proved stable; None if not even its first cell is.

    In a cell from K1 to K2 one norm has to shrink at both ends, x^T (P - A^T P A) x > 0 in exact arithmetic: A is
    affine in K, so A^T P A is convex in K and the norm shrinks in between as well.
    """
    reached = high
    for loop in loops:
        reached = min(reached, _proved_end(loop, low, reached))
    return (low, reached) if reached > low else None


def _proved_end(loop: AffineLoop, low: float, high: float) -> float:
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


def _cell_shrinks(loop: AffineLoop, low: float, high: float) -> bool:
    middle, *ends = loop.matrices(np.array([0.5 * (low + high), low, high]))
    scale = _balance(middle)
    middle, *ends = (matrix * scale / scale[:, None] for matrix in (middle, *ends))
    P = _norm(middle, (ends[1] - ends[0])[:, loop.position] / 2.0, loop.position)
    if P is None or any(np.linalg.eigvalsh(P - E.T @ P @ E)[0] <= 0.0 for E in ends):
        return False
    factors = [Fraction(float(s)) for s in scale]
    exact = Ball.of([[Fraction(value) for value in row] for row in P.tolist()])
    return is_positive(exact) and all(_shrinks(exact, loop, Fraction(K), factors) for K in (low, high))


def _shrinks(P: Ball, loop: AffineLoop, stiffness: Fraction, factors: list[Fraction]) -> bool:
    A = loop.exact_matrix(stiffness)
    scaled = [[value * b / a if value else value for value, b in zip(row, factors, strict=True)]
              for row, a in zip(A, factors, strict=True)]  # fmt: skip
    after = symmetric(P, Ball.of(scaled))
    return is_positive(Ball(P.middle - after.middle, P.error + after.error))


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


def _norm(A: Array, column: Array, position: int) -> Array | None:
    """P that shrinks by A + s column e^T for every |s| <= 1 (bounded real lemma), e of the position; None without.

    Args:
        A: of the middle of the cell, balanced.
        column: half the change of A over the cell, which is in the column of the position alone.
        position: index of that column.
    """
    from scipy.linalg import solve_discrete_are

    Q = STRICTNESS * np.eye(len(A))
    Q[position, position] += 1.0
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
    A, b, row = loop.matrices(K[settled]), loop.inputs(K[settled]), loop.position_row
    final = np.linalg.solve(np.eye(A.shape[1]) - A, b[..., None])[..., 0] @ row
    x, peak = np.zeros_like(b), np.zeros(len(settled))
    for _ in range(int(ticks[settled].max()) + 10):
        x = np.einsum("mij,mj->mi", A, x) + b
        peak = np.maximum(peak, x @ row / final)
    result[settled] = np.maximum(0.0, peak - 1.0)
    return result
