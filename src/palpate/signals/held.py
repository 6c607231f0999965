"""Finding channels that are refreshed more slowly than the rows are written."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from palpate.arrays import Array, Mask

_LONG_JUMP = 4.0
"""Times the sensor's own resolution from which a step is a jump."""
_HELD_SHARE = 0.3
"""Pairs of jumps between which a reading may move all the same."""


def fresh_rows(values: Array) -> Mask | None:
    """Rows in which a channel, shape (n,), was refreshed; None if every row is.

    A value that repeats is no proof: a coarse or resting sensor repeats too. Held samples show in jumps that are many
    times the sensor's own resolution with exact repetitions right between them.
    """
    step = np.diff(values)
    moved = step != 0
    if moved.all() or moved.sum() < 10:
        return None
    sizes = np.abs(step[moved])
    resolution = float(np.percentile(sizes, 2))
    jumps = np.flatnonzero(np.abs(step) > max(_LONG_JUMP * resolution, float(np.median(sizes)) * 0.5))
    if len(jumps) < 10:
        return None
    apart = np.diff(jumps)
    usual = float(np.median(apart))
    if usual < 2 or not _quiet_between(moved, jumps, usual):
        return None
    fresh = np.r_[True, moved]
    return _refill(fresh, round(usual))


def _quiet_between(moved: Mask, jumps: NDArray[np.intp], usual: float) -> bool:
    """Whether nothing at all moves between neighbouring jumps."""
    total = np.r_[0, np.cumsum(moved)]
    near = np.flatnonzero(np.diff(jumps) <= 2 * usual)
    if len(near) < 8:
        return False
    begin, end = jumps[near] + 1, jumps[near + 1]
    still = (total[end] - total[begin]) == 0
    return bool(still.mean() > 1 - _HELD_SHARE)


def _refill(fresh: Mask, every: int) -> Mask:
    """Count a long stretch without change as fresh once per period: the channel may simply rest."""
    fresh = fresh.copy()
    marks = np.flatnonzero(fresh)
    for begin, end in zip(marks, np.r_[marks[1:], len(fresh)], strict=True):
        if end - begin >= 2 * every:
            fresh[begin:end:every] = True
    return fresh
