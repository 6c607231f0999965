"""The analog low-pass between the force sensor and the converter, from its components."""

import math

from palpate.signals.filters import Biquad, lowpass2
from palpate.signals.parameters import require


def sallen_key(r1: float, r2: float, c1: float, c2: float, rate: float) -> Biquad:
    """A unity-gain Sallen-Key low-pass, stepped at a physics rate [Hz] far above its corner.

    w0^2 = 1/(R1 R2 C1 C2) and w0/Q = (R1 + R2)/(R1 R2 C1), thesis fig. 3.6; resistances [Ohm], capacities
    [F].
    """
    require(min(r1, r2, c1, c2) > 0, "component values", "above 0", (r1, r2, c1, c2))
    w0 = 1.0 / math.sqrt(r1 * r2 * c1 * c2)
    return lowpass2(w0 / (2.0 * math.pi), w0 * r1 * r2 * c1 / (r1 + r2), rate)


def analog_filter_190(rate: float = 20000.0) -> Biquad:
    """The thesis' filter: 189.6 Hz, Q 0.83, and so -3 dB at 217 Hz.

    The values are printed in Ohm and uF, which give the same corner; an amplifier can only drive kOhm and nF.
    """
    return sallen_key(r1=100e3, r2=1.5e3, c1=470e-9, c2=10e-9, rate=rate)
