"""The one filter chain that every channel of an identification passes through.

A state-variable filter: five equal first-order lags in a row, F(s) = (w / (s + w))^5, whose inner states give the
filtered signal and its first three derivatives without ever taking a difference. f = M a + B v + K x holds for the
filtered channels exactly as for the raw ones, because F is the same on all of them.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from math import factorial, pi

import numpy as np
from numpy.typing import NDArray

from palpate.arrays import Array
from palpate.identification.filters.sensor_path import PositionNoise
from palpate.signals.low_pass import LowPass
from palpate.signals.samples import GAUSSIAN, convolve

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

    def times(self, rows: NDArray[np.intp]) -> Array:
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

    def read(self, signal: Array, derivative: int, lag: float, rows: NDArray[np.intp]) -> Array:
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


def white_noise(signal: Array) -> float:
    """Standard deviation of the white part of a signal, from its eighth differences.

    An upper bound: what is left of the motion itself in the differences counts as noise.
    """
    differences = np.diff(signal, 8)  # the sum of whose squared weights is 12870
    return float(GAUSSIAN * np.median(np.abs(differences)) / np.sqrt(12870)) if len(differences) else 0.0


def block_means(signal: Array, size: int) -> Array:
    """Means of neighbouring blocks of `size` samples, shape (n // size,); the rest at the end is dropped."""
    count = len(signal) // size
    return np.asarray(signal[: count * size].reshape(count, size).mean(axis=1))


def low_passed(signal: Array, low_pass: LowPass, dt: float) -> Array:
    """A signal, shape (n,), behind Butterworth low-passes at rest, exact for straight lines between the samples."""
    from scipy.signal import butter, cont2discrete, lfilter

    for order, cutoff in low_pass.sections:
        analog = butter(order, 2 * np.pi * cutoff * dt, analog=True)
        numerator, denominator, _ = cont2discrete(analog, 1.0, method="foh")
        signal = lfilter(numerator.ravel(), denominator, signal - signal[0]) + signal[0]
    return signal


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
    edge = 2 * min(_edge(position, dt), _edge(force, dt))  # five lags halve the power at .39 of their cut-off
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
