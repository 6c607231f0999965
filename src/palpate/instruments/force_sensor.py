"""A force sensor with its own processor: filter, sample, compute, hold."""

import math
from typing import NamedTuple

import numpy as np

from palpate._jit import part
from palpate.instruments.converter import Converter
from palpate.signals.filters import Cascade, CascadeState, butterworth3
from palpate.signals.parameters import coerced, require


class ForceSensorState(NamedTuple):
    """Where the force is on its way."""

    analog: CascadeState
    computing: float  # sampled last, put out at the next sample [N]
    held: float  # on the output now [N]


def _check(self):
    require(0 < self.sampling <= self.rate, "sampling", f"between 1 and {self.rate} Hz", self.sampling)
    require(self.noise >= 0, "noise", "at least 0 N", self.noise)
    require(0 <= self.shift < self.rate, "shift", f"at least 0 and below {self.rate}", self.shift)


@part
@coerced(_check)
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
        """The state after this force [N] for ever; the standard normal numbers are the last two samples' own."""
        computing, held = (self.converter.convert(force + self.noise * n) for n in (noise, noise_before))
        return ForceSensorState(self.analog.start_at(force), computing, held)

    def samples_at(self, k):
        """Whether step k is a sampling instant: the first step at or after a tick of the sampling clock."""
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
