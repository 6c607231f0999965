"""Changes of a force with time that no model of a surface describes: a leak of the sensor, a break, a flow.

A charge amplifier, or a coupling that blocks a constant force, reads r with r' = f' - r / T, so the force is f = r +
(1 / T) times the integral of r. In free motion f is zero: what is read there follows from the contacts before, and
shows the rate 1 / T without any model of a surface.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from palpate.arrays import Array, Indices
from palpate.identification.causes import Code, Warn
from palpate.identification.free_motion import MIN_STAY_ROWS, RANGE_FRACTIONS, find_free_motion, stays_at_end
from palpate.identification.least_squares import estimate_noise
from palpate.identification.sampling import Channels
from palpate.signals.samples import block_means, outer_range, robust_std, white_noise

_BLOCKS = 1000
"""Blocks of a log: a break is looked for on the scale of a thousandth of it."""
_SIDE, _GAP = 4, 3
"""Blocks that are averaged on either side of a break, and those between that its own duration may fill:
`benchmarks/second_judge/judge.py --worlds fracture tap fluid_film` counts the breaks missed and invented."""
_MIN_STDS = 5.0
"""Standard errors that no noise reaches: once in 1.7 million, and so in one of 1700 logs of a thousand blocks."""
_DEEP_FRACTION, _SLOW_FRACTION = 0.5, 0.1
"""Fraction of the position's range beyond which a probe is deep; of the highest speed there below which it rests."""


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
    loading = slice(0, max(int(np.argmax(force)), 1) + 1)  # afterwards a broken specimen has no force
    position = position * np.sign(np.cov(force[loading], position[loading])[0, 1])
    speed = np.gradient(position)
    (before, after), (speed_before, speed_after) = (_sides(values) for values in (force, speed))
    lost = before - after
    slowed = np.clip(1 - speed_after / np.maximum(speed_before, 1e-300), 0.0, 1.0)
    unexplained = lost - np.maximum(slowed * before, _MIN_STDS * robust_std(lost))
    place_before, place_after = _sides(position)
    steps = np.lib.stride_tricks.sliding_window_view(np.diff(position), 2 * _SIDE + _GAP - 1)
    returns = steps.min(axis=1) < -_MIN_STDS * white_noise(position)  # a tap is over at once as well
    advances = (speed_before > 0) & (speed_after > 0) & (place_after > place_before) & ~returns
    loaded = (before > tolerance * force.max()) & (
        lost < (1 + tolerance) * before
    )  # a bounce goes below none
    breaks = advances & loaded & (unexplained > 0) & (lost > tolerance * before)
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
    if rests.any():  # a surface may lie deeper than the probe rests: on the way there is no force either
        limit = float(np.median(depth[rests]))
        advances &= depth <= limit
        rests &= depth >= limit
    if min(map(np.count_nonzero, (advances, rests, free))) < MIN_STAY_ROWS:
        return False
    level = float(np.median(force[free]))
    noise = robust_std(force[free] - level)
    moving = abs(float(np.median(force[advances])) - level)
    resting = float(np.percentile(np.abs(force[rests] - level), 90))
    return moving > _MIN_STDS * noise and resting < 2 * _SLOW_FRACTION * moving + 3 * noise


_MAX_ROWS = 1 << 13
"""Maximum rows of a fit; more are averaged."""
_DECAY_STDS = 3.0
"""Standard errors of a decay within the stays from which on it is seen, and to which it agrees with the leak: wrong
once in 370, of a log whose leak is certain by `_MIN_STDS`."""


@dataclass(frozen=True)
class Leak:
    """A leak of the force sensor, removed from the force.

    Args:
        times, effect: the largest error of the removed force that the fit leaves, one standard deviation [N] at times
            [s], both of shape (n,).
    """

    times: Array
    effect: Array

    def column(self, times: Array) -> Array:
        """Error of the force at some times [N], shape (m,), one standard deviation."""
        return np.asarray(np.interp(times, self.times, self.effect))


@dataclass(frozen=True)
class _LeakFit:
    """The force in free motion as an offset, a straight drift and a leak.

    Args:
        theta, cov: offset [N], drift [N/s] and minus the rate [1/s], and their covariance.
        gain: difference of the Bayesian information criterion to a drift that bends as it likes.
    """

    theta: Array
    cov: Array
    gain: float


def remove_leak(channels: Channels) -> tuple[Channels, Leak | None]:
    """The channels less a leak of the force sensor that free motion shows, with a warning; as they are without one."""
    size = -(-len(channels.force) // _MAX_ROWS)
    force, position = block_means(channels.force, size), block_means(channels.position, size)
    time: Array = size * channels.dt * np.arange(len(force), dtype=np.float64)
    integral: Array = np.cumsum(force - force.mean()) * size * channels.dt
    fits = []
    for direction in (1.0, -1.0):
        for fraction in RANGE_FRACTIONS:
            limit, stays = stays_at_end(direction * position, fraction)
            fit = _fit(force, time, integral, [slice(*stay) for stay in stays])
            if fit is not None:
                without = force - fit.theta[1] * time - fit.theta[2] * integral
                if _is_free(without, position, direction, limit):
                    fits.append(fit)
    if not fits:
        return channels, None
    fit = max(fits, key=lambda fit: fit.theta[2] ** 2 / fit.cov[2, 2])
    return _without(channels, fit, channels.start + time, integral)


def _fit(force: Array, time: Array, integral: Array, stays: list[slice]) -> _LeakFit | None:
    """Fit some stays; None unless the leak is certain, and explains the force better than a drift that bends."""
    if not stays or stays[-1].stop - stays[0].start <= sum(rows.stop - rows.start for rows in stays):
        return None  # no contact lies between them
    rows = np.concatenate([np.arange(stay.start, stay.stop) for stay in stays])
    line = np.column_stack([np.ones(len(rows)), time[rows]])
    leak = np.column_stack([line, integral[rows]])
    u = time[rows] / time[-1]
    bend = np.column_stack([line, u**2, u**3])
    (theta, residual), (_, other) = (_solve(columns, force[rows]) for columns in (leak, bend))
    cov, effective = _covariance(leak, residual, rows)
    gain = effective * np.log(
        max(float(other @ other), 1e-300) / max(float(residual @ residual), 1e-300)
    ) + np.log(effective)
    fit = _LeakFit(theta, cov, float(gain))
    certain = theta[2] < -_MIN_STDS * np.sqrt(cov[2, 2])
    return fit if certain and gain > 0 and _decays(force[rows], leak, stays, fit) else None


def _decays(force: Array, leak: Array, stays: list[slice], fit: _LeakFit) -> bool:
    """True if the force within the stays decays at the rate of the leak, whatever lies between their levels.

    An adhesive or plastic surface shifts the level from one stay to the next as a leak does, but within a stay it does
    not change.
    """
    lengths = [stay.stop - stay.start for stay in stays]
    own_levels = np.repeat(np.eye(len(stays)), lengths, axis=0)
    columns = np.column_stack([leak[:, 1:], own_levels])
    theta, residual = _solve(columns, force)
    cov, _ = _covariance(columns, residual, np.arange(len(force)))
    rate, std = theta[1], float(np.sqrt(cov[1, 1]))
    return bool(rate < -_DECAY_STDS * std and abs(rate - fit.theta[2]) < _DECAY_STDS * std)


def _solve(columns: Array, force: Array) -> tuple[Array, Array]:
    """Least squares: parameters, and residuals of shape (n,)."""
    scale = np.abs(columns).max(axis=0)
    theta = np.linalg.lstsq(columns / scale, force, rcond=None)[0] / scale
    return theta, force - columns @ theta


def _covariance(columns: Array, residual: Array, rows: Indices) -> tuple[Array, float]:
    """Covariance of parameters by least squares, and the independent rows that its residuals are worth."""
    noise = estimate_noise(residual, rows, columns.shape[1])
    effective = min(noise.effective, len(rows))
    cov = noise.variance * len(rows) / effective * np.linalg.pinv(columns.T @ columns)
    return np.asarray(cov, np.float64), float(effective)


def _is_free(force: Array, position: Array, direction: float, limit: float) -> bool:
    """True if the force without the leak shows free motion up to a position at least, at one level within its noise."""
    free_motion = find_free_motion(force, position, outer_range(force))
    if free_motion is None or free_motion.way != direction or direction * free_motion.limit < limit:
        return False
    return float(np.ptp(free_motion.levels)) <= free_motion.noise


def _without(channels: Channels, fit: _LeakFit, time: Array, integral: Array) -> tuple[Channels, Leak]:
    removed = fit.theta[1] * (time - channels.start) + fit.theta[2] * integral
    raw = channels.raw
    raw_time = raw.start + raw.dt * np.arange(len(raw.held_force), dtype=np.float64)
    text = (
        f"in free motion the force comes back from a contact as of a sensor that leaks with {-1 / fit.theta[2]:.3g} s"
        " (a charge amplifier); the leak is removed"
    )
    without = replace(
        channels,
        force=channels.force - np.interp(channels.time, time, removed),
        raw=replace(raw, held_force=raw.held_force - np.interp(raw_time, time, removed)),
        warnings=(*channels.warnings, Warn(Code.FORCE_DRIFTS, text)),
    )
    columns = np.stack([time - channels.start, integral])
    value, vector = np.linalg.eigh(fit.cov[1:, 1:])
    effect = np.sqrt(max(value[-1], 0.0)) * vector[:, -1] @ columns
    return without, Leak(time, effect)
