"""Between which values of a number of the experiment, or of a bench, the linear loop is stable."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import exp, log
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.analysis.constant_modes import effective_states
from palpate.analysis.linear_model import linearise
from palpate.analysis.stability_cells import stable_pieces
from palpate.arrays import Array
from palpate.bench.bench import Bench
from palpate.bench.experiments.tables import Experiment, changed
from palpate.environments.surface import alone
from palpate.errors import InputError, unknown

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
        return changed(of, {key: value})
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
