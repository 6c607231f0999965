"""Filters that position and force pass through before a fit, and the noise of the position behind them.

f = M a + B v + K x holds for filtered channels exactly as for the raw ones, if the filter is the same on both. There
are two. A state-variable filter (`Chain`) is put on both: five equal first-order lags in a row, F(s) = (w / (s + w))^5,
whose inner states give the filtered signal and its first three derivatives without ever taking a difference. The force
sensor's own low-pass and sampling (`SensorPath`), which the force went through before it came into the log, is put on
the position alone: it cannot be mismatched, and the noise of the readings stays as white as the sensor made it.

Two kinds of noise count: white noise of the position itself, and jumps of it, white noise of its increments, as a slow
motion through a coarse encoder makes them. Power of the increments per sample at f of the sampling rate:
jump^2 + white^2 4 sin^2(pi f); no motion of a robot reaches the upper frequencies, so there it is the noise's alone.
"""

from dataclasses import dataclass, field
from functools import lru_cache
from math import factorial, pi

import numpy as np

from palpate.arrays import Array, Indices
from palpate.signals.low_pass import LowPass, Taps, read, taps
from palpate.signals.samples import convolve

_FROM = 0.2
"""Share of the sampling rate above which there is no motion."""
_STEPS = 256
"""Samples of a spectrum of the increments."""
_IN_BAND = 0.5
"""Share of the jumps' power that counts at the frequencies of a motion: `PositionNoise.variance` says why."""
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

    power, weight = np.zeros(_STEPS // 2 + 1), 0.0
    frequency = np.fft.rfftfreq(_STEPS)
    for steps in (np.diff(stretch) for stretch in stretches if len(stretch) >= 16):
        size = min(_STEPS, len(steps))
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


def noise_within(position: Array, rows: Indices, spans: Indices) -> PositionNoise:
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


ORDER = 5
_LENGTH = 30.0  # time constants after which the impulse response has fallen below 1e-8 of its peak


@dataclass(frozen=True)
class Chain:
    """State-variable filters of one cut-off for evenly sampled signals.

    The response to the straight lines between the samples is exact (a first-order hold), also between the samples:
    a channel can be read at any `t - lag`. So there is no warping of frequencies, unlike with a bilinear filter.

    Args:
        cutoff: of each of the five lags [Hz].
        dt: sampling period [s].
    """

    cutoff: float
    dt: float

    @property
    def rate(self) -> float:
        """w of F(s) [rad/s]."""
        return 2 * pi * self.cutoff

    @property
    def period(self) -> float:
        """From row to row [s]."""
        return self.dt

    def times(self, rows: Indices) -> Array:
        """Of rows [s] from the first sample, less the chain's own delay."""
        return np.asarray(rows.astype(np.float64) * self.dt - self.delay)

    def force_gain(self, frequency: Array) -> Array:
        """Of its amplitude at frequencies [Hz]."""
        return np.asarray((1 + (frequency / self.cutoff) ** 2) ** (-ORDER / 2))

    position_gain = force_gain

    @property
    def delay(self) -> float:
        """Delay of slow signals, the same on every channel [s]."""
        return ORDER / self.rate

    @property
    def settling(self) -> float:
        """Time after which a disturbance has left the filtered signal but for 1 % [s]."""
        return 11.6 / self.rate

    @property
    def thorough_settling(self) -> float:
        """The same, but for 2e-5 of it [s]."""
        return 20.0 / self.rate

    def __call__(
        self, signal: Array, derivative: int = 0, lag: float = 0.0, first: int = 0, every: int = 1
    ) -> Array:
        """The filtered signal, or one of its derivatives 0 to 3, at the times t - lag, shape (n,).

        Before its first and after its last sample the signal, shape (n,), is taken to rest there; the lag may be
        negative. Of the samples one in `every` from the `first` on is returned, by as many short filters, each of whose
        inputs is one sample in as many (a polyphase decimator; Crochiere and Rabiner, 1983).
        """
        taps, begin = _taps(self, derivative, lag)
        reach = len(taps) + abs(begin)
        level = float(signal[0])
        padded = np.empty(len(signal) + 2 * reach)
        np.subtract(signal, level, out=padded[reach:-reach])
        padded[:reach], padded[-reach:] = padded[reach], padded[-reach - 1]
        found = np.zeros(-(-(len(signal) - first) // every))
        for start in range(reach - begin + first, reach - begin + first - min(every, len(taps)), -1):
            own = convolve(padded[start % every :: every], taps[reach - begin + first - start :: every])
            found += own[start // every :][: len(found)]
        return found + (level if derivative == 0 else 0.0)

    def read(self, signal: Array, derivative: int, lag: float, rows: Indices) -> Array:
        """The same at the samples `rows` only, in their order, shape (len(rows),).

        Each stretch of neighbouring rows is filtered with what the filter remembers on either side.
        """
        memory = int(np.ceil((_LENGTH / self.rate + abs(lag)) / self.dt)) + 5  # samples on either side
        found = [np.empty(0)]
        for own in np.split(rows, np.flatnonzero(np.diff(rows) > 2 * memory) + 1) if len(rows) else ():
            first, last = int(own[0]), int(own[-1])
            begin, every = max(first - memory, 0), int(np.gcd.reduce(np.diff(own))) or 1
            part = signal[begin : last + memory]
            found.append(self(part, derivative, lag, first - begin, every)[(own - first) // every])
        return np.concatenate(found)

    def acceleration_noise(self, noise: PositionNoise) -> float:
        """Variance that noise of the position leaves in the second derivative."""
        return noise.variance(_taps(self, 2, 0.0)[0])


@lru_cache(maxsize=64)
def _taps(chain: Chain, derivative: int, lag: float) -> tuple[Array, int]:
    """Samples of the response to one hat of a first-order hold, and the index of the first of them.

    They are kept: a fit reads many signals with one lag.
    """
    first = int(np.floor(lag / chain.dt)) - 1
    count = int(np.ceil(_LENGTH / (chain.rate * chain.dt))) + 3
    time = (first + np.arange(count)) * chain.dt - lag
    curve = _integrate(chain.rate, derivative, time[:, None] + np.array([chain.dt, 0.0, -chain.dt]))
    taps = (curve[:, 0] - 2 * curve[:, 1] + curve[:, 2]) / chain.dt
    if derivative == 0:
        taps /= taps.sum()  # the cut-off tail would otherwise cost 1e-9 of the level
    taps.flags.writeable = False
    return taps, first


def _integrate(w: float, derivative: int, time: Array) -> Array:
    """The impulse response integrated twice and then differentiated `derivative` times, 0 to 3."""
    tau = w * np.maximum(time, 0.0)
    if derivative == 0:
        return (tau * _erlang_cdf(ORDER, tau) - ORDER * _erlang_cdf(ORDER + 1, tau)) / w
    if derivative == 1:
        return _erlang_cdf(ORDER, tau)
    if derivative == 2:
        return w * _erlang(ORDER, tau)
    if derivative == 3:
        return w**2 * (_erlang(ORDER - 1, tau) - _erlang(ORDER, tau))
    raise ValueError(f"the chain gives derivatives 0 to 3, not {derivative}")


def _erlang(order: int, tau: Array) -> Array:
    """Impulse response of `order` unit lags in a row."""
    return tau ** (order - 1) * np.exp(-tau) / factorial(order - 1)


def _erlang_cdf(order: int, tau: Array) -> Array:
    """Step response of `order` unit lags in a row."""
    total, term = np.ones_like(tau), np.ones_like(tau)
    for k in range(1, order):
        term = term * tau / k
        total += term
    return 1.0 - total * np.exp(-tau)


def low_passed(signal: Array, low_pass: LowPass, dt: float) -> Array:
    """A signal, shape (n,), behind Butterworth low-passes at rest, exact for straight lines between the samples."""
    from scipy.signal import butter, cont2discrete, lfilter

    for order, cutoff in low_pass.sections:
        analog = butter(order, 2 * np.pi * cutoff * dt, analog=True)
        numerator, denominator, _ = cont2discrete(analog, 1.0, method="foh")
        signal = lfilter(numerator.ravel(), denominator, signal - signal[0]) + signal[0]
    return signal


_DERIVATIVES = 5
"""The position and four derivatives: one of order 0 to 2 is read, with the two after it for a lag nearby."""
_NEAR = 0.25
"""Steps of time within which a lag is reached by Taylor's series from one that was read before."""
_FORGOTTEN = 10.0
"""Time constants of the slowest pole after which exp(-10) is left of what was before."""
_MOST_KEPT = 6
"""Readings of signals that are kept beside the newest."""


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
    _kept: list[tuple[Array, Indices, float, Array]] = field(default_factory=list)

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

    def times(self, rows: Indices) -> Array:
        """Of rows [s] from the position's first sample."""
        return np.asarray(self.instants[rows] * self.dt)

    def force_gain(self, frequency: Array) -> Array:
        """Of the amplitude of the readings' own noise: they are taken as they are."""
        return np.ones_like(frequency)

    def position_gain(self, frequency: Array) -> Array:
        """Of the amplitude of the position at frequencies [Hz]."""
        return np.abs(self.low_pass.at(2 * pi * frequency))

    def read(self, signal: Array, derivative: int, lag: float, rows: Indices) -> Array:
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


FASTEST = 1 / 8
"""Highest cut-off as a share of the readings per second: above it sampling, not filtering, sets the error."""
ABOVE_FLOOR = 10.0
"""Power over that of the noise from which on it is a signal's."""
FEWEST_SEGMENT = 64
"""Samples of a stretch whose spectrum tells how fast it is."""
_SEGMENT = 8192
"""Samples of a spectrum: twenty periods of the lowest cut-off, a 400th of the readings per second."""


def choose_cutoff(position: Array, force: Array, dt: float, rate: float) -> float:
    """The cut-off [Hz] that passes what stands above the noise in both channels of a stretch, each of shape (n,).

    `dt` is their sampling period [s], `rate` the fresh readings per second of the slower one [1/s].
    """
    highest = FASTEST * rate
    if len(position) < FEWEST_SEGMENT:
        return highest
    edge = 2 * min(
        _edge(position, dt), _edge(force, dt)
    )  # five lags halve the power at 0.39 of their cut-off
    lowest = min(highest, 10 / (len(position) * dt))
    return float(np.clip(edge, max(lowest, highest / 50), highest))


def _edge(signal: Array, dt: float) -> float:
    """The highest frequency at which the spectrum stands well above its own floor near the end of the band [Hz]."""
    size = min(len(signal), _SEGMENT)
    window, line, power = np.hanning(size), np.linspace(0, 1, size), np.zeros(size // 2 + 1)
    for begin in range(0, len(signal) - size + 1, max(size // 2, 1)):
        part = signal[begin : begin + size]
        part = part - part[0] - line * (part[-1] - part[0])
        power += np.abs(np.fft.rfft(part * window)) ** 2
    frequency = np.fft.rfftfreq(size, dt)
    width = max(len(power) // 100, 1)
    power = np.convolve(power, np.ones(width) / width, mode="same")
    floor = float(np.median(power[-len(power) // 4 :]))
    above = np.flatnonzero(power > ABOVE_FLOOR * floor)
    return float(frequency[above[-1]]) if len(above) else 0.0
