"""The force's whole way into the controller, and the other signals of the thesis' listing (App. E).

Sensor, optional analog filter and converter follow from the numbers of a sensor; encoder angles and sampled force are
filtered and differentiated.
"""

from typing import NamedTuple

from palpate._jit import part
from palpate._vector import ZERO3, Vec3
from palpate.bench.tables import ForceSensor as ForceSensorTable
from palpate.instruments import Converter, ForceSensor, ForceSensorState, analog_filter_190, force_sensor
from palpate.robots.arm3 import Arm3
from palpate.signals.filters import Biquad, BiquadState
from palpate.signals.types import Sense


@part
class ConditionedSignals(NamedTuple):
    """Conditioned sensor signals of a tick, for controllers and estimators."""

    sense: Sense  # what controllers see
    velocity: float  # of x, first difference, unfiltered [m/s]
    acceleration: float  # of x, second difference, unfiltered [m/s^2]
    smooth_acceleration: float  # the same, filtered [m/s^2]
    force: float  # as sampled [N]; the filtered one is in `sense`


@part
class ConditioningState(NamedTuple):
    q: Vec3  # angles of the tick before
    x: Vec3  # pose of the tick before
    velocity: float
    angle: BiquadState  # joint 3
    rate: BiquadState  # joint 3
    twist: BiquadState  # Cartesian velocity, on Vec3
    acceleration: BiquadState
    force: BiquadState


@part
class Conditioning(NamedTuple):
    """Kinematics, differences and filters, once a tick.

    Args:
        arm: the controller's model of the arm.
        motion: filter of the Cartesian velocity and acceleration, and of joint 3's angle and rate (35 Hz).
        force: filter of the force (120 Hz).
        tick: time between ticks [s].
    """

    arm: Arm3
    motion: Biquad
    force: Biquad
    tick: float

    def start_at(self, q):
        """As after a long rest at the joint angles q, without force."""
        return ConditioningState(
            q,
            self.arm.pose(q),
            0.0,
            self.motion.start_at(q.z),
            self.motion.start_at(0.0),
            self.motion.start_at(ZERO3),
            self.motion.start_at(0.0),
            self.force.start_at(0.0),
        )

    def step(self, state, q, force):
        """The tick's `Signals` from the encoders' angles and the sampled force."""
        q3, angle = self.motion.step(state.angle, q.z)
        qd = (q - state.q) / self.tick
        qd3, rate = self.motion.step(state.rate, qd.z)
        x = self.arm.pose(Vec3(q.x, q.y, q3))
        xd = (x - state.x) / self.tick
        smooth_xd, twist = self.motion.step(state.twist, xd)
        a = (xd.x - state.velocity) / self.tick
        smooth_a, acceleration = self.motion.step(state.acceleration, a)
        smooth_force, force_state = self.force.step(state.force, force)
        sense = Sense(Vec3(q.x, q.y, q3), Vec3(qd.x, qd.y, qd3), x, smooth_xd, Vec3(smooth_force, 0.0, 0.0))
        signals = ConditionedSignals(sense, xd.x, a, smooth_a, force)
        return signals, ConditioningState(q, x, xd.x, angle, rate, twist, acceleration, force_state)


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

    def reading(self, state):
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
        """Lag of the force's whole way [s]."""
        return self.sensor.lag + self.filtered * self.analog.lag + self.converter.lag


def force_input(of: ForceSensorTable, physics: int, full_scale: float = 200.0) -> ForceInput:
    """The way into the controller of a force sensor's numbers.

    Args:
        of: the numbers, as an experiment has them.
        physics: steps of the physics a second [Hz].
        full_scale: of the controller's own converter [N].
    """
    sensor = force_sensor(of.cutoff, of.sampling, of.bits, of.full_scale, of.noise, physics, of.phase)
    filtered = 1.0 if of.analog_filter else 0.0
    analog = analog_filter_190(float(physics))
    return ForceInput(sensor, analog, filtered, Converter(16, full_scale), float(of.roughness))
