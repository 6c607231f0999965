"""Filters that position and force pass through before a fit.

f = M a + B v + K x holds for filtered channels exactly as for the raw ones, if the filter is the same on both. There
are two. A state-variable filter (`Chain`) is put on both: five equal first-order lags in a row, F(s) = (w / (s + w))^5,
whose inner states give the filtered signal and its first three derivatives without ever taking a difference. The force
sensor's own low-pass and sampling (`SensorPath`), which the force went through before it came into the log, is put on
the position alone: it cannot be mismatched, and the noise of the readings stays as white as the sensor made it.
"""

from dataclasses import dataclass, field
from functools import lru_cache
from math import factorial, pi

import numpy as np

from palpate.arrays import Array, Indices
from palpate.signals.low_pass import LowPass, Taps, read, taps
from palpate.signals.position_noise import PositionNoise
from palpate.signals.samples import convolve, recursive_filter

ORDER = 5
_RESPONSE_LENGTH = 30.0  # time constants after which the impulse response has fallen below 1e-8 of its peak


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
        """Angular cut-off frequency w of F(s) [rad/s]."""
        return 2 * pi * self.cutoff

    @property
    def period(self) -> float:
        """Time from row to row [s]."""
        return self.dt

    def times(self, rows: Indices) -> Array:
        """Times of rows [s] from the first sample, less the chain's own delay."""
        return np.asarray(rows.astype(np.float64) * self.dt - self.delay)

    def force_gain(self, frequency: Array) -> Array:
        """Gain of the amplitude at frequencies [Hz]."""
        return np.asarray((1 + (frequency / self.cutoff) ** 2) ** (-ORDER / 2))

    position_gain = force_gain

    @property
    def delay(self) -> float:
        """Delay of slow signals, the same on every channel [s]."""
        return ORDER / self.rate

    @property
    def settling(self) -> float:
        """Time after which 1 % of a disturbance is left in the filtered signal [s]."""
        return 11.6 / self.rate

    @property
    def thorough_settling(self) -> float:
        """Time after which a fraction of 2e-5 of a disturbance is left in the filtered signal [s]."""
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
        filtered = np.zeros(-(-(len(signal) - first) // every))
        for start in range(reach - begin + first, reach - begin + first - min(every, len(taps)), -1):
            partial = convolve(padded[start % every :: every], taps[reach - begin + first - start :: every])
            filtered += partial[start // every :][: len(filtered)]
        return filtered + (level if derivative == 0 else 0.0)

    def read(self, signal: Array, derivative: int, lag: float, rows: Indices) -> Array:
        """Filter a signal at the samples `rows` only, in their order, shape (len(rows),).

        Each stretch of neighbouring rows is filtered with the filter's memory on either side.
        """
        memory = (
            int(np.ceil((_RESPONSE_LENGTH / self.rate + abs(lag)) / self.dt)) + 5
        )  # samples on either side
        pieces = [np.empty(0)]
        for stretch in np.split(rows, np.flatnonzero(np.diff(rows) > 2 * memory) + 1) if len(rows) else ():
            first = int(stretch[0])
            last = int(stretch[-1])
            begin = max(first - memory, 0)
            every = int(np.gcd.reduce(np.diff(stretch))) or 1
            samples = signal[begin : last + memory]
            pieces.append(self(samples, derivative, lag, first - begin, every)[(stretch - first) // every])
        return np.concatenate(pieces)

    def acceleration_noise(self, noise: PositionNoise) -> float:
        """Variance that noise of the position leaves in the second derivative."""
        return noise.variance(_taps(self, 2, 0.0)[0])


@lru_cache(maxsize=64)
def _taps(chain: Chain, derivative: int, lag: float) -> tuple[Array, int]:
    """Samples of the response to one hat of a first-order hold, and the index of the first of them.

    The cache serves a fit, which reads many signals with one lag.
    """
    first = int(np.floor(lag / chain.dt)) - 1
    count = int(np.ceil(_RESPONSE_LENGTH / (chain.rate * chain.dt))) + 3
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
    total = np.ones_like(tau)
    term = np.ones_like(tau)
    for k in range(1, order):
        term = term * tau / k
        total += term
    return 1.0 - total * np.exp(-tau)


def low_passed(signal: Array, low_pass: LowPass, dt: float) -> Array:
    """A signal, shape (n,), behind Butterworth low-passes at rest, exact for straight lines between the samples."""
    for order, cutoff in low_pass.sections:
        numerator, denominator = _butterworth(order, 2 * pi * cutoff * dt)
        signal = recursive_filter(numerator, denominator, signal - signal[0]) + signal[0]
    return signal


@lru_cache(maxsize=64)
def _butterworth(order: int, cutoff: float) -> tuple[Array, Array]:
    """Numerator and denominator of a Butterworth low-pass between straight lines, cut-off in radians per sample."""
    from scipy.linalg import expm

    poles = np.exp(1j * pi * (2 * np.arange(order) + order + 1) / (2 * order))
    A = cutoff * np.vstack([-np.poly(poles).real[1:], np.eye(order)[:-1]])
    chain = np.zeros((order + 2, order + 2))  # the states, the input and its slope
    chain[:order, :order], chain[0, order], chain[order, order + 1] = A, cutoff, 1.0
    exponential = expm(chain)
    E, step, ramp = exponential[:order, :order], exponential[:order, order], exponential[:order, order + 1]
    drive, through = step - ramp + E @ ramp, ramp[-1]
    denominator = np.asarray(np.poly(E), float)
    last = np.zeros(order)
    last[-1] = 1.0
    return np.asarray(np.poly(E - np.outer(drive, last)) + (through - 1.0) * denominator), denominator


_READ_DERIVATIVES = 5
"""The position and four derivatives: one of order 0 to 2 is read, with the two after it for a lag nearby."""
_MAX_TAYLOR_STEP = 0.25
"""Steps of time within which a lag is reached by Taylor's series from one that was read before."""
_FORGETTING_TIMES = 10.0
"""Time constants of the slowest pole after which exp(-10) is left of what was before."""
_MAX_READINGS_KEPT = 6
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
        """Cut-off of the low-pass [Hz]."""
        return self.rate / (2 * pi)

    @property
    def settling(self) -> float:
        """Time after which earlier motion no longer affects the readings [s]."""
        return _FORGETTING_TIMES / self.low_pass.decay

    @property
    def _taps(self) -> Taps:
        return taps(self.low_pass, self.dt, _READ_DERIVATIVES)

    @property
    def reach(self) -> tuple[int, int]:
        """Samples of the position that are needed before and after an instant."""
        return self._taps.before, self._taps.after

    def times(self, rows: Indices) -> Array:
        """Times of rows [s] from the position's first sample."""
        return np.asarray(self.instants[rows] * self.dt)

    def force_gain(self, frequency: Array) -> Array:
        """Gain of the readings' own noise: 1, because no filter follows."""
        return np.ones_like(frequency)

    def position_gain(self, frequency: Array) -> Array:
        """Gain of the position's amplitude at frequencies [Hz]."""
        return np.abs(self.low_pass.at(2 * pi * frequency))

    def read(self, signal: Array, derivative: int, lag: float, rows: Indices) -> Array:
        """The filtered signal or its first or second derivative at the samples `rows` of the force, shape (len(rows),).

        The signal, shape (n,), is at the samples of the position; `lag` is how much later than it the force stands in
        the log, the low-pass included [s].
        """
        readings = [
            (base, stack)
            for kept_signal, kept_rows, base, stack in self._kept
            if kept_signal is signal and kept_rows is rows and abs(base - lag) <= _MAX_TAYLOR_STEP * self.dt
        ]
        if not readings:
            delay = (lag - self.low_pass.lag) / self.dt
            stack = read(signal, self.instants[rows] - delay, self._taps)
            stack /= self.dt ** np.arange(_READ_DERIVATIVES)[:, None]
            self._kept = [*self._kept[-_MAX_READINGS_KEPT:], (signal, rows, lag, stack)]
            readings = [(lag, stack)]
        base, stack = min(readings, key=lambda reading: abs(reading[0] - lag))
        value, slope, curve = stack[derivative : derivative + 3]
        step = base - lag
        series: Array = value if step == 0 else value + step * slope + step * step / 2 * curve
        return series


MAX_CUTOFF_RATIO = 1 / 8
"""Highest cut-off as a share of the readings per second: above it sampling, not filtering, sets the error."""
MIN_POWER_OVER_NOISE = 10.0
"""Power over that of the noise from which on it is a signal's."""
MIN_SPECTRUM_SAMPLES = 64
"""Samples of a stretch whose spectrum tells how fast it is."""
_MAX_SPECTRUM_SAMPLES = 8192
"""Samples of a spectrum: twenty periods of the lowest cut-off, a 400th of the readings per second."""


def choose_cutoff(position: Array, force: Array, dt: float, rate: float) -> float:
    """The cut-off [Hz] that passes what stands above the noise in both channels of a stretch, each of shape (n,).

    `dt` is their sampling period [s], `rate` the fresh readings per second of the slower one [1/s].
    """
    highest = MAX_CUTOFF_RATIO * rate
    if len(position) < MIN_SPECTRUM_SAMPLES:
        return highest
    edge = 2 * min(
        _edge(position, dt), _edge(force, dt)
    )  # five lags halve the power at 0.39 of their cut-off
    lowest = min(highest, 10 / (len(position) * dt))
    return float(np.clip(edge, max(lowest, highest / 50), highest))


def _edge(signal: Array, dt: float) -> float:
    """The highest frequency at which the spectrum stands well above its own floor near the end of the band [Hz]."""
    size = min(len(signal), _MAX_SPECTRUM_SAMPLES)
    window = np.hanning(size)
    line = np.linspace(0, 1, size)
    power = np.zeros(size // 2 + 1)
    for begin in range(0, len(signal) - size + 1, max(size // 2, 1)):
        block = signal[begin : begin + size]
        block = block - block[0] - line * (block[-1] - block[0])
        power += np.abs(np.fft.rfft(block * window)) ** 2
    frequency = np.fft.rfftfreq(size, dt)
    width = max(len(power) // 100, 1)
    power = np.convolve(power, np.ones(width) / width, mode="same")
    floor = float(np.median(power[-len(power) // 4 :]))
    significant = np.flatnonzero(power > MIN_POWER_OVER_NOISE * floor)
    return float(frequency[significant[-1]]) if len(significant) else 0.0
