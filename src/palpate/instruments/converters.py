"""Between volts and numbers: converters quantise and saturate.

Both use the codes -(2^(bits-1) - 1) ... 2^(bits-1) - 1: mid-tread and symmetric. The one code more below is
left out.
"""

from typing import Any, NamedTuple

from palpate._jit import law, part
from palpate._vector import clip
from palpate.signals.parameters import coerced, components, require
from palpate.signals.quantise import quantise


def _check(self):
    require(2 <= self.bits <= 32, "bits", "between 2 and 32", self.bits)
    require(min(components(self.full_scale)) > 0, "full scale", "above 0", self.full_scale)


@law
def convert(u, step, full_scale):
    """u to the nearest code, as the quantity that the code stands for."""
    return clip(quantise(u, step), full_scale - step)


@part
@coerced(_check)
class AnalogToDigital(NamedTuple):
    """An analog input: what it reads of a quantity, in that quantity's unit.

    Args:
        bits: of the code.
        full_scale: of the quantity; a number, or a `Vec3` of three channels.
    """

    bits: int
    full_scale: Any

    def read(self, u):
        """The quantity as it is read."""
        return convert(u, self.resolution, self.full_scale)

    @property
    def resolution(self):
        """One code."""
        return self.full_scale / 2.0 ** (self.bits - 1)

    @property
    def lag(self):
        """Seconds: 5 us of conversion are nothing to a 1 kHz loop."""
        return 0.0


@part
@coerced(_check)
class DigitalToAnalog(NamedTuple):
    """An analog output; the holding until the next tick is the loop's, and so is its half-tick of lag.

    Args:
        bits: of the code.
        full_scale: of the quantity; a number, or a `Vec3` of three channels.
    """

    bits: int
    full_scale: Any

    def write(self, u):
        """The quantity that goes out."""
        return convert(u, self.resolution, self.full_scale)

    @property
    def resolution(self):
        """One code."""
        return self.full_scale / 2.0 ** (self.bits - 1)

    @property
    def lag(self):
        """Seconds, without the holding."""
        return 0.0
