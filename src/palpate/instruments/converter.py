"""Between volts and numbers, both ways: converters quantise and saturate.

The codes are -(2^(bits-1) - 1) ... 2^(bits-1) - 1: mid-tread and symmetric. The one code more below is
left out.
"""

from typing import Any, NamedTuple

from palpate._jit import part
from palpate._vector import clip, sign
from palpate.signals.parameters import coerced, components, require
from palpate.signals.quantise import quantise


def _check(self):
    require(2 <= self.bits <= 32, "bits", "between 2 and 32", self.bits)
    require(min(components(self.full_scale)) > 0, "full scale", "above 0", self.full_scale)


@part
@coerced(_check)
class Converter(NamedTuple):
    """An analog input or output: the quantity that a code stands for, in that quantity's unit.

    What an output holds until the next tick, and so half a tick of lag, is the loop's.

    Args:
        bits: of the code.
        full_scale: of the quantity; a number, or a `Vec3` of three channels.
    """

    bits: int
    full_scale: Any

    def convert(self, u):
        """The quantity of the code nearest to u."""
        return clip(quantise(u, self.resolution), self.full_scale - self.resolution)

    def convert_within(self, u, limit):
        """The quantity of the code nearest to u of those that do not exceed the limit."""
        return self.convert(clip(u, self.below(limit)))

    def below(self, limit):
        """The quantity of the largest code that is no more than the limit."""
        nearest = quantise(limit, self.resolution)
        beyond = sign(nearest - limit)
        return nearest - 0.5 * (beyond + abs(beyond)) * self.resolution

    @property
    def resolution(self):
        """One code."""
        return self.full_scale / 2.0 ** (self.bits - 1)

    @property
    def lag(self):
        """Seconds: 5 us of conversion are nothing to a 1 kHz loop."""
        return 0.0
