"""Presses at constant speed, as testing machines and arms make them: the strokes of the position.

A position that is a straight line in time has no power in any octave, so what a press shows is read from position and
force themselves. A stroke is an advance or a retreat at about one speed. Where force and position are both smooth
curves of one variable, the tangent is the quotient of their derivatives: at constant speed a lag of the force moves it
along the curve, and does not change it.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from palpate.arrays import Array
from palpate.identification.filters.sensor_path import noise_within
from palpate.identification.filters.state_variable import block_means, white_noise
from palpate.identification.sampling import Channels
from palpate.signals.samples import runs

_BLOCKS = 1 << 13
"""Of the whole log at most, in which strokes are looked for."""
_STROKE = 0.2
"""Share of the position's range that a stroke goes through at least; it is a press if its force does so, too."""
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
"""Share of all the way of the probe that goes in strokes, of a press: else something shakes it as well."""
_SEEN = 8.0
"""Deviations of the noise that a way must exceed to be one."""


@dataclass(frozen=True)
class Stroke:
    """An advance or a retreat at about constant speed.

    Args:
        begin, end: on the log's clock [s].
        way: 1 if the position grows as it is logged, -1 if it falls.
    """

    begin: float
    end: float
    way: int

    def rows(self, channels: Channels) -> slice:
        """Its samples in the channels, thinned or not."""
        first, last = ((t - channels.start) / channels.dt for t in (self.begin, self.end))
        return slice(max(int(np.ceil(first)), 0), min(int(last) + 1, len(channels.position)))


def strokes_of(channels: Channels) -> tuple[Stroke, ...]:
    """The strokes of a log whose motion is little else; none of another log.

    Args:
        channels: evenly sampled.
    """
    size = -(-len(channels.position) // _BLOCKS)
    x = block_means(channels.position, size)
    noise = noise_within(x, np.arange(len(x)), np.zeros(len(x), np.intp))
    least, reach = max(_SEEN * white_noise(x), noise.count), float(np.ptp(x))
    if reach <= _FINE * least:
        return ()
    steady = [_steady(x, a, b, least) for a, b in pairwise(_turns(x, _STROKE * reach))]
    ends = [own for own in steady if own is not None]
    whole = float(np.abs(np.diff(x[_turns(x, least)])).sum())
    if sum(abs(float(x[b] - x[a])) for a, b in ends) < _SHARE * whole:
        return ()
    dt = size * channels.dt
    start = channels.start + (size - 1) / 2 * channels.dt
    return tuple(Stroke(start + a * dt, start + b * dt, 1 if x[b] > x[a] else -1) for a, b in ends)


def _turns(x: Array, least: float) -> list[int]:
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
    way = x[a : b + 1] - x[a]
    whole = float(way[-1])
    if abs(whole) <= _FINE * least:
        return None
    share = way / whole
    first = int(np.flatnonzero(share <= _ENDS)[-1])
    last = int(np.argmax(share >= 1 - _ENDS))
    if last - first < _FINE:
        return None
    speed = np.diff(np.interp(np.linspace(first, last, _PARTS + 1), np.arange(len(share)), share))
    fine = np.diff(np.interp(np.linspace(first, last, _FINE + 1), np.arange(len(share)), share))
    moves = fine >= _STILL / _FINE
    if not moves.all():
        edges = np.linspace(first, last, _FINE + 1).astype(np.intp)
        parts = [(int(edges[i]), int(edges[j])) for i, j in runs(moves)]
        i, j = max(parts, key=lambda part: share[part[1]] - share[part[0]], default=(first, first))
        return _steady(x, a + i, a + j, least)
    even = speed.min() >= _SLOWEST * speed.max() and speed[_PARTS // 2] <= _BULGE * (speed[0] + speed[-1]) / 2
    return (a + first, a + last) if even else None
