"""Desired contact force over time (thesis, sec. 6.3)."""

import math
from typing import NamedTuple

from palpate._jit import part


@part
class ForceSchedule(NamedTuple):
    """Steps between two forces, with a sine on top.

    Args:
        first: force at the start [N].
        second: force of every other interval [N]; equal to `first` for a constant force.
        period: length of an interval [s].
        amplitude: of the sine [N].
        frequency: of the sine [Hz]; 4 sin(pi t) is amplitude 4, frequency 0.5.
        restart: the sine's clock starts anew each so many seconds, as the listing's does; 0 lets it run on.
    """

    first: float
    second: float
    period: float
    amplitude: float
    frequency: float
    restart: float

    def force(self, since):
        """Desired force [N], `since` seconds after contact."""
        # Half a microsecond forgives the rounding of k * dt, so that a step falls on its own tick.
        interval = math.floor((since + 5e-7) / self.period)
        level = self.first if interval % 2 == 0 else self.second
        clock = (
            since if self.restart <= 0.0 else since - self.restart * math.floor((since + 5e-7) / self.restart)
        )
        return level + self.amplitude * math.sin(2.0 * math.pi * self.frequency * clock)
