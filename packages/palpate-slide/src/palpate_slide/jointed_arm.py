"""A slide of a serial arm: MuJoCo or palpate's own laws move the joints, the tip slides along a surface with friction.

Drives, contact and sensor are palpate's laws, those of a press and of `world.py`: MuJoCo's own contact, as soft
as this, creeps below the limit of friction. Beside the simulation of a point with the same lags in each axis, this
one has the joints' inertia, their drive trains, a tip that tilts, resolved rates, and a tool that may turn.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from palpate._jit import BoundKernel, kernel, law, part
from palpate._vector import ZERO3, Mat3, Vec3
from palpate.arrays import Array
from palpate.environments.kelvin_voigt import KelvinVoigt
from palpate.errors import InputError
from palpate.force.arm import Arm
from palpate.force.gains import Gains
from palpate.force.simulated_press import world_of
from palpate.force.sliding.slide_state import VELOCITY, vector_at
from palpate.force.sliding.sliding_loop import DOWN, SlidingLoop
from palpate.force.sliding.turning_tool import TurningTool
from palpate.press.cell import Body, Reading, TouchState, Workcell, apply_drive, read_sensor
from palpate.press.engines import ByMuJoCo, check_mode, loop_of, usual_mode
from palpate.press.sequence import PressSequence, SlidingDriver, TipSample
from palpate.press.setting import Place, cell_of, place_of
from palpate.press.simulated_arm import SimulatedArm
from palpate.robots.serial.chain import Tip, axis_of, chain_motion
from palpate.robots.serial.from_toml import names
from palpate.robots.serial.linear import Wrench, backward, cross, factorise, forward
from palpate.robots.serial.serial_arm import SerialArm
from palpate.signals.types import triple
from palpate_slide.ground import Ground, outside
from palpate_slide.world import COLUMNS, LONGEST, Carried, contact, note


@part
class Slid(NamedTuple):
    """State of the contact and of the sensor's three axes, in the surface's axes."""

    tip: Carried
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
def slid_tick(cell, world, ground, frame, body, before, back, setpoint, k, noise):
    """The k-th tick of an arm that palpate's own laws move: semi-implicit Euler, as of a press."""
    n, room = len(body.q), body.room
    for j in range(cell.steps):
        tip = chain_motion(cell.chain, body.q, body.qd, room)
        arm = -back * Vec3(tip.R.r1.z, tip.R.r2.z, tip.R.r3.z)
        centre = Tip(tip.p + arm, tip.R, tip.v + cross(tip.w, arm), tip.w, tip.a, tip.dw)
        time = (k * cell.steps + j + 1) * cell.step
        before = slid(cell, world, ground, frame, body, before, centre, setpoint, time, noise)
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
def slid(cell, world, ground, frame, body, before, tip, setpoint, time, noise):
    """Drives, contact and sensor after a step; fills the body's drive. `noise` has shape (3, 8)."""
    apply_drive(cell, body, setpoint)
    x, v = frame.axes @ (tip.p - frame.origin), frame.axes @ tip.v
    after = contact(world, ground, before.tip, x, v, cell.step)
    f, sensor = after.force, cell.sensor
    return Slid(
        after, read_sensor(sensor, before.x, f.x, time, noise[0]), read_sensor(sensor, before.y, f.y, time, noise[1]),
        read_sensor(sensor, before.z, f.z, time, noise[2]), before.mean + after.normal / cell.steps,
    )  # fmt: skip


compiled_slid, compiled_tick, compiled_note = kernel(slid), kernel(slid_tick), kernel(note)
_UPRIGHT = Mat3(*map(triple, np.eye(3)))
_NOTHING = Carried(ZERO3, ZERO3, ZERO3, 0.0, 0.0, ZERO3, 0.0, 0.0)


class OnGround(ByMuJoCo):
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
        self.slid, self._law = Slid(_NOTHING, none, none, none, 0.0), BoundKernel(compiled_slid)
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
        data, J, dofs = self._data, self._J[:3], self._dofs
        body.q[:], body.qd[:] = data.qpos[self._positions], data.qvel[dofs]
        at, axes = self._scene.tip(data)
        at = at - self._back * axes[:, 2]
        self._engine.mj_jac(self._model, data, J, None, at, self._scene.body)
        v = J @ data.qvel
        return Tip(triple(at), _UPRIGHT, triple(v), ZERO3, ZERO3, ZERO3)

    def _load(self, body: Body, touch: TouchState) -> Array:
        return np.asarray((self._axes @ self._J[:3, self._dofs]).T @ np.array(self.slid.tip.force))


class HeldTip(NamedTuple):
    """A tool that is kept perpendicular, with a spherical tip and the weight of a payload.

    The surface is that of the sphere's centre, parallel to the touched one.

    Args:
        back: from the tool's point back to that centre, along the tool's axis [m].
        weight: reading of the payload alone, in the base's axes [N].
    """

    back: float = 0.0
    weight: Vec3 = ZERO3


@dataclass(frozen=True)
class JointedArm:
    """A serial arm before the first point of a surface.

    Args:
        arm: what moves.
        place: where it starts.
        inner: its inner loop and sensor.
    """

    arm: SerialArm
    place: Place
    inner: Arm

    # More than seven arguments: as of `world.simulate`.
    def slide(
        self, gains: Gains, ground: Ground, ways: Array, *, into: ArrayLike = DOWN, seed: int = 0,
        physics: str = "mujoco", tool: HeldTip | None = None,
    ) -> Array:  # fmt: skip
        """A slide from free motion on: rows of `world.COLUMNS` in the surface's axes, shape (n, 25).

        Args:
            gains: with a table `slide`.
            ground: the surface.
            ways: directions of the slide, tick by tick, shape (m, 3).
            into: direction in which the law looks for the surface, shape (3,).
            seed: of the noise.
            physics: own or mujoco.
            tool: with a spherical tip; None for a point.

        Raises:
            InputError: a joint reached the end of its range; gains of another kind of arm.
        """
        rate = gains.arm.rate
        run = JointedSlide(
            self, gains, ground, lambda since: ways[round(since * rate)], into, seed, physics, tool
        )
        rows = np.zeros((len(ways) + round(LONGEST * rate), len(COLUMNS)))
        for k, row in enumerate(rows):
            if round(run.sequence.next_since * rate) >= len(ways):
                return rows[:k]
            run.tick(row)
        return rows


class JointedSlide:
    """A slide that goes on tick by tick, and the arm of its sequence, in the surface's axes.

    Args:
        at: the arm before the surface.
        direction: in the surface's axes, at a time since the slide began [s].
        gains, ground, into, seed, physics, tool: as of `JointedArm.slide`.

    Raises:
        InputError: gains of another kind of arm.
    """

    # More than seven arguments: those of a slide, and the path.
    def __init__(
        self, at: JointedArm, gains: Gains, ground: Ground, direction: Callable[[float], ArrayLike],
        into: ArrayLike = DOWN, seed: int = 0, physics: str = "mujoco", tool: HeldTip | None = None,
    ):  # fmt: skip
        if gains.arm.kind != "servo":  # which takes the place of any arm's own loop
            check_mode(gains, at.inner.kind)
        held, place, n = tool or HeldTip(), at.place, at.place.normal
        self.loop, self._axes = SlidingLoop(gains, into), np.array([place.axes[2], place.axes[1], -n])
        self._origin = place.point - held.back * n
        frame = Frame(Mat3(*map(triple, self._axes)), triple(self._origin))
        cell = cell_of(at.arm, place, KelvinVoigt(ground.stiffness, ground.damping, 0.0), gains.arm)
        self.engine = OnGround(at.arm, cell, place.q, ground, gains.arm, frame, seed, physics, held.back)
        self.tip = SimulatedArm(at.arm, gains.arm, place, cell, self.engine)
        tared, weight = self._axes @ place.pose[:3, :3], self._axes @ np.array(held.weight)
        turning = TurningTool(self.loop, centre=(0.0, 0.0, -held.back), weight=weight, tared=tared)
        driver = SlidingDriver(self, self.loop, direction, tool=turning if tool else None)
        self._weight, self._unturned = weight, tared.T @ weight
        self.sequence = PressSequence(self, driver, lambda _: self.loop.desired, gains.arm.tick)

    def read(self) -> TipSample:
        """The readings at this tick."""
        pose = self._axes @ self.tip.pose[:3]
        R, at = pose[:, :3], pose[:, 3] - self._axes @ self._origin
        reading = self.engine.reading + self._weight - R @ self._unturned
        return TipSample(self.tip.read().time, reading, at, rotation=R)

    def move(self, velocity: Array, turning: Array | None = None) -> None:
        """Moves the tool's point for a tick with a velocity [m/s] and a turning [rad/s], each of shape (3,)."""
        self.tip.move(velocity @ self._axes, None if turning is None else turning @ self._axes)

    def tick(self, row: Array) -> None:
        """A tick; fills a row of `world.COLUMNS`.

        Raises:
            InputError: a joint reached the end of its range.
        """
        sample, desired, _ = self.sequence.tick()
        loop, after, arm, q = self.loop, self.engine.slid, self.tip.arm, self.tip.truth.q
        beyond = np.flatnonzero(~((q >= arm.lower) & (q <= arm.upper)))
        if len(beyond):
            at = f"reached the end of its range at {sample.time:.3f} s"
            raise InputError(f"{arm.names[beyond[0]]} {at}; make --length smaller")
        v, f = vector_at(loop.state, VELOCITY), triple(sample.force)
        compiled_note(self.engine.ground, loop.state, after.tip, v, f, float(after.mean), row)
        axis = self._axes @ arm.forward_kinematics(q)[:3, 2]
        up = np.array(outside(self.engine.ground, after.tip.x)[1])
        row[20], row[21], row[22:] = desired, np.arccos(np.clip(-axis @ up, -1.0, 1.0)), axis
        row[13] = (1.0 if loop.sliding else 2.0) * (self.sequence.touch is not None)


def jointed_arm(name: str) -> JointedArm:
    """An arm by its name, at home above a surface that its tool's axis meets squarely.

    Raises:
        InputError: an arm whose joints are not known, or no MuJoCo.
    """
    if name not in names():
        raise InputError(
            f"--turn and --physics mujoco need an arm whose joints are known ({', '.join(names())}), got {name}"
        )
    arm = SerialArm.named(name)
    place = place_of(arm, None, None)
    return JointedArm(arm, place, loop_of(name, arm.title, usual_mode(name), place.mass))
