"""A force sensor with its own processor: filter, sample, compute, hold."""

from typing import NamedTuple

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
    """

    analog: Cascade
    converter: Converter
    noise: float
    sampling: int
    rate: int

    def start(self):
        return ForceSensorState(self.analog.start(), 0.0, 0.0)

    def samples_at(self, k):
        """Whether step k is a sampling instant: the first step at or after a multiple of 1/sampling."""
        return (k * self.sampling) % self.rate < self.sampling

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
    def lag(self):
        """Seconds: the filter's, one cycle of computing, and half a cycle of holding."""
        return self.analog.lag + 1.5 / self.sampling


def force_sensor(
    cutoff: float = 120.0,
    sampling: int = 480,
    bits: int = 12,
    full_scale: float = 200.0,
    noise: float = 0.6,
    rate: int = 20000,
) -> ForceSensor:
    """The thesis' sensor (sec. 3.4): 3rd-order 120 Hz, 480 Hz, 12 bits; frequencies [Hz], forces [N]."""
    return ForceSensor(butterworth3(cutoff, rate), Converter(bits, full_scale), noise, sampling, rate)
