"""Engines that move a simulated arm, palpate's own laws or MuJoCo; its inner loop and gains."""

from copy import copy
from typing import Protocol

import msgspec
import numpy as np

from palpate._jit import BoundKernel
from palpate._vector import Mat3
from palpate.arrays import Array
from palpate.errors import InputError
from palpate.force.arm import Arm, PositionLoop, TorqueLoop, load_arm, names
from palpate.force.gains import Gains, gains_for
from palpate.press.cell import Body, TouchState, Workcell, compiled_foreign, compiled_tick
from palpate.robots.serial.chain import Tip
from palpate.robots.serial.serial_arm import SerialArm
from palpate.signals.types import triple

ENGINES = ("own", "mujoco")
_HELD = 1e9
"""Rotor inertia of joints that are to stay where they are [kg m^2]."""


class Engine(Protocol):
    """Moves an arm through a tick."""

    def tick(
        self, cell: Workcell, body: Body, touch: TouchState, setpoint: Array, k: int, noise: Array
    ) -> TouchState:
        """The k-th tick under a set-point that holds; the body is changed in place."""
        ...


class Own:
    """Palpate's own laws move the arm."""

    def __init__(self) -> None:
        self._tick = BoundKernel(compiled_tick)

    def tick(
        self, cell: Workcell, body: Body, touch: TouchState, setpoint: Array, k: int, noise: Array
    ) -> TouchState:
        """One tick, as `Engine` describes it."""
        after: TouchState = self._tick(cell, body, touch, setpoint, k, noise)
        return after


class ByMuJoCo:
    """MuJoCo moves the arm in its own model; contact, sensor and motors are palpate's laws.

    Motors and contacts of the model are switched off, and joints outside the chain to the tip are held: the torques are
    those of the controller, the surface is that of the cell.

    Args:
        arm: what moves.
        cell: its chain's rotors replace those of the model.
        q: joint positions at the start.
    """

    def __init__(self, arm: SerialArm, cell: Workcell, q: Array):
        from palpate.robots.serial.loading import mujoco
        from palpate.robots.serial.serial_arm import scene_of

        self._engine, self._step = mujoco(), BoundKernel(compiled_foreign)
        scene = scene_of(arm)
        model = copy(scene.model)
        flags = self._engine.mjtDisableBit
        model.opt.disableflags |= int(flags.mjDSBL_ACTUATION) | int(flags.mjDSBL_CONTACT)
        model.opt.integrator = int(self._engine.mjtIntegrator.mjINT_EULER)
        model.opt.timestep = cell.step
        model.dof_armature[:] = _HELD
        model.dof_armature[scene.dofs] = cell.chain.rotor
        self._model, self._data = model, self._engine.MjData(model)
        self._data.qpos[:] = model.qpos0
        self._data.qpos[scene.positions] = q
        self._dofs, self._positions, self._scene = scene.dofs, scene.positions, scene
        self._M, self._J, self._Jdot = np.zeros((model.nv, model.nv)), *np.zeros((2, 6, model.nv))

    def tick(
        self, cell: Workcell, body: Body, touch: TouchState, setpoint: Array, k: int, noise: Array
    ) -> TouchState:
        """One tick, as `Engine` describes it."""
        from palpate.robots.serial.loading import refusals

        touch = touch._replace(mean=0.0)
        data, dofs = self._data, self._dofs
        with refusals("the simulation"):
            for j in range(cell.steps):
                self._engine.mj_step1(self._model, data)
                tip = self._fill(body)
                time = (k * cell.steps + j + 1) * cell.step
                touch = self._contact(cell, body, touch, tip, setpoint, time, noise)
                data.qfrc_applied[dofs] = body.drive - self._load(body, touch)
                self._engine.mj_step2(self._model, data)
        body.q[:], body.qd[:] = data.qpos[self._positions], data.qvel[dofs]
        return touch

    # More than seven arguments: those of the compiled step.
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
        """Drives, contact and sensor after a step."""
        after: TouchState = self._step(cell, body, touch, tip, setpoint, time, noise)
        return after

    def _load(self, body: Body, touch: TouchState) -> Array:
        """Torques of the contact force [N m, N], shape (n,)."""
        return np.asarray(body.normal * max(touch.force, 0.0))

    def _fill(self, body: Body) -> Tip:
        """Fill M, h and J in the body's room; return the tip."""
        engine, model, data, dofs = self._engine, self._model, self._data, self._dofs
        body.q[:], body.qd[:] = data.qpos[self._positions], data.qvel[dofs]
        engine.mj_fullM(model, data, self._M)
        J, Jdot = self._J, self._Jdot
        at, axes = self._scene.tip(data)
        engine.mj_jac(model, data, J[:3], J[3:], at, self._scene.body)
        engine.mj_jacDot(model, data, Jdot[:3], Jdot[3:], at, self._scene.body)
        body.room.M[:] = self._M[np.ix_(dofs, dofs)]
        body.room.h[:] = (data.qfrc_bias - data.qfrc_passive)[dofs]
        body.room.J[:] = J[:, dofs]
        bias, velocity = Jdot @ data.qvel, J @ data.qvel
        R = Mat3(*map(triple, axes))
        return Tip(
            triple(at), R, triple(velocity[:3]), triple(velocity[3:]), triple(bias[:3]), triple(bias[3:])
        )


MODES = ("torque", "position")
_TYPICAL = {"torque": "fr3", "position": "ur5e"}
"""Arm whose inner loop and sensor are taken for an arm whose own are unknown."""
_DAMPED = 0.7
"""Damping ratio of the tip on its spring in free motion."""


def usual_mode(name: str) -> str:
    """Mode in which an arm is driven: torque, unless its file states another."""
    return load_arm(name).kind if name in names() else "torque"


def loop_of(name: str, title: str, mode: str, mass: float) -> Arm:
    """Arm with inner loop and sensor, for `palpate.force`.

    Args:
        name: of the arm; another than those that come with palpate gets the typical loop.
        title: of the arm.
        mode: torque or position.
        mass: of the tip along the normal, 1/(n^T J M^-1 J^T n) at the pose of the press [kg].
    """
    known = load_arm(name) if name in names() else None
    typical = load_arm(_TYPICAL[mode])
    arm = known if known is not None and known.kind == mode else typical
    inner = arm.inner
    if isinstance(inner, TorqueLoop):
        damping = 2.0 * _DAMPED * float(np.sqrt(inner.stiffness * mass))
        inner = msgspec.structs.replace(inner, mass=mass, damping=damping)
    else:
        inner = msgspec.structs.replace(inner, mass=mass)
    sensor = known.sensor if known is not None else arm.sensor
    return msgspec.structs.replace(arm, title=f"{title}, {mode}s", inner=inner, sensor=sensor)


def press_gains(arm: Arm, force: float, force_max: float | None = None) -> Gains:
    """Gains for a force on any surface up to the arm's stiffness limit, with no relief of the lag and no proof.

    Args:
        arm: what moves.
        force: F_d, the smallest that will be asked for [N].
        force_max: F_max [N]; none if left out.

    Raises:
        InputError: a force that the sensor's noise hides, or that it cannot read.
    """
    return msgspec.structs.replace(gains_for(arm, force, force_max=force_max), relief=0.0)


def check_mode(gains: Gains, mode: str | None) -> str:
    """Mode of the arm for which gains were tuned.

    Raises:
        InputError: `mode` is another one.
    """
    if mode is not None and gains.arm.kind != mode:
        raise InputError(
            f"these gains are for a {gains.arm.kind} arm, and --mode says {mode}; "
            "leave --mode out, or tune for the other"
        )
    return gains.arm.kind


def check_arm(gains: Gains, name: str) -> None:
    """Refuse gains for another of the arms that come with palpate; the title of any other arm says nothing.

    Raises:
        InputError: it names both arms.
    """
    models = {known: load_arm(known).title.partition(",")[0] for known in names()}
    model = gains.arm.title.partition(",")[0]
    if model in models.values() and model != models.get(name, model):
        raise InputError(f"these gains are for the {model}, and --arm says {name}; tune for that arm")


def mass_note(gains: Gains, mass: float | None = None) -> str | None:
    """Note with its remedy if gains assume that a position arm's tip has no mass; None otherwise.

    Args:
        gains: of the loop.
        mass: of the tip, where it is known [kg].
    """
    inner = gains.arm.inner
    if not isinstance(inner, PositionLoop) or inner.mass is not None:
        return None
    known = "the tip's along the normal, 1/(n^T J M^-1 J^T n)" if mass is None else f"{mass:.2g} kg here"
    return (
        f"the gains leave out the mass of the arm's tip: a heavy tip swings on the arm's {inner.stiffness:g} N/m,"
        f" and after a touch the force may go over; add mass = M, {known}, under [inner] of the arm's file, and tune"
        " again"
    )


def series_of(arm: Arm) -> float | None:
    """Stiffness between the encoders and the surface [N/m]; None where the encoders sit on the links."""
    return arm.inner.stiffness if isinstance(arm.inner, PositionLoop) else None
