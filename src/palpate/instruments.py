"""Instruments: each states its lag [s], the group delay at zero frequency.

Converters between volts and numbers quantise and saturate. Their codes are -(2^(bits-1) - 1) ... 2^(bits-1) - 1:
mid-tread and symmetric; the one code more below is left out.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from palpate._jit import part
from palpate._vector import clip, sign
from palpate.signals.filters import Biquad, Cascade, CascadeState, butterworth3, lowpass2
from palpate.signals.samples import quantise, whole
from palpate.signals.types import coerce_fields, components, require


def _check_converter(self):
    require(2 <= self.bits <= 32, "bits", "between 2 and 32", self.bits)
    require(min(components(self.full_scale)) > 0, "full scale", "above 0", self.full_scale)


@part
@coerce_fields(_check_converter)
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
        """The size of one step of the instrument."""
        return self.full_scale / 2.0 ** (self.bits - 1)

    @property
    def lag(self):
        """Seconds: 5 us of conversion are nothing to a 1 kHz loop."""
        return 0.0


_TURN = 2.0 * math.pi


def _check_encoder(self):
    require(min(components(self.counts)) > 0, "encoder counts", "above 0 a turn", self.counts)


@part
@coerce_fields(_check_encoder)
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
        """The size of one step of the instrument."""
        return (0.0 * self.counts + _TURN) / self.counts

    @property
    def lag(self):
        """Seconds: an encoder answers at once."""
        return 0.0


class ForceSensorState(NamedTuple):
    """State of a force sensor: low-pass, last sample and output."""

    analog: CascadeState
    computing: float  # sampled last, put out at the next sample [N]
    held: float  # on the output now [N]


def _check_sensor(self):
    require(0 < self.sampling <= self.rate, "sampling", f"between 1 and {self.rate} Hz", self.sampling)
    require(self.noise >= 0, "noise", "at least 0 N", self.noise)
    require(0 <= self.shift < self.rate, "shift", f"at least 0 and below {self.rate}", self.shift)


@part
@coerce_fields(_check_sensor)
class ForceSensor(NamedTuple):
    """Analog low-pass, noisy sampling, one cycle of computing, and holding; stepped with the physics.

    Args:
        analog: low-pass before the sampling, at the physics rate.
        converter: quantises and saturates the sample.
        noise: standard deviation of a sample [N].
        sampling: samples a second [Hz], whole.
        rate: physics steps a second [Hz], whole.
        shift: of the sampling clock against the physics' [1/(sampling rate) s], whole, below `rate`: a period.
    """

    analog: Cascade
    converter: Converter
    noise: float
    sampling: int
    rate: int
    shift: int = 0

    def start(self):
        return ForceSensorState(self.analog.start(), 0.0, 0.0)

    def settled_at(self, force, noise, noise_before):
        """The state under a constant force [N]; the standard normal numbers are the noise of the last two samples."""
        computing, output = (self.converter.convert(force + self.noise * n) for n in (noise, noise_before))
        return ForceSensorState(self.analog.start_at(force), computing, output)

    def samples_at(self, k):
        """True if step k is a sampling instant: the first step at or after a tick of the sampling clock."""
        return (k * self.sampling - self.shift) % self.rate < self.sampling

    def sample(self, state, force, k, noise):
        """Output held during physics step k [N], and the state.

        Args:
            state: from the step before.
            force: on the sensor at step k [N].
            k: number of the step since the start.
            noise: a standard normal number; used at sampling instants only.
        """
        filtered, analog = self.analog.step(state.analog, force)
        if self.samples_at(k):
            fresh = self.converter.convert(filtered + self.noise * noise)
            return state.computing, ForceSensorState(analog, fresh, state.computing)
        return state.held, ForceSensorState(analog, state.computing, state.held)

    @property
    def delay(self):
        """Seconds from the sampling of a force to its first being read from the output, in the mean.

        One cycle of computing. The output of physics step k is read from step k + 1 on, and a sample is taken at
        the first step at or after the clock's tick, late by a part of a step that recurs.
        """
        common = math.gcd(self.rate, self.sampling)
        late = (-self.shift % common + 0.5 * (self.sampling - common)) / self.sampling
        return 1.0 / self.sampling + (1.0 - late) / self.rate

    @property
    def lag(self):
        """Seconds: the filter's, the delay of a sample, and half a cycle of holding."""
        return self.analog.lag + self.delay + 0.5 / self.sampling

    @property
    def filter(self):
        """The analog low-pass by name and corner [Hz], "butterworth3:120"; "unknown" if it is another."""
        first = self.analog.first
        cutoff = math.atan(first.b0 / (1.0 - first.b0)) * self.rate / math.pi
        if not 0.0 < cutoff < 0.5 * self.rate:
            return "unknown"
        named = butterworth3(cutoff, self.rate)
        same = np.allclose([*named.first, *named.second], [*first, *self.analog.second], rtol=1e-6, atol=0.0)
        return f"butterworth3:{cutoff:.9g}" if same else "unknown"


def force_sensor(
    cutoff: float = 120.0,
    sampling: int = 480,
    bits: int = 12,
    full_scale: float = 200.0,
    noise: float = 0.6,
    rate: int = 20000,
    phase: float = 0.0,
) -> ForceSensor:
    """The thesis' sensor (sec. 3.4): 3rd-order 120 Hz, 480 Hz, 12 bits; frequencies [Hz], forces [N].

    `phase` [s] is when its clock ticks first, less than a period of its sampling.
    """
    require(0.0 <= phase * sampling < 1.0, "phase", f"at least 0 and below {1.0 / sampling:g} s", phase)
    shift = round(phase * sampling * rate) % rate
    return ForceSensor(butterworth3(cutoff, rate), Converter(bits, full_scale), noise, sampling, rate, shift)


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
