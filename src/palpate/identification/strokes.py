"""Strokes of a position, as testing machines and arms make presses: advances and retreats at about constant speed.

A position that is a straight line in time has no power in any octave: what such a press shows is read from its strokes.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from palpate.arrays import Array
from palpate.identification.sampling import Channels
from palpate.signals.position_noise import noise_in_contacts
from palpate.signals.samples import block_means, runs, white_noise

MAX_BLOCKS = 1 << 13
"""Of the whole log at most, in which strokes are looked for."""
MIN_STROKE_REACH = 0.2
"""Share of the position's range that a stroke goes through at least; it is a press if its force does so, too.
`benchmarks/identification/press_constants.py` shows which values do as well, of this and of the constants below."""
_END_FRACTION = 0.02
"""Share of a stroke at both ends in which the probe speeds up and slows down."""
_SPEED_PARTS, _REST_PARTS = 5, 25
"""Parts of a stroke by time, in which its speed is about the same, and those in which it never rests."""
_MIN_SPEED_RATIO = 0.4
"""Speed of the slowest part over that of the fastest: a machine whose own compliance is half of the press has 0.5."""
_MAX_MIDDLE_SPEED_RATIO = 1.5
"""Speed of the middle over the mean of both ends: an advance that speeds up for a quarter of its time and slows down
for another has 1.5, half a sine 1.9."""
_REST_SPEED_RATIO = 0.1
"""Share of a stroke's mean speed below which a part of it rests."""
_MIN_STROKE_FRACTION = 0.8
"""Share of the probe's way, in or out, that goes in strokes, of a press: else something shakes it as well. A return may
be at any speed."""
_MIN_TRAVEL_STDS = 8.0
"""Deviations of the noise that a way must exceed to be one."""


@dataclass(frozen=True)
class Stroke:
    """An advance or a retreat at about constant speed, from its begin to its end on the log's clock [s]."""

    begin: float
    end: float

    def rows(self, channels: Channels) -> slice:
        """Rows of the stroke in the channels, thinned or not."""
        first, last = ((t - channels.start) / channels.dt for t in (self.begin, self.end))
        return slice(max(int(np.ceil(first)), 0), min(int(last) + 1, len(channels.position)))


def find_strokes(channels: Channels) -> tuple[Stroke, ...]:
    """The strokes of an evenly sampled log that goes one way in strokes, comes back at any speed, and does little else.

    None of another log.
    """
    size = -(-len(channels.position) // MAX_BLOCKS)
    x = block_means(channels.position, size)
    noise = noise_in_contacts(x, np.arange(len(x)), np.zeros(len(x), np.intp))
    min_travel = max(_MIN_TRAVEL_STDS * white_noise(x), noise.count)
    reach = float(np.ptp(x))
    if reach <= _REST_PARTS * min_travel:
        return ()
    turns = find_turns(x, MIN_STROKE_REACH * reach)
    ends = [
        stroke_rows
        for first, last in pairwise(turns)
        if (stroke_rows := _steady_rows(x, first, last, min_travel)) is not None
    ]
    # Ways [m] of the strokes, of the legs between large turns at any speed, and of all between turns above the noise.
    strokes = np.array([x[last] - x[first] for first, last in ends])
    leg_ways = np.diff(x[turns])
    all_ways = np.diff(x[find_turns(x, min_travel)])
    for sign in (1, -1):
        ways = sign * all_ways, sign * strokes, -sign * leg_ways
        total_in, advance, total_back = (np.maximum(signed_ways, 0).sum() for signed_ways in ways)
        if (
            0 < _MIN_STROKE_FRACTION * total_in <= advance
            and advance + total_back >= _MIN_STROKE_FRACTION * np.abs(all_ways).sum()
        ):
            break
    else:
        return ()
    dt = size * channels.dt
    start = channels.start + (size - 1) / 2 * channels.dt
    return tuple(Stroke(start + first * dt, start + last * dt) for first, last in ends)


def find_turns(x: Array, least: float) -> list[int]:
    """Rows at which a position turns by more than a distance, the first and last row included."""
    turns = [0]
    low = 0
    high = 0
    rising = 0
    for i, value in enumerate(x.tolist()):
        if value > x[high]:
            high = i
        if value < x[low]:
            low = i
        if rising >= 0 and x[high] - value > least:
            turns.append(high)
            rising, low = -1, i
        elif rising <= 0 and value - x[low] > least:
            turns.append(low)
            rising, high = 1, i
    last = high if rising > 0 else low if rising < 0 else len(x) - 1
    return sorted({*turns, last, len(x) - 1})


def _steady_rows(x: Array, first_row: int, last_row: int, least: float) -> tuple[int, int] | None:
    """First and last row between two turns in which the probe goes at about one speed; None if it does not.

    Where it rests on the way, those of the part without a rest that goes farthest.
    """
    travel = float(x[last_row] - x[first_row])
    if abs(travel) <= _REST_PARTS * least:
        return None
    fraction = (x[first_row : last_row + 1] - x[first_row]) / travel
    first = int(np.flatnonzero(fraction <= _END_FRACTION)[-1])
    last = int(np.argmax(fraction >= 1 - _END_FRACTION))
    if last - first < _REST_PARTS:
        return None
    grids = (np.linspace(first, last, parts + 1) for parts in (_SPEED_PARTS, _REST_PARTS))
    speed, fine = (
        np.diff(np.interp(edges_of_parts, np.arange(len(fraction)), fraction)) for edges_of_parts in grids
    )
    moves = fine >= _REST_SPEED_RATIO / _REST_PARTS
    if not moves.all():
        edges = np.linspace(first, last, _REST_PARTS + 1).astype(np.intp)
        parts = [(int(edges[i]), int(edges[j])) for i, j in runs(moves)]
        i, j = max(parts, key=lambda part: fraction[part[1]] - fraction[part[0]], default=(first, first))
        return _steady_rows(x, first_row + i, first_row + j, least)
    even = (
        speed.min() >= _MIN_SPEED_RATIO * speed.max()
        and speed[_SPEED_PARTS // 2] <= _MAX_MIDDLE_SPEED_RATIO * (speed[0] + speed[-1]) / 2
    )
    return (first_row + first, first_row + last) if even else None
