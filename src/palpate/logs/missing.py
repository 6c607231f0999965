"""Values that stand for "no reading", such as the -1 that a scale's driver returns between two readings."""

from __future__ import annotations

import numpy as np

from palpate.arrays import Array, Mask

_USUAL = (-1.0, -9.0, -99.0, -999.0, -9999.0, -32768.0, 999.0, 9999.0, 65535.0, 99999.0, -3.697314e28)
"""The last is what NDI's trackers write for a marker that they do not see."""
_LEAST_SHARE = 0.002
"""Of the rows: a reading that is right by accident is rarer, one in the number of steps of its converter."""
_APART = 0.5
"""Least distance of such a value from the readings beside it, in the column's unit: half of the step between whole
numbers, which these values are."""


def find_sentinel(values: Array) -> float | None:
    """The value in a column, shape (n,), that plainly means "no reading"; None where there is none.

    It must be one of those that drivers use, occur again and again, lie on one side of all other
    values, and be left and returned to in jumps: a force of -1 on its way from 0 to -2 is a force.
    """
    for value in _USUAL:
        here = values == value
        share = float(np.mean(here))
        if not max(_LEAST_SHARE, 2 / len(values)) <= share < 1 - 2 / len(values):
            continue
        others = values[~here & np.isfinite(values)]
        if len(others) > 1 and _outside(value, others) and _jumps(values, here, value):
            return value
    return None


def _outside(value: float, others: Array) -> bool:
    """Whether the value lies where no reading does; a small negative one needs readings that are never negative."""
    low, high = float(others.min()), float(others.max())
    if value < 0:
        return low >= 0 if value > -10 else value < low - (high - low)
    return value > high + (high - low)


def _jumps(values: Array, here: Mask, value: float) -> bool:
    """Whether the typical reading beside this value is far from it, measured by how far readings step otherwise."""
    beside = values[1:][here[:-1] & ~here[1:]]
    if not len(beside):
        return False
    steps = np.abs(np.diff(values[~here]))
    return float(np.median(np.abs(beside - value))) > _APART + 3 * float(np.median(steps))
