"""The force's whole way into the controller, and the other signals of the thesis' listing (App. E).

Sensor, optional analog filter and converter follow from the numbers of a sensor; encoder angles and sampled force are
filtered and differentiated.

A run looks for the surface, presses on it, finds that it is lost (thesis, ch. 4). One tick is one row, every column a
number with a unit.
"""

from typing import NamedTuple

import numpy as np

from palpate._jit import law, part
from palpate._vector import ZERO3, Vec3
from palpate.arrays import Array
from palpate.bench.summary import APPROACH, CONTACT, DIVERGED, LOST, LOST_CONTACT, Ending
from palpate.bench.tables import ForceSensorTable
from palpate.instruments import Converter, ForceSensor, ForceSensorState, analog_filter_190, force_sensor
from palpate.references import Approach
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
        """State after a long rest at the joint angles q, without force."""
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


@part
class SequenceState(NamedTuple):
    phase: float  # APPROACH, CONTACT or LOST
    ticks: float  # of this phase so far
    since: float  # how long that is [s]: ticks times the tick, not a running sum
    x_d: float  # desired x of the approach [m]
    x0: float  # x where the force first reached the switch: displacement counts from here [m]
    contacts: float  # how often contact was made


@part
class Sequence(NamedTuple):
    """Switches between position control and force control by the measured force.

    Args:
        approach: desired x until the force is felt.
        switch: measured force at which the contact controller takes over [N].
        release: measured force under which the contact is taken to be lost [N].
        wait: time that the arm holds after a loss before it approaches anew [s].
        tick: time between ticks [s].
    """

    approach: Approach
    switch: float
    release: float
    wait: float
    tick: float

    def start(self):
        return SequenceState(APPROACH, 0.0, 0.0, self.approach.start, self.approach.start, 0.0)

    def step(self, state, x, force):
        """The state at this tick, from the measured x [m] and the measured force [N]."""
        phase, ticks, _, x_d, x0, contacts = state
        ticks += 1.0
        since = ticks * self.tick
        if phase == CONTACT:
            if force < self.release:
                return SequenceState(LOST, 0.0, 0.0, x_d, x0, contacts)
            return SequenceState(CONTACT, ticks, since, x_d, x0, contacts)
        if force >= self.switch:
            return SequenceState(CONTACT, 0.0, 0.0, x_d, x, contacts + 1.0)
        if phase == LOST:
            if since < self.wait:
                return SequenceState(LOST, ticks, since, x_d, x0, contacts)
            ticks, since = self.approach.hold / self.tick, self.approach.hold  # the hold is not repeated
        return SequenceState(APPROACH, ticks, since, self.approach.position(since), x0, contacts)


#: Name and unit of every column, in the order of `tick.write`.
COLUMNS = {
    "t": "s",
    "phase": "1",  # 0 approach, 1 contact, 2 lost contact
    **{f"q{i}": "rad" for i in (1, 2, 3)},  # true joint angles
    **{f"qd{i}": "rad/s" for i in (1, 2, 3)},
    "x": "m",  # true pose of the tip
    "y": "m",
    "phi": "rad",
    "x_measured": "m",  # as the controller computes it from the encoders
    "y_measured": "m",
    "phi_measured": "rad",
    "vx_measured": "m/s",  # filtered
    "vy_measured": "m/s",
    "vphi_measured": "rad/s",
    "vx_raw": "m/s",  # first difference
    "ax_raw": "m/s^2",  # second difference
    "ax_measured": "m/s^2",  # filtered
    "x_desired": "m",
    "y_desired": "m",
    "phi_desired": "rad",
    "force": "N",  # true normal force during the step before, positive when pressed
    "force_side": "N",  # true force along y
    "force_sampled": "N",
    "force_measured": "N",  # filtered: what the controller sees
    "force_desired": "N",
    **{f"torque{i}": "N m" for i in (1, 2, 3)},  # as applied
    **{f"saturated{i}": "1" for i in (1, 2, 3)},  # 1 where the limit held the torque back
    **{f"friction{i}": "N m" for i in (1, 2, 3)},
    "penetration": "m",  # true
    "touching": "1",  # true
    "displacement": "m",  # measured x from where the contact controller took over
    **{
        f"{name}_{front}": unit
        for front in ("thesis", "raw", "matched")
        for name, unit in (("M", "kg"), ("B", "N s/m"), ("K", "N/m"))
    },
    "M_matched_std": "kg",
    "B_matched_std": "N s/m",
    "K_matched_std": "N/m",
    "memory_fx": "N",  # the force command that the controller has gathered or learned
    "memory_fy": "N",
    "memory_moment": "N m",
    # What an adaptive controller reports of itself; zero for others.
    **{f"adapted{i}": "1" for i in (1, 2, 3)},
}


@law
def put(out, at, vector):
    """Writes a vector's three components into out from column `at` on; the next free column."""
    out[at], out[at + 1], out[at + 2] = vector.x, vector.y, vector.z
    return at + 3


class StopCondition:
    """Looks through the rows as they come and says when the run should end.

    Args:
        losses: how many losses of contact are enough; 0 for never.
    """

    def __init__(self, losses: int):
        self._losses = losses
        self._lost = 0
        self._phase = 0.0

    def judge(self, out: Array, trouble: str) -> tuple[int, Ending | None]:
        """Count the rows to keep, and find the ending if there is one.

        Args:
            out: rows in the order of `COLUMNS`.
            trouble: what the controller says is wrong with itself after them; "" if nothing is.
        """
        finite = np.isfinite(out).all(axis=1)
        if not finite.all():
            row = int(np.argmin(finite))
            name = list(COLUMNS)[int(np.argmin(np.isfinite(out[row])))]
            return row, Ending(DIVERGED, f"{name} is not a finite number from {_time(out, row)} on")
        phases = np.concatenate([[self._phase], out[:, 1]])
        self._phase = phases[-1]
        lost = np.flatnonzero((phases[1:] == LOST) & (phases[:-1] == CONTACT))
        if self._losses and self._lost + len(lost) >= self._losses:
            row = int(lost[self._losses - self._lost - 1])
            return row + 1, Ending(
                LOST_CONTACT, f"contact was lost for the {_ordinal(self._losses)} time at {_time(out, row)}"
            )
        self._lost += len(lost)
        if self._losses and trouble:
            return len(out), Ending(DIVERGED, f"{trouble}, found at {_time(out, len(out) - 1)}")
        return len(out), None


def _time(out: Array, row: int) -> str:
    return f"{out[max(row, 0), 0]:.3f} s"


def _ordinal(n: int) -> str:
    return {1: "first", 2: "second", 3: "third"}.get(n, f"{n}th")
