"""A force sensor's own way from the motion to its readings: the front-end that cannot be mismatched.

The force went through a low-pass and was sampled before it came into the log. So the position goes through the same
low-pass and is read at the same instants: f = M a + B v + K x holds among what comes out, whatever the frequency, and
the noise of the readings stays as white as the sensor made it.

Two kinds of noise count: white noise of the position itself, and jumps of it, white noise of its increments, as a slow
motion through a coarse encoder makes them. Power of the increments per sample at f of the sampling rate:
jump^2 + white^2 4 sin^2(pi f); no motion of a robot reaches the upper frequencies, so there it is the noise's alone.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import pi

import numpy as np
from numpy.typing import NDArray

from palpate.arrays import Array
from palpate.signals.low_pass import LowPass, Taps, read, taps

_FROM = 0.2
"""Share of the sampling rate above which there is no motion."""
_SEGMENT = 256
_IN_BAND = 0.5
_FEWEST = 10
"""Single counts that show what one is worth."""


@dataclass(frozen=True)
class PositionNoise:
    """Deviations in the position's unit.

    Args:
        white: of a sample.
        jump: of what is added from sample to sample.
        count: what the position moves by when its encoder counts on; 0 where single counts are not seen.
    """

    white: float
    jump: float
    count: float = 0.0

    def power(self, frequency: Array, dt: float) -> Array:
        """Of a line of an orthonormal transform of the position, at frequencies [Hz].

        An encoder's error never leaves its count: below the rate jump^2/count^2 of its steps it is flat, with a whole
        variance of count^2/12.
        """
        step = 4 * np.sin(np.pi * np.minimum(frequency * dt, 0.5)) ** 2
        jumps = _IN_BAND * self.jump**2 / np.maximum(step, 1e-12)
        if self.count and self.jump:
            jumps = np.minimum(jumps, self.count**4 / (24 * self.jump**2))
        return np.asarray(self.white**2 + jumps)

    def variance(self, weights: Array) -> float:
        """Of a filtered rate or acceleration of this noise, by the filter's weights, shape (n,).

        Of the jumps' power half is counted: an encoder's error never leaves its count, so its jumps undo each other,
        and toward the low frequencies of a motion their power falls below what it is above.
        """
        steps = np.cumsum(weights)
        return float(self.white**2 * weights @ weights + _IN_BAND * self.jump**2 * steps @ steps)


NOISELESS = PositionNoise(0.0, 0.0)


def position_noise(stretches: list[Array]) -> PositionNoise:
    """Measure it on stretches of a position, each of shape (n_i,); those shorter than 16 samples say nothing."""
    from scipy.optimize import nnls

    power, weight = np.zeros(_SEGMENT // 2 + 1), 0.0
    frequency = np.fft.rfftfreq(_SEGMENT)
    for steps in (np.diff(stretch) for stretch in stretches if len(stretch) >= 16):
        size = min(_SEGMENT, len(steps))
        segments = np.lib.stride_tricks.sliding_window_view(steps, size)[:: max(size // 2, 1)]
        window = np.hanning(size + 2)[1:-1]
        own = (np.abs(np.fft.rfft(segments * window, axis=1)) ** 2).mean(axis=0) / float(window @ window)
        power += len(steps) * np.interp(frequency, np.linspace(0, 0.5, len(own)), own)
        weight += len(steps)
    if weight == 0:
        return NOISELESS
    above = frequency >= _FROM
    shape = np.column_stack([4 * np.sin(np.pi * frequency[above]) ** 2, np.ones(int(above.sum()))])
    scale = float(np.mean(power[above])) or 1.0
    found, _ = nnls(shape, power[above] / scale)
    white, jump = np.sqrt(found * scale / weight)
    return PositionNoise(float(white), float(jump), _count(stretches))


def noise_within(position: Array, rows: NDArray[np.intp], spans: NDArray[np.intp]) -> PositionNoise:
    """That of a position, shape (n,), at rows in contact, and the number of each one's contact, shape (m,)."""
    inside = np.split(rows, np.flatnonzero(np.diff(spans)) + 1)
    return position_noise([position[own[0] : own[-1] + 1] for own in inside if len(own)])


def _count(stretches: list[Array]) -> float:
    """From changes with none before and none after them. Of several encoders the coarsest counts most."""
    alone = []
    for steps in (np.abs(np.diff(stretch)) for stretch in stretches if len(stretch) > 3):
        still = steps == 0
        alone.append(steps[1:-1][still[:-2] & still[2:] & ~still[1:-1]])
    found = np.concatenate(alone) if alone else np.zeros(0)
    return float(np.sum(found**3) / np.sum(found**2)) if len(found) >= _FEWEST else 0.0


_DERIVATIVES = 5
"""The position and four derivatives: one of order 0 to 2 is read, with the two after it for a lag nearby."""
_NEAR = 0.25
"""Steps of time within which a lag is reached by Taylor's series from one that was read before."""
_FORGOTTEN = 10.0
_MOST_KEPT = 6


@dataclass
class SensorPath:
    """Reads the position as the force sensor would.

    Args:
        low_pass: of the sensor.
        start: time of the position's first sample [s].
        dt: sampling period of the position [s].
        instants: of the force's samples, in samples of the position, shape (m,).
        period: between two of these [s].
    """

    low_pass: LowPass
    start: float
    dt: float
    instants: Array
    period: float
    _kept: list[tuple[Array, NDArray[np.intp], float, Array]] = field(default_factory=list)

    @property
    def rate(self) -> float:
        """Angular frequency of the low-pass [rad/s]."""
        return 2 * pi * min(self.low_pass.cutoff, 0.25 / self.dt)

    @property
    def cutoff(self) -> float:
        """Of the low-pass [Hz]."""
        return self.rate / (2 * pi)

    @property
    def settling(self) -> float:
        """Time after which what was before has left the readings [s]."""
        return _FORGOTTEN / self.low_pass.decay

    @property
    def _taps(self) -> Taps:
        return taps(self.low_pass, self.dt, _DERIVATIVES)

    @property
    def reach(self) -> tuple[int, int]:
        """How many samples of the position before and after an instant are needed."""
        return self._taps.before, self._taps.after

    def times(self, rows: NDArray[np.intp]) -> Array:
        """Of rows [s] from the position's first sample."""
        return np.asarray(self.instants[rows] * self.dt)

    def force_gain(self, frequency: Array) -> Array:
        """Of the amplitude of the readings' own noise: they are taken as they are."""
        return np.ones_like(frequency)

    def position_gain(self, frequency: Array) -> Array:
        """Of the amplitude of the position at frequencies [Hz]."""
        return np.abs(self.low_pass.at(2 * pi * frequency))

    def read(self, signal: Array, derivative: int, lag: float, rows: NDArray[np.intp]) -> Array:
        """The filtered signal or its first or second derivative at the samples `rows` of the force, shape (len(rows),).

        The signal, shape (n,), is at the samples of the position; `lag` is how much later than it the force stands in
        the log, the low-pass included [s].
        """
        near = [
            (base, stack)
            for own, at, base, stack in self._kept
            if own is signal and at is rows and abs(base - lag) <= _NEAR * self.dt
        ]
        if not near:
            late = (lag - self.low_pass.lag) / self.dt
            stack = read(signal, self.instants[rows] - late, self._taps)
            stack /= self.dt ** np.arange(_DERIVATIVES)[:, None]
            self._kept = [*self._kept[-_MOST_KEPT:], (signal, rows, lag, stack)]
            near = [(lag, stack)]
        base, stack = min(near, key=lambda kept: abs(kept[0] - lag))
        value, slope, curve = stack[derivative : derivative + 3]
        step = base - lag
        series: Array = value if step == 0 else value + step * slope + step * step / 2 * curve
        return series
