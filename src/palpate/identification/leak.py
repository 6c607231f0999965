"""A force sensor that leaks: a charge amplifier, or a coupling that blocks a constant force.

Such a sensor reads r with r' = f' - r / T, so the force is f = r + (1 / T) times the integral of r. In free motion f
is zero: what is read there follows from the contacts before, and shows the rate 1 / T without any model of a surface.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from palpate.arrays import Array
from palpate.identification.causes import Code, Warn
from palpate.identification.free_motion import find_free_motion
from palpate.identification.least_squares import estimate_noise
from palpate.identification.sampling import Channels
from palpate.signals.samples import block_means, outer_range, runs

_MAX_ROWS = 1 << 13
"""Maximum rows of a fit; more are averaged."""
_FRACTIONS = (0.5, 0.35, 0.25, 0.12, 0.06)
"""Fractions of the position's range, from either end, in which free motion may lie."""
_MIN_STAY_ROWS = 8
_MIN_STDS = 5.0
"""Standard errors of the rate from which on the sensor leaks: wrong once in a million."""


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
class _Fit:
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
        low, high = outer_range(direction * position)
        for fraction in _FRACTIONS:
            limit = low + fraction * (high - low)
            inside = direction * position < limit
            stays = [slice(first, last) for first, last in runs(inside) if last - first >= _MIN_STAY_ROWS]
            fit = _fit(force, time, integral, stays)
            if fit is not None:
                without = force - fit.theta[1] * time - fit.theta[2] * integral
                if _is_free(without, position, direction, limit):
                    fits.append(fit)
    if not fits:
        return channels, None
    fit = max(fits, key=lambda fit: fit.theta[2] ** 2 / fit.cov[2, 2])
    return _without(channels, fit, channels.start + time, integral)


def _fit(force: Array, time: Array, integral: Array, stays: list[slice]) -> _Fit | None:
    """Fit some stays; None unless the leak is certain, and explains the force better than a drift that bends."""
    if not stays or stays[-1].stop - stays[0].start <= sum(rows.stop - rows.start for rows in stays):
        return None  # no contact lies between them
    rows = np.concatenate([np.arange(stay.start, stay.stop) for stay in stays])
    line = np.column_stack([np.ones(len(rows)), time[rows]])
    leak = np.column_stack([line, integral[rows]])
    u = time[rows] / time[-1]
    bend = np.column_stack([line, u**2, u**3])
    (theta, residual), (_, other) = (_solve(columns, force[rows]) for columns in (leak, bend))
    noise = estimate_noise(residual, rows, 3)
    effective = min(noise.effective, len(rows))
    cov = noise.variance * len(rows) / effective * np.linalg.pinv(leak.T @ leak)
    gain = effective * np.log(float(other @ other) / max(float(residual @ residual), 1e-300)) + np.log(
        effective
    )
    fit = _Fit(theta, np.asarray(cov, np.float64), float(gain))
    certain = theta[2] < -_MIN_STDS * np.sqrt(cov[2, 2])
    return fit if certain and gain > 0 else None


def _solve(columns: Array, force: Array) -> tuple[Array, Array]:
    """Least squares: parameters, and residuals of shape (n,)."""
    scale = np.abs(columns).max(axis=0)
    theta = np.linalg.lstsq(columns / scale, force, rcond=None)[0] / scale
    return theta, force - columns @ theta


def _is_free(force: Array, position: Array, direction: float, limit: float) -> bool:
    """True if the force without the leak shows free motion up to a position at least, at one level within its noise."""
    free_motion = find_free_motion(force, position, outer_range(force))
    if free_motion is None or free_motion.way != direction or direction * free_motion.limit < limit:
        return False
    return float(np.ptp(free_motion.levels)) <= free_motion.noise


def _without(channels: Channels, fit: _Fit, time: Array, integral: Array) -> tuple[Channels, Leak]:
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
