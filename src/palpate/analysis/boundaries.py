"""Between which values of a number of the experiment the linear loop is stable."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np

from palpate.analysis.linear_model import linearise
from palpate.bench.experiments.tables import Experiment, changed
from palpate.errors import InputError

LOW, HIGH = 100.0, 3e6
"""Stiffnesses that are looked at [N/m]."""
POINTS = 16
"""Values tried before the boundaries between them are found exactly."""
EXACT = 1e-4
"""Of a boundary, relative."""


def stable_intervals(
    experiment: Experiment, key: str, low: float, high: float, **options: Any
) -> list[tuple[float, float]]:
    """All intervals of one number within low ... high in which the loop is stable, the smallest first.

    The tip stays where it is: the wall is put so that the surface, pressed, reaches it. An island of stability narrower
    than a sixteenth of the range may be missed.

    Args:
        experiment: all other numbers.
        key: which number: "surface.stiffness", "controller.kf", ...
        low: of the range; above 0 the values tried lie evenly on a logarithmic scale.
        high: of the range. An interval that reaches either end may go on beyond.
        options: of `linearise`.

    Raises:
        InputError: a key that there is none of, a range that is none, a value out of its own range.
    """
    if not low < high:
        raise InputError(f"the range must have its lower end first, got {low:g} ... {high:g}")
    options.setdefault("x", float(linearise(experiment, **options).pose[0]))

    def growing(value: float) -> float:
        return float(np.log(linearise(changed(experiment, {key: value}), **options).growth))

    space = np.geomspace if low > 0.0 else np.linspace
    values = [float(v) for v in space(low, high, POINTS)]
    rates = [growing(v) for v in values]
    ends: list[float] = [low] if rates[0] < 0.0 else []
    for (a, before), (b, after) in pairwise(zip(values, rates, strict=True)):
        if (before < 0.0) != (after < 0.0):
            ends.append(_between(growing, a, b))
    if rates[-1] < 0.0:
        ends.append(high)
    return list(zip(ends[::2], ends[1::2], strict=True))


def stable_stiffness(
    experiment: Experiment, low: float = LOW, high: float = HIGH, **options: Any
) -> tuple[float, float]:
    """The stiffnesses K_e on which the force loop is stable, all else as in the experiment, B_e too [N/m].

    The interval that the experiment's own stiffness lies in; the first one, if that is in none.

    Args:
        experiment: any.
        low: of what is looked at [N/m].
        high: of it; an interval that reaches either end may go on beyond.
        options: of `linearise`.

    Raises:
        InputError: no stable stiffness in that range.
    """
    found = stable_intervals(experiment, "surface.stiffness", low, high, **options)
    if not found:
        raise InputError(f"the loop is stable on no stiffness from {low:g} to {high:g} N/m; lower a gain")
    own = float(experiment.surface.stiffness)
    return next(((a, b) for a, b in found if a <= own <= b), found[0])


def _between(growing: Any, a: float, b: float) -> float:
    """Where the growth changes its sign."""
    from scipy.optimize import brentq

    return float(brentq(growing, a, b, rtol=EXACT))
