"""Strokes of a position, as testing machines and arms make presses: advances and retreats at about constant speed.

A position that is a straight line in time has no power in any octave: what such a press shows is read from its strokes.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from palpate.arrays import Array
from palpate.identification.filters import noise_within
from palpate.identification.sampling import Channels
from palpate.signals.samples import block_means, runs, white_noise

BLOCKS = 1 << 13
"""Of the whole log at most, in which strokes are looked for."""
STROKE = 0.2
"""Share of the position's range that a stroke goes through at least; it is a press if its force does so, too.
`benchmarks/identification/press_constants.py` shows which values do as well, of this and of the constants below."""
_ENDS = 0.02
"""Share of a stroke at both ends in which the probe speeds up and slows down."""
_PARTS, _FINE = 5, 25
"""Parts of a stroke by time, in which its speed is about the same, and those in which it never rests."""
_SLOWEST = 0.4
"""Speed of the slowest part over that of the fastest: a machine whose own compliance is half of the press has 0.5."""
_BULGE = 1.5
"""Speed of the middle over the mean of both ends: an advance that speeds up for a quarter of its time and slows down
for another has 1.5, half a sine 1.9."""
_STILL = 0.1
"""Share of a stroke's mean speed below which a part of it rests."""
_SHARE = 0.8
"""Share of the probe's way, in or out, that goes in strokes, of a press: else something shakes it as well. A return may
be at any speed."""
_SEEN = 8.0
"""Deviations of the noise that a way must exceed to be one."""


@dataclass(frozen=True)
class Stroke:
    """An advance or a retreat at about constant speed, from its begin to its end on the log's clock [s]."""

    begin: float
    end: float

    def rows(self, channels: Channels) -> slice:
        """Its samples in the channels, thinned or not."""
        first, last = ((t - channels.start) / channels.dt for t in (self.begin, self.end))
        return slice(max(int(np.ceil(first)), 0), min(int(last) + 1, len(channels.position)))


def strokes_of(channels: Channels) -> tuple[Stroke, ...]:
    """The strokes of an evenly sampled log that goes one way in strokes, comes back at any speed, and does little else.

    None of another log.
    """
    size = -(-len(channels.position) // BLOCKS)
    x = block_means(channels.position, size)
    noise = noise_within(x, np.arange(len(x)), np.zeros(len(x), np.intp))
    least, reach = max(_SEEN * white_noise(x), noise.count), float(np.ptp(x))
    if reach <= _FINE * least:
        return ()
    turns = turns_of(x, STROKE * reach)
    ends = [own for a, b in pairwise(turns) if (own := _steady(x, a, b, least)) is not None]
    # Ways [m] of the strokes, of the legs between large turns at any speed, and of all between turns above the noise.
    strokes = np.array([x[b] - x[a] for a, b in ends])
    legs, whole = np.diff(x[turns]), np.diff(x[turns_of(x, least)])
    for sign in (1, -1):
        ways = sign * whole, sign * strokes, -sign * legs
        there, advance, back = (np.maximum(way, 0).sum() for way in ways)
        if 0 < _SHARE * there <= advance and advance + back >= _SHARE * np.abs(whole).sum():
            break
    else:
        return ()
    dt, start = size * channels.dt, channels.start + (size - 1) / 2 * channels.dt
    return tuple(Stroke(start + a * dt, start + b * dt) for a, b in ends)


def turns_of(x: Array, least: float) -> list[int]:
    """Where a position turns by more than a way, its first and last row included."""
    turns, low, high, rising = [0], 0, 0, 0
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


def _steady(x: Array, a: int, b: int, least: float) -> tuple[int, int] | None:
    """First and last row between two turns in which the probe goes at about one speed; None if it does not.

    Where it rests on the way, those of the part without a rest that goes farthest.
    """
    whole = float(x[b] - x[a])
    if abs(whole) <= _FINE * least:
        return None
    share = (x[a : b + 1] - x[a]) / whole
    first, last = int(np.flatnonzero(share <= _ENDS)[-1]), int(np.argmax(share >= 1 - _ENDS))
    if last - first < _FINE:
        return None
    every = (np.linspace(first, last, parts + 1) for parts in (_PARTS, _FINE))
    speed, fine = (np.diff(np.interp(own, np.arange(len(share)), share)) for own in every)
    moves = fine >= _STILL / _FINE
    if not moves.all():
        edges = np.linspace(first, last, _FINE + 1).astype(np.intp)
        parts = [(int(edges[i]), int(edges[j])) for i, j in runs(moves)]
        i, j = max(parts, key=lambda part: share[part[1]] - share[part[0]], default=(first, first))
        return _steady(x, a + i, a + j, least)
    even = speed.min() >= _SLOWEST * speed.max() and speed[_PARTS // 2] <= _BULGE * (speed[0] + speed[-1]) / 2
    return (a + first, a + last) if even else None
