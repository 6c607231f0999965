"""Phases of a log that no model of a surface describes: a break, and a flow."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from palpate.arrays import Array, Mask
from palpate.identification.causes import Code, Warn
from palpate.identification.sampling import Channels
from palpate.signals.samples import block_means, outer_range, robust_std

_BLOCKS = 1000
"""Blocks of a log: a break is looked for on the scale of a thousandth of it."""
_SIDE, _GAP = 4, 3
"""Blocks that are averaged on either side of a break, and those between that its own duration may fill."""
_MIN_STDS = 7.0
"""Standard deviations of the steps of the whole log from which on a step is none of its noise."""
_DEEP_FRACTION, _SLOW_FRACTION = 0.5, 0.1
"""Fraction of the position's range beyond which a probe is deep, and of the highest speed there below which it rests."""
_MIN_ROWS = 20


class Break(NamedTuple):
    """A sudden loss of force while the probe moves on.

    Args:
        time: on the log's clock [s].
        before, after: force counted from its level at the begin of the log [N].
    """

    time: float
    before: float
    after: float

    @property
    def text(self) -> str:
        """The break as a sentence."""
        fall = f"the force falls at once from {self.before:.3g} to {self.after:.3g} N while the probe moves on"
        return f"at {self.time:.4g} s {fall}: the specimen breaks, or slips; what follows is left out"


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
    breaks = (speed_before > 0) & (speed_after > 0) & (unexplained > 0) & (lost > tolerance * before)
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


def flows(channels: Channels) -> Warn | None:
    """A warning if the force is there while the probe advances, and gone while it rests as deep; else None."""
    size = -(-len(channels.force) // _BLOCKS)
    force, position = block_means(channels.force, size), block_means(channels.position, size)
    speed = np.gradient(position)
    low, high = outer_range(position)
    for direction in (1.0, -1.0):
        depth = (position - (low if direction > 0 else high)) * direction / max(high - low, 1e-300)
        deep, free = depth > _DEEP_FRACTION, depth < _DEEP_FRACTION / 2
        fastest = float(np.percentile(np.abs(speed[deep]), 98)) if deep.any() else 0.0
        advances = deep & (direction * speed > _DEEP_FRACTION * fastest)
        rests = deep & (np.abs(speed) < _SLOW_FRACTION * fastest)
        if min(map(np.count_nonzero, (advances, rests, free))) >= _MIN_ROWS and _is_gone(
            force, speed, advances, rests, free
        ):
            return Warn(
                Code.FORCE_FLOWS,
                "the force follows the speed, and is gone where the probe rests deep in the contact: what is touched"
                " flows, and has no stiffness",
            )
    return None


def _is_gone(force: Array, speed: Array, advances: Mask, rests: Mask, free: Mask) -> bool:
    """True if the force of some blocks at rest is none beyond the noise and what their slow speed makes."""
    level = float(np.median(force[free]))
    noise = robust_std(force[free] - level)
    moving = abs(float(np.median(force[advances])) - level)
    resting = np.abs(force[rests] - level)
    slow = float(np.mean(np.abs(speed[rests]))) / float(np.mean(np.abs(speed[advances])))
    return moving > _MIN_STDS * noise and float(np.median(resting)) < 2 * slow * moving + noise
