"""The approach: hold, then step toward the surface until something is felt (thesis, ch. 4 and App. E)."""

import math
from typing import NamedTuple

from palpate._jit import part


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
