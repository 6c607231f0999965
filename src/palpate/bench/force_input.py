"""The force's whole way into the controller: sensor, optional analog filter, converter."""

from typing import NamedTuple

from palpate._jit import part
from palpate.instruments import Converter, ForceSensor, ForceSensorState
from palpate.signals.filters import Biquad, BiquadState


@part
class ForceInputState(NamedTuple):
    sensor: ForceSensorState
    analog: BiquadState
    line: float  # on the converter's input [N]


@part
class ForceInput(NamedTuple):
    """Stepped with the physics, read at each tick.

    Args:
        sensor: the force sensor.
        analog: low-pass on the line from the sensor to the converter.
        filtered: 1.0 if the line goes through it (as for fig. 3.5), 0.0 if not (as in all other experiments).
        converter: the controller's.
        roughness: by which share the sensor's noise grows for each m/s of the tip [s/m].
    """

    sensor: ForceSensor
    analog: Biquad
    filtered: float
    converter: Converter
    roughness: float = 0.0

    def start(self):
        return ForceInputState(self.sensor.start(), self.analog.start(), 0.0)

    def settled_at(self, force, noise, noise_before):
        """The state after this force [N] for ever; the noise as the sensor's."""
        sensor = self.sensor.settled_at(force, noise, noise_before)
        return ForceInputState(sensor, self.analog.start_at(sensor.held), sensor.held)

    def advance(self, state, force, k, noise):
        """The state after physics step k under this force [N]; `noise` as the sensor's."""
        line, sensor = self.sensor.sample(state.sensor, force, k, noise)
        smooth, analog = self.analog.step(state.analog, line)
        return ForceInputState(sensor, analog, smooth if self.filtered == 1.0 else line)

    def sampled(self, state):
        """Present reading of the converter [N]."""
        return self.converter.convert(state.line)

    def description(self):
        """Properties of the sampled force for an identifier: its low-pass, its sampling [Hz], its delay [s].

        The delay is that of a reading that is fresh, beside the low-pass: from its sampling to the line. The
        analog filter of the line, where it is in use, is no part of what the sensor samples: no name is right.
        """
        return {
            "filter": "unknown" if self.filtered == 1.0 else self.sensor.filter,
            "sampling_Hz": float(self.sensor.sampling),
            "delay_s": self.sensor.delay + self.converter.lag,
        }

    @property
    def lag(self):
        """Seconds."""
        return self.sensor.lag + self.filtered * self.analog.lag + self.converter.lag
