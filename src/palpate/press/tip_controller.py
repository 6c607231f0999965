"""Controllers of the tip of a simulated arm of torques, in six directions: its own spring, and those of the thesis."""

from typing import Any, NamedTuple, Protocol

import numpy as np

from palpate._jit import BoundKernel, kernel, law, part
from palpate._vector import ZERO3, Mat3, Vec3, Vec6
from palpate.arrays import Array
from palpate.bench.summary import APPROACH, CONTACT, LOST
from palpate.controllers import Hybrid, Impedance, ProportionalIntegral, ResolvedAcceleration
from palpate.controllers.controller import controller
from palpate.controllers.proportional_integral import integral_gain
from palpate.errors import unknown
from palpate.force.arm import Arm, TorqueLoop
from palpate.press.sequence import Action, TipSample
from palpate.press.setting import Place
from palpate.robots.serial.serial_arm import ArmState, SerialArm, arm_state_for, compiled_description, tip_of
from palpate.robots.serial.task import TaskRoom, into, joint_torque, task_model
from palpate.signals.types import Sense, Task, alike, triple

SPARE_DAMPING = 5.0
"""Damping of the redundant joints [1/s]."""
CONTROLLERS = ("hybrid", "proportional-integral", "impedance")
POSITION_GAIN, RATE_GAIN = 400.0, 40.0
"""K_pp [1/s^2] and K_pv [1/s] of the directions that hold their place: 3 Hz, critically damped."""
FORCE_BANDWIDTH = 0.25
"""Bandwidth of the proportional-integral controller [Hz]: a fifth of B/m for B = 50 N s/m and a tip of 6 kg."""
IMPEDANCE_STIFFNESS = 2000.0
"""Stiffness of the impedance [N/m]."""


@controller
class Spring(NamedTuple):
    """F = K (x_d - x) - D xdot + h: a position with a spring in series, which the cautious law moves.

    Args:
        stiffness: K [N/m, N m/rad].
        damping: D [N s/m, N m s/rad].
    """

    stiffness: Vec6
    damping: Vec6

    def start(self):
        return 0.0

    def step(self, state, sense, task, model):
        return self.stiffness * (task.x - sense.x) - self.damping * sense.xd + model.h, state


@law
def half_turn(R):
    """Sine of the rotation's angle times its axis: the rotation vector for the small turns of a held tip [rad]."""
    return 0.5 * Vec3(R.r3.y - R.r2.z, R.r1.z - R.r3.x, R.r2.x - R.r1.y)


@part
class TaskFrame(NamedTuple):
    """Axes in which a tip works.

    Args:
        axes: of the task, in rows; the first is the surface's normal.
        held: axes of the tip when it stands as it should, in columns.
        damping: of joints to spare [1/s].
    """

    axes: Mat3
    held: Mat3
    damping: float


@part
class ArmReadings(NamedTuple):
    """Encoders and force sensor of an arm at one tick.

    Args:
        q: joint positions [rad, m], shape (n,).
        qd: their rates, shape (n,).
        force: along the normal [N].
        found: model of the arm at q and qd, filled by `describe_arm`.
    """

    q: Array
    qd: Array
    force: float
    found: ArmState


@law
def tip_torque(frame, control, state, task, readings, own, torque):
    """Fill the joints' torques from encoders and force reading; return the controller's state.

    Args:
        frame: a `TaskFrame`.
        control: in six directions.
        state: its own.
        task: desired pose and force, in the task's axes.
        readings: `ArmReadings`.
        own: room for the laws.
        torque: where it goes, shape (n,).
    """
    axes, room, tip = frame.axes, readings.found.room, tip_of(readings.found, readings.qd)
    model = task_model(axes, room, tip, own)
    x = into(axes, tip.p, half_turn(tip.R @ frame.held.T))
    wrench = Vec6(Vec3(readings.force, 0.0, 0.0), Vec3(0.0, 0.0, 0.0))
    sense = Sense(readings.q, readings.qd, x, into(axes, tip.v, tip.w), wrench)  # type: ignore[arg-type]
    F, state = control.step(state, sense, task, model)
    joint_torque(axes, room, model, own, F, frame.damping, readings.qd, torque)
    return state


compiled_tip_torque = kernel(tip_torque)


def task_room_for(n: int) -> TaskRoom:
    """Room for an arm of n joints."""
    return TaskRoom(np.zeros((n, n)), np.zeros((7, n)), np.zeros((6, 6)), np.zeros((6, 6)), np.zeros(6))


class TipController:
    """Controller of the tip that an arm of torques runs at each tick."""

    def __init__(self, arm: SerialArm, loop: Arm, place: Place):
        inner = loop.inner
        assert isinstance(inner, TorqueLoop)
        J, M = arm.jacobian(place.q), arm.mass_matrix(place.q)
        mobility = J @ np.linalg.solve(M, J.T)
        turning = float(1.0 / np.linalg.eigvalsh(mobility[3:, 3:])[-1]) / inner.mass
        spring, damper = float(inner.stiffness), float(inner.damping)
        self.spring = Spring(
            Vec6(alike(spring), alike(spring * turning)), Vec6(alike(damper), alike(damper * turning))
        )
        self._chain, self._axes = arm.chain, place.axes
        axes, held = (Mat3(*map(triple, m)) for m in (place.axes, place.pose[:3, :3]))
        self._frame = TaskFrame(axes, held, SPARE_DAMPING)
        n = arm.joints
        self._found, self._room = arm_state_for(n), task_room_for(n)
        self._states: dict[type, Any] = {}
        self._laws: dict[type, BoundKernel] = {}
        self._n = n

    def towards(self, goal: Array) -> Task:
        """Task that holds a pose."""
        self._frame = self._frame._replace(held=Mat3(*map(triple, goal[:3, :3])))
        x: Any = Vec6(triple(self._axes @ goal[:3, 3]), ZERO3)
        zero = 0.0 * x
        return Task(x, zero, zero, zero, zero)

    def torque(self, controller: Any, task: Task, q: Array, qd: Array, force: float) -> Array:
        """Torque of the joints [N m], shape (n,)."""
        kind = type(controller)
        if kind not in self._states:
            self._states[kind], self._laws[kind] = controller.start(), BoundKernel(compiled_tip_torque)
        state, torque = self._states[kind], np.zeros(self._n)
        compiled_description(self._chain, q, qd, self._found)
        readings = ArmReadings(q, qd, float(force), self._found)
        self._states[kind] = self._laws[kind](
            self._frame, controller, state, task, readings, self._room, torque
        )
        return torque


class TorqueArm(Protocol):
    """An arm that takes a controller of torques."""

    loop: Arm

    def act(self, controller: Any, task: Task) -> None:
        """Move for a tick under a controller, in the task's axes."""
        ...


class TorqueDriver:
    """Driver with a controller of `palpate.controllers` in six directions: it approaches, and then presses.

    Args:
        arm: of torques.
        place: where it starts.
        controller: by name.
        speed: of the approach [m/s].
        switch: reading above which the controller takes over, eight deviations of the noise [N].
        force: that the impedance's target is placed for [N].
    """

    def __init__(
        self, arm: TorqueArm, place: Place, controller: str, speed: float, switch: float, force: float
    ):
        self._arm, self._normal, self._speed, self._switch = arm, place.normal, speed, switch
        at = place.axes @ place.pose[:3, 3]
        self._at, self._gone, self._phase = triple(at), 0.0, APPROACH
        self._approach = ResolvedAcceleration(_six(POSITION_GAIN), _six(RATE_GAIN))
        self._controller = self._make(controller, place.place, force)

    def _make(self, name: str, surface: float, force: float) -> Any:
        tick = self._arm.loop.tick
        held, rate, none = _six(POSITION_GAIN), _six(RATE_GAIN), _six(0.0)
        if name == "hybrid":
            return Hybrid(held, rate, _six(1.0), _six(0.003))
        if name == "proportional-integral":
            return ProportionalIntegral(held, rate, none, _six(integral_gain(FORCE_BANDWIDTH)), tick)
        if name == "impedance":
            inner: Any = self._arm.loop.inner  # of torques, so that it has a mass
            damping = 1.4 * float(np.sqrt(IMPEDANCE_STIFFNESS * inner.mass))
            target: Any = Vec6(Vec3(surface + force / IMPEDANCE_STIFFNESS, self._at.y, self._at.z), ZERO3)
            return Impedance(_six(inner.mass), _six(damping), _six(IMPEDANCE_STIFFNESS), target)
        raise unknown("controller", name, CONTROLLERS)

    def step(self, sample: TipSample, desired: float, since: float) -> Action:
        """One tick, as `PressDriver` describes it."""
        force = float(sample.force @ self._normal)
        if self._phase == CONTACT and force <= 0.0:
            self._phase = LOST
            self._at = self._at._replace(x=float(self._normal @ sample.position))
            self._gone = 0.0
        elif force > self._switch:
            self._phase = CONTACT
        nothing = _six(0.0)
        if self._phase == CONTACT:
            at: Any = Vec6(self._at, ZERO3)
            s: Any = Vec6(Vec3(1.0, 0.0, 0.0), ZERO3)
            self._arm.act(self._controller, Task(at, nothing, nothing, desired * s, s))
            return Action(CONTACT, 0.0, 0.0 * self._normal, 0.0)
        self._gone += self._arm.loop.tick * self._speed
        x: Any = Vec6(self._at + Vec3(self._gone, 0.0, 0.0), ZERO3)
        xd: Any = Vec6(Vec3(self._speed, 0.0, 0.0), ZERO3)
        self._arm.act(self._approach, Task(x, xd, nothing, nothing, nothing))
        return Action(self._phase, self._speed, self._speed * self._normal, 0.0)


def _six(value: float) -> Any:
    """One number in six directions; the annotations of tasks and controllers are for three."""
    return Vec6(alike(value), alike(value))
