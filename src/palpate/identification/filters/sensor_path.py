"""A force sensor's own way from the motion to its readings: the front-end that cannot be mismatched.

The force went through a low-pass and was sampled before it came into the log. So the position goes through the same
low-pass and is read at the same instants: f = M a + B v + K x holds among what comes out, whatever the frequency, and
the noise of the readings stays as white as the sensor made it.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import pi

import numpy as np
from numpy.typing import NDArray

from palpate.arrays import Array
from palpate.identification.filters.position_noise import PositionNoise
from palpate.signals.low_pass import LowPass, Taps, read, taps

DERIVATIVES = 5
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
    _kept: list[tuple[Array, float, Array]] = field(default_factory=list)

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
        return taps(self.low_pass, self.dt, DERIVATIVES)

    @property
    def reach(self) -> tuple[int, int]:
        """How many samples of the position before and after an instant are needed."""
        return self._taps.before, self._taps.after

    def times(self, rows: NDArray[np.intp]) -> Array:
        """Of rows [s] from the position's first sample."""
        found: Array = self.instants[rows] * self.dt
        return found

    def force_gain(self, frequency: Array) -> Array:
        """Of the amplitude of the readings' own noise: they are taken as they are."""
        return np.ones_like(frequency)

    def position_gain(self, frequency: Array) -> Array:
        """Of the amplitude of the position at frequencies [Hz]."""
        return np.abs(self.low_pass.at(2 * pi * frequency))

    def read(self, signal: Array, derivative: int, lag: float, rows: NDArray[np.intp]) -> Array:
        """The filtered signal or a derivative of it at the samples `rows` of the force, shape (len(rows),).

        Args:
            signal: at the samples of the position, shape (n,).
            derivative: 0 to 2.
            lag: how much later than the signal the force stands in the log, the low-pass included [s].
            rows: shape (k,).
        """
        base, stack = self._stack(signal, lag)
        value, slope, curve = stack[derivative : derivative + 3, rows]
        step = base - lag
        series: Array = value if step == 0 else value + step * slope + step * step / 2 * curve
        return series

    def _stack(self, signal: Array, lag: float) -> tuple[float, Array]:
        """Signal and derivatives at all instants for a lag near by, and that lag."""
        near = [k for k in self._kept if k[0] is signal and abs(k[1] - lag) <= _NEAR * self.dt]
        if near:
            _, base, stack = min(near, key=lambda k: abs(k[1] - lag))
            return base, stack
        late = (lag - self.low_pass.lag) / self.dt
        stack = read(signal, self.instants - late, self._taps)
        stack /= self.dt ** np.arange(DERIVATIVES)[:, None]
        self._kept = [*self._kept[-_MOST_KEPT:], (signal, lag, stack)]
        return lag, stack

    def noise_spread(self, noise: PositionNoise) -> Array:
        """Covariance of what noise of the position leaves in the derivatives 0 to 3 of one reading, shape (4, 4)."""
        return noise.spread(self._taps.weights[0, :4] / self.dt ** np.arange(4)[:, None])
