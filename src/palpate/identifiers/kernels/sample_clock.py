"""The instants at which a force sensor slower than the loop puts out its samples, from the rows that change.

A change seen in a row says that a sample came out since the row before it; the rows seen so far leave the phase of an
even grid in a small interval, whose middle is taken.
"""

from math import floor, inf

from palpate._jit import law

LOW, HIGH, LAST = 0, 1, 2
"""Where the phase's interval and the number of the last sample stand in a clock."""
FIELDS = 3
UNSET = (-inf, inf, -1.0)
"""A clock that no sample was seen of."""
_ROOM = 1e-9
"""Of a period, for the rounding of an instant that falls on a row."""


@law
def sampled_at(clock, row, changed, certain, period):
    """The instant of the sample that this row shows for the first time, in rows; infinite if it shows none.

    Args:
        clock: changed in place.
        row: number of the row.
        changed: whether its reading is another than the one before.
        certain: whether the row before had a reading, so that a change happened between the two.
        period: rows between two samples, at least 1.
    """
    if changed and certain:
        _narrow(clock, row, period)
    elif not clock[HIGH] < inf:
        return inf
    else:
        number = clock[LAST] + 1.0 if certain else floor((row - clock[HIGH]) / period + _ROOM)
        if number <= clock[LAST] or clock[HIGH] + number * period > row:
            return inf
        clock[LAST] = number
    return 0.5 * (clock[LOW] + clock[HIGH]) + clock[LAST] * period


@law
def _narrow(clock, row, period):
    low, high = clock[LOW], clock[HIGH]
    if not high < inf:
        clock[LOW], clock[HIGH], clock[LAST] = row - 1.0, row, 0.0
        return
    number = floor((row - 1.0 - high) / period + _ROOM) + 1.0  # the first that may have come out since
    if low + number * period > row:  # the clock drifts: the nearest
        number = floor((row - 0.5 - 0.5 * (low + high)) / period + 0.5)
    clock[LAST] = max(number, clock[LAST])
    start = clock[LAST] * period
    low, high = max(low, row - 1.0 - start), min(high, row - start)
    if low >= high - _ROOM:  # it comes after `low`, and no later than `high`
        low, high = row - 1.0 - start, row - start
    clock[LOW], clock[HIGH] = low, high
