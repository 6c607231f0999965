"""Signals of the thesis' listing (App. E) from encoder angles and sampled force."""

from typing import NamedTuple

from palpate._jit import part
from palpate._vector import ZERO3, Vec3
from palpate.robots.arm3 import Arm3
from palpate.signals.filters import Biquad, BiquadState
from palpate.signals.types import Sense


@part
class Signals(NamedTuple):
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
        signals = Signals(sense, xd.x, a, smooth_a, force)
        return signals, ConditioningState(q, x, xd.x, angle, rate, twist, acceleration, force_state)
