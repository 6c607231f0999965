"""Desired contact force over time (thesis, sec. 6.3)."""

import math
from typing import Any, NamedTuple

import numpy as np

from palpate._jit import part

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
