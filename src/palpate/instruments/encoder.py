"""Joint encoders."""

import math
from typing import Any, NamedTuple

from palpate._jit import part
from palpate.signals.parameters import coerced, components, require
from palpate.signals.quantise import whole

_TURN = 2.0 * math.pi


def _check(self):
    require(min(components(self.counts)) > 0, "encoder counts", "above 0 a turn", self.counts)


@part
@coerced(_check)
class Encoder(NamedTuple):
    """The angle to the nearest count; mid-tread.

    Args:
        counts: counts a turn; a number, or a `Vec3` for three joints.
        offset: angle of the zero count [rad], likewise.
    """

    counts: Any
    offset: Any = 0.0

    def read(self, angle):
        """The angle [rad] as the encoder has it."""
        return whole((angle - self.offset) * self.counts / _TURN) * _TURN / self.counts + self.offset

    @property
    def resolution(self):
        """One count [rad]."""
        return (0.0 * self.counts + _TURN) / self.counts

    @property
    def lag(self):
        """Seconds: an encoder answers at once."""
        return 0.0
