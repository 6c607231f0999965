"""A ripple of the force in free motion: one sine over time (hum, vibration) or over position (interference, cogging).

It is fitted in free motion and subtracted from the whole log. The error of its fit, carried on to the contact, and a
change of a tenth are a part of every interval. A wave whose phase in contact is unknown is not subtracted: all of it is
a part of every interval.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from palpate.arrays import Array
from palpate.identification.causes import Code, Warn
from palpate.identification.free_motion import FreeMotion
from palpate.identification.least_squares import estimate_noise
from palpate.identification.sampling import Channels
from palpate.signals.samples import detrend, outer_range, runs

MIN_PERIODS, SURE_PERIODS = 1.5, 2.5
"""Periods of a ripple within one stay in free motion, and the number from which on a drift is no sine."""
MIN_BEND = 0.25
"""Periods over the position, in the smallest of `SHARES`, from which a bend of the force in free motion counts, as it
may go on in contact: half a wave in the whole."""
MIN_EXPLAINED = 0.5
"""Fraction of the force's variance in free motion that a ripple explains: noise of 30 rows and more leaves less."""
MIN_EXPLAINED_ALONE = 0.9
"""The same of fewer periods, and at an end of the position where no free motion shows."""
SHARES = (1.0, 0.75, 0.5)
"""Fractions of the free motion that a ripple is looked for in: the touch may lie in the last part."""
MAX_CHANGE = 0.1
"""Standard deviation of a ripple's change from free motion to contact, as a fraction of its amplitude."""
_MIN_ROWS = 30
"""Minimum rows of a stay."""
_MAX_ROWS = 20_000
"""Maximum rows of a fit."""
_BINS = 1 << 15
"""Maximum points of a spectrum."""
_MAX_STEPS = 200
"""Maximum waves on either side of the strongest of one stay that are tried in all stays."""


@dataclass(frozen=True)
class Ripple:
    """A sine in the force.

    Args:
        over_position: the sine is over position, not over time.
        wave: angular frequency or wave number [rad/s], [rad/m].
        parts: subtracted amplitudes of cosine and sine [N], shape (2,).
        std: standard deviation of each of them in contact [N].
        size: amplitude in free motion [N].
    """

    over_position: bool
    wave: float
    parts: Array
    std: float
    size: float

    @property
    def text(self) -> str:
        """The ripple and its subtraction, as a sentence."""
        period = 2 * np.pi / self.wave
        where = f"with a period of {1e3 * period:.3g} mm" if self.over_position else f"at {1 / period:.3g} Hz"
        done = (
            "the ripple is subtracted"
            if self.parts.any()
            else "it may go on in contact, so the intervals hold it"
        )
        return f"in free motion the force ripples by {self.size:.3g} N {where}; {done}"

    def columns(self, time: Array, position: Array) -> Array:
        """Cosine and sine at some times [s] and positions [m], shape (2, n)."""
        phase = self.wave * (position if self.over_position else time)
        return np.stack([np.cos(phase), np.sin(phase)])

    def subtract(self, channels: Channels) -> Channels:
        """The channels less the ripple, with a warning."""
        raw = channels.raw
        raw_time: Array = raw.start + raw.dt * np.arange(len(raw.held_force), dtype=np.float64)
        raw_force: Array = raw.held_force - self.parts @ self.columns(raw_time, raw.position)
        force = channels.force - self.parts @ self.columns(channels.time, channels.position)
        warnings = (*channels.warnings, Warn(Code.FORCE_RIPPLES, self.text))
        return replace(channels, force=force, raw=replace(raw, held_force=raw_force), warnings=warnings)

    def slope_std(self, time: Array, depth: Array) -> float:
        """Standard deviation of the slope of force over depth that the ripple leaves in a loading [N/m]."""
        about = depth - depth.mean()
        size = float(about @ about)
        return self.std * float(np.linalg.norm(self.columns(time, depth) @ about)) / max(size, 1e-300)


def find_ripple(channels: Channels, free_motion: FreeMotion | None) -> Ripple | None:
    """The ripple over time or over position that explains most of the force in free motion; None if neither does.

    A ripple over position may hide free motion, or the touch: it is looked for at both ends of the position, too.
    """
    position = channels.position
    low, high = outer_range(position)
    ends = [(1.0, low, (high - low) / 2), (-1.0, high, (high - low) / 2)]
    good = []
    if free_motion is not None:
        end = low if free_motion.way > 0 else high
        reach = free_motion.way * (free_motion.limit - end)
        fits = _fits(channels, free_motion.way, end, reach, (False, True))
        good = [fit for fit in fits if fit.explained > (MIN_EXPLAINED if fit.sure else MIN_EXPLAINED_ALONE)]
        if not good:
            bends = _fits(channels, free_motion.way, end, reach, (True,), MIN_BEND)
            bent = len(bends) == len(SHARES) and all(fit.explained > MIN_EXPLAINED_ALONE for fit in bends)
            good = bends[:1] if bent else []
    for way, end, reach in ends:
        if free_motion is None or way == free_motion.way:
            fits = _fits(channels, way, end, reach, (True,))
            good += [fit for fit in fits if fit.explained > MIN_EXPLAINED_ALONE]
    return max(good, key=lambda fit: fit.explained).ripple(channels) if good else None


def _fits(
    channels: Channels,
    way: float,
    end: float,
    reach: float,
    kinds: tuple[bool, ...],
    periods: float = MIN_PERIODS,
) -> list[_Fit]:
    """Sines over time (False) or position (True), in `SHARES` of the reach [m] from an end of the position."""
    fits = []
    for share in SHARES:
        inside = channels.valid & (way * (channels.position - end) < share * reach)
        stays = [slice(first, last) for first, last in runs(inside) if last - first >= _MIN_ROWS]
        if stays:
            fits += [_Fit.of(channels, stays, over_position, periods) for over_position in kinds]
    return [fit for fit in fits if fit is not None]


@dataclass(frozen=True)
class _Fit:
    """A sine fitted to the force in free motion.

    Args:
        over_position: the sine is over position, not over time.
        theta, cov: cosine, sine and wave, and their covariance.
        explained: fraction of the variance.
        periods: in the longest stay.
    """

    over_position: bool
    theta: Array
    cov: Array
    explained: float
    periods: float

    @property
    def sure(self) -> bool:
        """True if the sine has so many periods that it is no drift."""
        return self.periods > SURE_PERIODS

    @classmethod
    def of(cls, channels: Channels, stays: list[slice], over_position: bool, least: float) -> _Fit | None:
        """Fit the strongest line of the longest stay to all stays, each with a straight line of its own.

        None if it has fewer periods than `least`, or if the position has that line too: then the force may follow the
        motion.
        """
        along = channels.position if over_position else channels.time
        longest = max(stays, key=lambda rows: float(np.ptp(along[rows])))
        reach = float(np.ptp(along[longest]))
        wave = _strongest(along[longest], detrend(channels.force[longest]), least)
        if wave is None:
            return None
        stride = -(-sum(rows.stop - rows.start for rows in stays) // _MAX_ROWS)
        parts = [slice(rows.start, rows.stop, stride) for rows in stays]
        variable = np.concatenate([along[rows] for rows in parts])
        ends = np.cumsum([len(along[rows]) for rows in parts])[:-1]

        def flat(values: Array) -> Array:
            return np.concatenate([detrend(part) for part in np.split(values, ends)])

        force = flat(np.concatenate([channels.force[rows] for rows in parts]))

        def fit(wave: float, *derivative: Array) -> tuple[Array, Array]:
            design = np.column_stack(
                [flat(np.cos(wave * variable)), flat(np.sin(wave * variable)), *derivative]
            )
            return design, np.asarray(np.linalg.lstsq(design, force, rcond=None)[0], np.float64)

        def loss(wave: float) -> float:
            design, theta = fit(wave)
            return float(np.sum((force - design @ theta) ** 2))

        step = np.pi / 4 / float(np.ptp(variable))
        count = min(int(np.pi / reach / step) + 1, _MAX_STEPS)
        wave = min(wave + step * np.arange(-count, count + 1), key=loss)
        for _ in range(4):  # Gauss and Newton
            _, (cosine, sine) = fit(wave)
            by_wave = flat(variable * (sine * np.cos(wave * variable) - cosine * np.sin(wave * variable)))
            design, theta = fit(wave, by_wave)
            wave += float(np.clip(theta[2], -step, step))
        residual = force - design @ theta
        noise = estimate_noise(residual, np.arange(len(force)), 3 + 2 * len(parts))
        cov = (
            noise.variance
            * len(force)
            / noise.effective
            * np.asarray(np.linalg.pinv(design.T @ design), np.float64)
        )
        explained = 1.0 - float(residual @ residual) / max(float(force @ force), 1e-300)
        moved = flat(np.concatenate([channels.position[rows] for rows in parts]))
        swing = moved - design[:, :2] @ np.linalg.lstsq(design[:, :2], moved, rcond=None)[0]
        swings = not over_position and float(swing @ swing) < (1.0 - MIN_EXPLAINED) * float(moved @ moved)
        periods = reach * wave / (2 * np.pi)
        if swings or periods < least:
            return None
        return cls(over_position, np.append(theta[:2], wave), cov, explained, periods)

    def ripple(self, channels: Channels) -> Ripple:
        """The ripple; without parts to subtract if its phase is unknown elsewhere in the log."""
        cosine, sine, wave = self.theta
        along = (channels.position if self.over_position else channels.time)[
            :: max(len(channels.time) // 500, 1)
        ]
        phase = wave * along
        gradient = np.stack(
            [np.cos(phase), np.sin(phase), along * (sine * np.cos(phase) - cosine * np.sin(phase))]
        )
        variance = float(np.einsum("in,ij,jn->n", gradient, self.cov, gradient).max())
        amplitude = float(np.hypot(cosine, sine))
        std = float(np.hypot(np.sqrt(variance), MAX_CHANGE * amplitude))
        if self.periods < MIN_PERIODS or std >= amplitude / 2:
            return Ripple(self.over_position, float(wave), np.zeros(2), amplitude, amplitude)
        return Ripple(self.over_position, float(wave), self.theta[:2], std, amplitude)


def _strongest(along: Array, force: Array, periods: float) -> float | None:
    """The wave with most power in a stay, of some periods at least; over position the force is averaged in bins."""
    low, reach = float(along.min()), float(np.ptp(along))
    count = min(len(along), _BINS)
    if count < 16 or reach <= 0:
        return None
    place = np.minimum(((along - low) / reach * count).astype(np.intp), count - 1)
    sums, numbers = np.bincount(place, force, count), np.bincount(place, minlength=count)
    filled = np.flatnonzero(numbers)
    values = detrend(np.interp(np.arange(count), filled, sums[filled] / numbers[filled]))
    power = np.abs(np.fft.rfft(values * np.hanning(count), 8 * count)) ** 2
    first = int(8 * periods)
    return 2 * np.pi * (first + int(np.argmax(power[first:]))) / 8 / reach
