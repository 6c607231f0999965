"""The values of a number of the experiment for which the linear loop is stable."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import pairwise
from math import log
from typing import Any

import numpy as np

from palpate.bench.tables import Experiment, with_values
from palpate.errors import InputError
from palpate.studies.analysis.linear_model import linearise

STEPS = 32
"""Steps of a range between two of which one change of stability is found: a seventh of a decade of stiffness."""
TOLERANCE = 1e-5
"""Accuracy of a boundary, as a fraction of the range."""
LOW, HIGH = 100.0, 3e6
"""Default range of the stiffness [N/m]."""

Rate = Callable[[float], float]


def sign_changes(rate: Rate, low: float, high: float, steps: int = STEPS, *, log: bool) -> Iterator[float]:
    """The places within low ... high where a function changes its sign, the smallest first.

    Two changes within one step are not found, nor one beside a place where the function is NaN.

    Args:
        rate: the function.
        low: of the range.
        high: of the range.
        steps: of the range.
        log: True if the steps are equal factors.
    """
    from scipy.optimize import brentq

    def place(fraction: float) -> float:
        return low * (high / low) ** fraction if log else low + (high - low) * fraction

    fractions = np.linspace(0.0, 1.0, steps + 1).tolist()
    rates = [rate(place(fraction)) for fraction in fractions]
    for (a, before), (b, after) in pairwise(zip(fractions, rates, strict=True)):
        if before * after < 0.0:
            try:
                yield place(float(brentq(lambda fraction: rate(place(fraction)), a, b, xtol=TOLERANCE)))
            except ValueError:  # the function is NaN between them
                continue


def stable_intervals(
    of: Experiment, key: str, low: float, high: float, **options: Any
) -> list[tuple[float, float]]:
    """All intervals of one number within low ... high in which the loop is stable, the smallest first.

    An interval or a gap narrower than a thirty-second of the range may be missed. The tip stays where it is: the wall
    is put so that the surface, pressed, reaches it.

    Args:
        of: the experiment with all other numbers.
        key: the number: "surface.stiffness", "controller.kf", ...
        low: of the range; above 0 the steps are equal factors.
        high: of the range. An interval that reaches either end may go on beyond.
        options: of `linearise`.

    Raises:
        InputError: an unknown key, an empty range, a value out of its own range.
    """
    if not low < high:
        raise InputError(f"the range must have its lower end first, got {low:g} ... {high:g}")
    options.setdefault("x", float(linearise(of, **options).pose[0]))

    def rate(value: float) -> float:
        return log(linearise(with_values(of, {key: value}), **options).growth)

    changes = list(sign_changes(rate, low, high, log=low > 0.0))
    stable = rate(low) < 0.0
    intervals = []
    for begin, end in pairwise([low, *changes, high]):
        if stable:
            intervals.append((begin, end))
        stable = not stable
    return intervals


def stable_stiffness(
    of: Experiment, low: float = LOW, high: float = HIGH, **options: Any
) -> tuple[float, float]:
    """The stiffnesses K_e on which the force loop is stable, all else as it is, B_e too [N/m].

    The interval around the surface's own stiffness; the first one, if that is in none.

    Args:
        of: any experiment.
        low: end of the range [N/m].
        high: of it; an interval that reaches either end may go on beyond.
        options: of `linearise`.

    Raises:
        InputError: no stable stiffness in that range.
    """
    intervals = stable_intervals(of, "surface.stiffness", low, high, **options)
    if not intervals:
        raise InputError(f"the loop is stable on no stiffness from {low:g} to {high:g} N/m; lower a gain")
    stiffness = float(of.surface.stiffness)
    return next(((a, b) for a, b in intervals if a <= stiffness <= b), intervals[0])
