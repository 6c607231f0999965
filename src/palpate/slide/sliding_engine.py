"""Engine of a slide of a serial arm: MuJoCo or palpate's own laws move its joints; the tip slides with friction.

Drives, contact and sensor are palpate's laws, those of a press and of `tip_laws`: MuJoCo's own contact, as soft as this
one, creeps below the limit of friction.
"""

from typing import NamedTuple

import numpy as np

from palpate._jit import BoundKernel, kernel, law, part
from palpate._vector import ZERO3, Mat3, Vec3
from palpate.arrays import Array
from palpate.force.arm import Arm
from palpate.force.simulated_press import world_of
from palpate.press.cell import Body, Reading, TouchState, Workcell, apply_drive, read_sensor
from palpate.press.engines import ByMuJoCo
from palpate.robots.serial.chain import Tip, axis_of, chain_motion
from palpate.robots.serial.linear import Wrench, backward, cross, factorise, forward
from palpate.robots.serial.serial_arm import SerialArm
from palpate.signals.types import triple
from palpate.slide.ground import Ground
from palpate.slide.tip_laws import ContactState, contact


@part
class SensedContact(NamedTuple):
    """State of the contact and of the sensor's three axes, in the surface's axes."""

    tip: ContactState
    x: Reading
    y: Reading
    z: Reading
    mean: float  # of the normal force over the tick [N]


@part
class Frame(NamedTuple):
    """The surface's axes in the base.

    Args:
        axes: in rows; the third out of the surface.
        origin: first point of the surface [m].
    """

    axes: Mat3
    origin: Vec3


@law
def arm_tick(cell, world, ground, frame, body, before, back, setpoint, k, noise):
    """The k-th tick of an arm that palpate's own laws move: semi-implicit Euler, as of a press."""
    n, room = len(body.q), body.room
    for j in range(cell.steps):
        tip = chain_motion(cell.chain, body.q, body.qd, room)
        arm = -back * Vec3(tip.R.r1.z, tip.R.r2.z, tip.R.r3.z)
        centre = Tip(tip.p + arm, tip.R, tip.v + cross(tip.w, arm), tip.w, tip.a, tip.dw)
        time = (k * cell.steps + j + 1) * cell.step
        before = step_contact(cell, world, ground, frame, body, before, centre, setpoint, time, noise)
        force = frame.axes.T @ before.tip.force
        push = Wrench(cross(centre.p, force), force)
        factorise(room.M, body.L)
        for i in range(n):
            body.qdd[i] = body.drive[i] - room.h[i] - push.power(axis_of(room, i))
        forward(body.L, body.qdd)
        backward(body.L, body.qdd)
        for i in range(n):
            body.qd[i] += cell.step * body.qdd[i]
            body.q[i] += cell.step * body.qd[i]
    return before


# More than seven arguments: the cell with its surface, and the state.
@law
def step_contact(cell, world, ground, frame, body, before, tip, setpoint, time, noise):
    """Drives, contact and sensor after a step; fills the body's drive. `noise` has shape (3, 8)."""
    apply_drive(cell, body, setpoint)
    x, v = frame.axes @ (tip.p - frame.origin), frame.axes @ tip.v
    after = contact(world, ground, before.tip, x, v, cell.step)
    f, sensor = after.force, cell.sensor
    return SensedContact(
        after, read_sensor(sensor, before.x, f.x, time, noise[0]), read_sensor(sensor, before.y, f.y, time, noise[1]),
        read_sensor(sensor, before.z, f.z, time, noise[2]), before.mean + after.normal / cell.steps,
    )  # fmt: skip


compiled_step = kernel(step_contact)
compiled_tick = kernel(arm_tick)
UPRIGHT = Mat3(*map(triple, np.eye(3)))
FREE_MOTION = ContactState(ZERO3, ZERO3, ZERO3, 0.0, 0.0, ZERO3, 0.0, 0.0)


class SlidingEngine(ByMuJoCo):
    """MuJoCo or palpate's own laws move the arm; its tip touches a ground, and the sensor shows three axes.

    Args:
        arm, cell, q: as for `ByMuJoCo`.
        ground: the surface.
        inner: the arm's inner loop.
        frame: of the surface.
        seed: of the noise.
        physics: own or mujoco.
        back: from the tool's point back to what touches, along the tool's axis [m].
    """

    # More than seven arguments: arm and surface.
    def __init__(
        self, arm: SerialArm, cell: Workcell, q: Array, ground: Ground, inner: Arm, frame: Frame, seed: int,
        physics: str = "mujoco", back: float = 0.0,
    ):  # fmt: skip
        self._own, self._back = BoundKernel(compiled_tick) if physics == "own" else None, back
        if self._own is None:
            super().__init__(arm, cell, q)
        none = Reading(ZERO3, 0.0, 0.0, 0.0)
        self.slid, self._law = SensedContact(FREE_MOTION, none, none, none, 0.0), BoundKernel(compiled_step)
        # the links' place is known here, and no spring lies between it and the surface
        world = world_of(inner, noise=0.0)._replace(torque=1.0)
        self.ground, self._world, self._frame = ground, world, frame
        self._axes, self._noise = np.array(frame.axes), np.zeros((3, 8))
        self._generator = np.random.default_rng(seed)

    def tick(
        self, cell: Workcell, body: Body, touch: TouchState, setpoint: Array, k: int, noise: Array
    ) -> TouchState:
        """One tick, as `Engine` describes it; noise is drawn for three axes here."""
        self.slid = self.slid._replace(mean=0.0)
        self._noise = self._generator.standard_normal((3, 8))
        if self._own is not None:
            self.slid = self._own(
                cell,
                self._world,
                self.ground,
                self._frame,
                body,
                self.slid,
                self._back,
                setpoint,
                k,
                self._noise,
            )
            return touch
        return super().tick(cell, body, touch, setpoint, k, noise)

    @property
    def reading(self) -> Array:
        """Last reading in the surface's axes [N], shape (3,)."""
        return np.array([axis.value for axis in (self.slid.x, self.slid.y, self.slid.z)])

    def _contact(
        self,
        cell: Workcell,
        body: Body,
        touch: TouchState,
        tip: Tip,
        setpoint: Array,
        time: float,
        noise: Array,
    ) -> TouchState:
        self.slid = self._law(
            cell, self._world, self.ground, self._frame, body, self.slid, tip, setpoint, time, self._noise
        )
        return touch

    def _fill(self, body: Body) -> Tip:
        """Joints, Jacobian, and of the tip the place and the velocity: the contact takes no more of MuJoCo."""
        data = self._data
        J = self._J[:3]
        dofs = self._dofs
        body.q[:], body.qd[:] = data.qpos[self._positions], data.qvel[dofs]
        at, axes = self._scene.tip(data)
        at = at - self._back * axes[:, 2]
        self._engine.mj_jac(self._model, data, J, None, at, self._scene.body)
        v = J @ data.qvel
        return Tip(triple(at), UPRIGHT, triple(v), ZERO3, ZERO3, ZERO3)

    def _load(self, body: Body, touch: TouchState) -> Array:
        return np.asarray((self._axes @ self._J[:3, self._dofs]).T @ np.array(self.slid.tip.force))
