"""Desired motion and force: the approach to the surface, the force schedule and the excitations added to it.

The approach holds, then steps toward the surface until a force is felt (thesis, ch. 4 and App. E); the schedule is that
of thesis, sec. 6.3.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from palpate._jit import part
from palpate.arrays import Array


@part
class Approach(NamedTuple):
    """Desired x position while the arm looks for the surface.

    Args:
        start: x held at first [m].
        hold: for how long [s].
        first: x after the hold [m].
        step: added once each `period` [m].
        period: time between steps [s].
    """

    start: float
    hold: float
    first: float
    step: float
    period: float

    def position(self, since):
        """Desired x [m], `since` seconds after the approach began."""
        # Half a microsecond forgives the rounding of k * dt, so that a step falls on its own tick.
        late = since - self.hold + 5e-7
        if late < 0.0:
            return self.start
        return self.first + self.step * math.floor(late / self.period)


NO_WAVE = np.empty(0)


@part
class ForceSchedule(NamedTuple):
    """Steps between two forces, with a sine on top, and any wave on top of that.

    Args:
        first: force at the start [N].
        second: force of every other interval [N]; equal to `first` for a constant force.
        period: length of an interval [s].
        amplitude: of the sine [N].
        frequency: of the sine [Hz]; 4 sin(pi t) is amplitude 4, frequency 0.5.
        restart: period after which the sine's clock restarts [s], as the listing's does; 0 lets it run on.
        wave: [N], from contact on, shape (n,); zero after its end.
        rate: of the wave's samples, the loop's own [Hz].
    """

    first: float
    second: float
    period: float
    amplitude: float
    frequency: float
    restart: float
    wave: Any = NO_WAVE
    rate: float = 1000.0

    def force(self, since):
        """Desired force [N], `since` seconds after contact."""
        # Half a microsecond forgives the rounding of k * dt, so that a step falls on its own tick.
        interval = math.floor((since + 5e-7) / self.period)
        level = self.first if interval % 2 == 0 else self.second
        clock = (
            since if self.restart <= 0.0 else since - self.restart * math.floor((since + 5e-7) / self.restart)
        )
        i = int((since + 5e-7) * self.rate)
        on_top = self.wave[i] if i < len(self.wave) else 0.0
        return level + self.amplitude * math.sin(2.0 * math.pi * self.frequency * clock) + on_top


class Chirp(NamedTuple):
    """A sine that sweeps from one frequency to another, once; its phase is the exact integral of its frequency.

    Args:
        low: frequency at the start [Hz].
        high: at the end [Hz].
        seconds: from the one to the other; zero afterwards.
        amplitude: unit of the signal.
        logarithmic: the frequency grows by the same factor each second, not by the same difference.
    """

    low: float
    high: float
    seconds: float
    amplitude: float
    logarithmic: bool = False

    def at(self, time: Array) -> Array:
        """The signal at times [s], shape (n,)."""
        inside = (time >= 0.0) & (time <= self.seconds)
        return np.where(inside, self.amplitude * np.sin(2.0 * math.pi * self._turns(time)), 0.0)

    def _turns(self, time: Array) -> Array:
        """Periods since the start."""
        if not self.logarithmic or self.low == self.high:
            return (self.low + 0.5 * (self.high - self.low) * time / self.seconds) * time
        growth = math.log(self.high / self.low) / self.seconds
        return self.low / growth * np.expm1(growth * np.clip(time, 0.0, self.seconds))


class Multisine(NamedTuple):
    """Sines side by side: sum of a sin(2 pi f t + phase).

    Args:
        frequencies: [Hz], shape (m,).
        amplitudes: unit of the signal, shape (m,).
        phases: at the start [rad], shape (m,).
    """

    frequencies: tuple[float, ...]
    amplitudes: tuple[float, ...]
    phases: tuple[float, ...]

    def at(self, time: Array) -> Array:
        """The signal at times [s], shape (n,)."""
        total = np.zeros(len(time))
        for f, a, phase in zip(self.frequencies, self.amplitudes, self.phases, strict=True):
            total += a * np.sin(2.0 * math.pi * f * time + phase)
        return total
