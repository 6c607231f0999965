"""Phases of a log that no model of a surface describes: a break, and a flow."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from palpate.arrays import Array
from palpate.identification.sampling import Channels
from palpate.signals.samples import block_means, outer_range, robust_std

_BLOCKS = 1000
"""Blocks of a log: a break is looked for on the scale of a thousandth of it."""
_SIDE, _GAP = 4, 3
"""Blocks that are averaged on either side of a break, and those between that its own duration may fill."""
_MIN_STDS = 7.0
"""Standard deviations of the steps of the whole log from which on a step is none of its noise."""
_DEEP_FRACTION, _SLOW_FRACTION = 0.5, 0.1
"""Fraction of the position's range beyond which a probe is deep; of the highest speed there below which it rests."""
_MIN_ROWS = 8
"""Blocks that a level of the force needs."""
_MIN_ROWS_BEFORE = 40
"""Rows before a break that are identified."""


class Break(NamedTuple):
    """A sudden loss of force while the probe moves on.

    Args:
        time: on the log's clock [s].
        before, after: force before and after, counted from its level at the begin of the log [N].
    """

    time: float
    before: float
    after: float

    @property
    def text(self) -> str:
        """The break as a sentence."""
        fall = f"the force falls at once by {1 - self.after / self.before:.0%} while the probe moves on"
        return f"At {self.time:.4g} s {fall}: the specimen breaks or slips, and what follows is left out"


def find_break(channels: Channels, tolerance: float) -> Break | None:
    """The first break of a log that takes more than a fraction (the tolerance) of the force; None without one.

    While a probe advances, the force of a surface rises, but for a viscous part that falls with the speed: all of the
    force may be viscous, so a loss in proportion to that of the speed is no break.
    """
    size = -(-len(channels.force) // _BLOCKS)
    force, position = block_means(channels.force, size), block_means(channels.position, size)
    if len(force) < 4 * (_SIDE + _GAP):
        return None
    force = force - float(np.median(force[:_SIDE]))
    force = force * np.sign(force[np.argmax(np.abs(force))])  # positive where the specimen is loaded
    position = position * np.sign(np.cov(force, position)[0, 1])
    speed = np.gradient(position)
    (before, after), (speed_before, speed_after) = (_sides(values) for values in (force, speed))
    lost = before - after
    slowed = np.clip(1 - speed_after / np.maximum(speed_before, 1e-300), 0.0, 1.0)
    unexplained = lost - np.maximum(slowed * before, _MIN_STDS * robust_std(lost))
    place_before, place_after = _sides(position)
    advances = (speed_before > 0) & (speed_after > 0) & (place_after > place_before)
    loaded = np.roll(before, _SIDE + _GAP) > before / 2  # a tap is over at once as well
    breaks = advances & loaded & (unexplained > 0) & (lost > tolerance * before)
    breaks[: _MIN_ROWS_BEFORE // size + 1] = False
    if not breaks.any():
        return None
    first = int(np.argmax(breaks))
    place = first + int(np.argmax(unexplained[first : first + _SIDE]))
    time = channels.start + (place + _SIDE) * size * channels.dt
    return Break(time, float(before[place]), float(after[place]))


def _sides(values: Array) -> tuple[Array, Array]:
    """Means of the blocks before and after each place, shape (n - 2 side - gap + 1,)."""
    means = np.lib.stride_tricks.sliding_window_view(values, _SIDE).mean(axis=1)
    distance = _SIDE + _GAP
    return means[:-distance], means[distance:]


def flows(channels: Channels) -> bool:
    """True if the force is there while the probe advances, and gone wherever it rests as deep."""
    size = -(-len(channels.force) // _BLOCKS)
    force, position = block_means(channels.force, size), block_means(channels.position, size)
    return any(_is_gone_at_rest(force, direction * position) for direction in (1.0, -1.0))


def _is_gone_at_rest(force: Array, position: Array) -> bool:
    """True if a surface at higher positions has no force at rest beyond the noise and what a slow speed makes."""
    low, high = outer_range(position)
    depth, speed = (position - low) / max(high - low, 1e-300), np.gradient(position)
    deep, free = depth > _DEEP_FRACTION, depth < _DEEP_FRACTION / 2
    fastest = float(np.percentile(np.abs(speed[deep]), 98)) if deep.any() else 0.0
    advances = deep & (speed > _DEEP_FRACTION * fastest)
    rests = deep & (np.abs(speed) < _SLOW_FRACTION * fastest)
    if min(map(np.count_nonzero, (advances, rests, free))) < _MIN_ROWS:
        return False
    level = float(np.median(force[free]))
    noise = robust_std(force[free] - level)
    moving = abs(float(np.median(force[advances])) - level)
    resting = float(np.percentile(np.abs(force[rests] - level), 90))
    return moving > _MIN_STDS * noise and resting < 2 * _SLOW_FRACTION * moving + 3 * noise
