"""Between which values of a number of the experiment, or of a bench, the linear loop is stable: no grid.

The range is divided into cells in which the loop is stable or is not, as small as its matrices ask for. Over a cell the
loop's period is a quadratic in the number, through three values of it; its error is measured at two more. A quadratic
of matrices lies in the hull of its Bernstein coefficients: where all of these contract in one norm by more than the
error, so does every loop of the cell. A cell is not stable if the growth of the fastest mode stays above 1 by more than
the error of its own quadratic. An undecided cell is halved. An island is missed only if five values of its cell show
nothing of it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from math import exp, log
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.arrays import Array
from palpate.bench.bench import Bench
from palpate.bench.tables import Experiment, with_values
from palpate.environments.surface import alone
from palpate.errors import InputError, unknown
from palpate.force.lyapunov import single
from palpate_studies.analysis.linear_loop import change, effective_states
from palpate_studies.analysis.linear_model import linearise

Period = Callable[[float], Array]

EXACT = 1e-4
"""Width of a cell at which it counts as a boundary, in a coordinate whose unit is the number's own size."""
FIRST = 4
"""Cells at the start, of five values each."""
MISSED = 1.1
"""Largest error of a quadratic over its error halfway between its values: 1.03 for a cubic's remainder."""
SMOOTH = 1e-3
"""Of a period's size, that its quadratic may miss where the quartic through all five stands for it, and misses 1e-5."""


@dataclass(frozen=True)
class StabilityCell:
    """A piece of the number's coordinate and the period's matrices in it.

    Args:
        low, high: of the coordinate.
        nodes: d x(a period later)/d x at five even places, from `low` to `high`.
    """

    low: float
    high: float
    nodes: tuple[Array, Array, Array, Array, Array]

    @property
    def width(self) -> float:
        """Width of the cell in its coordinate."""
        return self.high - self.low

    def error_at_quarters(self) -> list[Array]:
        """Error at the quarters of the quadratic through ends and middle."""
        a, p, m, q, b = self.nodes
        return [p - (0.375 * a + 0.75 * m - 0.125 * b), q - (0.375 * b + 0.75 * m - 0.125 * a)]

    def at(self, share: float) -> Array:
        """The quartic through all five."""
        places, found = np.linspace(0.0, 1.0, 5), np.zeros_like(self.nodes[0])
        for i, matrix in enumerate(self.nodes):
            others = np.delete(places, i)
            found += np.prod((share - others) / (places[i] - others)) * matrix
        return found

    def halves(self, period: Period | None) -> list[StabilityCell]:
        """Both halves: of periods where they are given, else of the quartic."""
        middle = 0.5 * (self.low + self.high)
        found = []
        for first, (low, high) in ((0, (self.low, middle)), (2, (middle, self.high))):
            a, m, b = self.nodes[first : first + 3]
            shares = (0.125 + 0.25 * first, 0.375 + 0.25 * first)
            if period is None:
                p, q = map(self.at, shares)
            else:
                p, q = (period(self.low + share * self.width) for share in shares)
            found.append(StabilityCell(low, high, (a, p, m, q, b)))
        return found


def stable_pieces(period: Period, low: float, high: float) -> list[tuple[float, float]]:
    """All pieces of low ... high in which the loop is stable.

    Args:
        period: d x(a period later)/d x at a value of the coordinate, scaled, shape (n, n).
        low: of the coordinate.
        high: of it.
    """
    places = np.linspace(low, high, 4 * FIRST + 1).tolist()
    known = [period(s) for s in places]
    found: list[tuple[float, float]] = []
    for i in range(0, 4 * FIRST, 4):
        a, p, m, q, b = known[i : i + 5]
        for cell in _stable(StabilityCell(places[i], places[i + 4], (a, p, m, q, b)), period):
            if found and found[-1][1] == cell.low:
                found[-1] = (found[-1][0], cell.high)
            else:
                found.append((cell.low, cell.high))
    return found


def _stable(cell: StabilityCell, period: Period | None) -> Iterator[StabilityCell]:
    """The stable cells of a cell, from below."""
    if unstable(cell):
        return
    if contracts(cell):
        yield cell
        return
    if cell.width < EXACT:
        if all(growth(M) < 0.0 for M in cell.nodes):  # a boundary is touched, not crossed
            yield cell
        return
    smooth = max(map(_size, cell.error_at_quarters())) < SMOOTH * max(map(_size, cell.nodes))
    for half in cell.halves(None if smooth else period):
        yield from _stable(half, None if smooth else period)


def _size(matrix: Array) -> float:
    return float(np.linalg.norm(matrix))


def growth(matrix: Array) -> float:
    """Logarithm of the largest modulus of an eigenvalue, those of what never changes left out."""
    into, _, _ = change(matrix)
    return float(np.log(np.abs(np.linalg.eigvals(into.T @ matrix @ into)).max() + 1e-300))


def unstable(cell: StabilityCell) -> bool:
    """Whether the fastest mode grows everywhere in the cell."""
    if not all(growth(M) > 0.0 for M in cell.nodes[::-2]):
        return False
    a, p, m, q, b = rates = [growth(M) for M in cell.nodes]
    if min(rates) <= 0.0:
        return False
    missed = abs(p - (0.375 * a + 0.75 * m - 0.125 * b)), abs(q - (0.375 * b + 0.75 * m - 0.125 * a))
    return MISSED * max(missed) < min(*rates, 2.0 * m - 0.5 * (a + b))


def contracts(cell: StabilityCell) -> bool:
    """Whether one norm contracts in all of the cell, what never changes left out."""
    into, _, _ = change(cell.nodes[2])
    inside = [into.T @ M @ into for M in cell.nodes]
    L = single(inside[2])
    if L is None:
        return False
    back = np.linalg.inv(L.T)
    a, p, m, q, b = (L.T @ M @ back for M in inside)
    hull = max(float(np.linalg.norm(M, 2)) for M in (a, 2.0 * m - 0.5 * (a + b), b))
    missed = StabilityCell(cell.low, cell.high, (a, p, m, q, b)).error_at_quarters()
    return hull + MISSED * max(float(np.linalg.norm(M, 2)) for M in missed) < 1.0


LOW, HIGH = 100.0, 3e6
"""Stiffnesses that are looked at [N/m]."""
SURFACE, PLACE = "surface.", "plant.surface."
"""How experiments name the surface, and where a bench has it."""


def stable_intervals(
    of: Experiment | Bench, key: str, low: float, high: float, **options: Any
) -> list[tuple[float, float]]:
    """All intervals of one number within low ... high in which the loop is stable, the smallest first.

    No grid: the range is covered by cells, as small as the loop's matrices ask for, in which one norm contracts or a
    mode grows, and by boundaries between them, a ten-thousandth wide; see `stability_cells`. The tip stays where it is:
    the wall is put so that the surface, pressed, reaches it.

    Args:
        of: all other numbers; an experiment, or a bench.
        key: which number: "surface.stiffness", "controller.kf", ... of a bench as its `loop` names it.
        low: of the range; above 0 the cells lie on a logarithmic scale.
        high: of the range. An interval that reaches either end may go on beyond.
        options: of `linearise`.

    Raises:
        InputError: an unknown key, an empty range, a value out of its own range.
    """
    if not low < high:
        raise InputError(f"the range must have its lower end first, got {low:g} ... {high:g}")
    options.setdefault("x", float(linearise(of, **options).pose[0]))
    value: Callable[[float], float] = exp if low > 0.0 else (lambda s: high * s)
    ends = (log(low), log(high)) if low > 0.0 else (low / high, 1.0) if high > 0.0 else (low, high)
    if high <= 0.0:
        value = float
    kept: list[NDArray[np.intp]] = []

    def period(s: float) -> Array:
        loop = linearise(_with(of, key, min(max(value(s), low), high)), **options)
        if not kept:
            kept.append(effective_states(loop.transition))
        steps = loop.motion.steps
        return (loop.transition / steps[:, None] * steps)[np.ix_(kept[0], kept[0])]

    pieces = stable_pieces(period, *ends)
    known = {ends[0]: low, ends[1]: high}
    return [(known.get(a, value(a)), known.get(b, value(b))) for a, b in pieces]


def stable_stiffness(
    of: Experiment | Bench, low: float = LOW, high: float = HIGH, **options: Any
) -> tuple[float, float]:
    """The stiffnesses K_e on which the force loop is stable, all else as it is, B_e too [N/m].

    The interval that the own stiffness lies in; the first one, if that is in none.

    Args:
        of: any experiment, or a bench.
        low: end of the range [N/m].
        high: of it; an interval that reaches either end may go on beyond.
        options: of `linearise`.

    Raises:
        InputError: no stable stiffness in that range.
    """
    found = stable_intervals(of, "surface.stiffness", low, high, **options)
    if not found:
        raise InputError(f"the loop is stable on no stiffness from {low:g} to {high:g} N/m; lower a gain")
    surface = alone(of.loop.plant.surface) if isinstance(of, Bench) else of.surface
    own = float(surface.stiffness)
    return next(((a, b) for a, b in found if a <= own <= b), found[0])


def _with(of: Experiment | Bench, key: str, value: float) -> Experiment | Bench:
    """The experiment, or the bench, with another value of a number."""
    if isinstance(of, Experiment):
        return with_values(of, {key: value})
    path = PLACE + key.removeprefix(SURFACE) if key.startswith(SURFACE) else key
    return replace(of, loop=_put(of.loop, path, value, key))


def _put(tree: Any, path: str, value: float, key: str) -> Any:
    """Nested parts with another value at a path; of parts joined to one type, in the one that is meant."""
    if hasattr(tree, "chosen"):
        chosen = "first" if tree.chosen == 1 else "second"
        own = {chosen: _put(getattr(tree, chosen), path, value, key)}
        return tree._replace(**own, **({path: value} if path in tree._fields else {}))
    name, _, rest = path.partition(".")
    if name not in getattr(tree, "_fields", ()):
        raise unknown("number of the bench", key, getattr(tree, "_fields", ()))
    before = getattr(tree, name)
    if rest:
        return tree._replace(**{name: _put(before, rest, value, key)})
    if not isinstance(before, float):
        raise InputError(f"{key} is no number of the bench but {type(before).__name__}; name one within it")
    return tree._replace(**{name: value})
