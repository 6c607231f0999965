"""Who moves the arm: palpate's own laws, compiled, or MuJoCo."""

from __future__ import annotations

from copy import copy
from typing import Any, Protocol

import numpy as np

from palpate._jit import Bound
from palpate._vector import Mat3, Vec3
from palpate.arrays import Array
from palpate.press.cell import Body, Cell, Touch, compiled_foreign, compiled_tick
from palpate.robots.serial.chain import Tip
from palpate.robots.serial.serial_arm import SerialArm

ENGINES = ("own", "mujoco")
_HELD = 1e9
"""Rotor inertia of joints that are to stay where they are [kg m^2]."""


class Engine(Protocol):
    """Moves an arm through a tick."""

    def tick(self, cell: Cell, body: Body, touch: Touch, setpoint: Array, k: int, noise: Array) -> Touch:
        """The k-th tick under a set-point that holds; the body is changed in place."""
        ...


class Own:
    """Palpate's laws."""

    def __init__(self) -> None:
        self._tick = Bound(compiled_tick)

    def tick(self, cell: Cell, body: Body, touch: Touch, setpoint: Array, k: int, noise: Array) -> Touch:
        """See `Engine`."""
        after: Touch = self._tick(cell, body, touch, setpoint, k, noise)
        return after


class ByMuJoCo:
    """MuJoCo moves the arm in its own model; contact, sensor and motors are palpate's laws.

    Motors and contacts of the model itself are switched off, and joints beside the way to the tip are held: the torques
    are the controller's, and the surface is the one that was asked for.

    Args:
        arm: what moves.
        cell: as for `Own`; the rotors of its chain are those that MuJoCo takes.
        q: joint positions at the start.
    """

    def __init__(self, arm: SerialArm, cell: Cell, q: Array):
        from palpate.robots.serial.loading import mujoco
        from palpate.robots.serial.serial_arm import scene_of

        self._engine, self._step = mujoco(), Bound(compiled_foreign)
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

    def tick(self, cell: Cell, body: Body, touch: Touch, setpoint: Array, k: int, noise: Array) -> Touch:
        """See `Engine`."""
        from palpate.robots.serial.loading import refusals

        touch = touch._replace(mean=0.0)
        data, dofs = self._data, self._dofs
        with refusals("the simulation"):
            for j in range(cell.steps):
                self._engine.mj_step1(self._model, data)
                tip = self._filled(body)
                time = (k * cell.steps + j + 1) * cell.step
                touch = self._step(cell, body, touch, tip, setpoint, time, noise)
                data.qfrc_applied[dofs] = body.drive - body.normal * max(touch.force, 0.0)
                self._engine.mj_step2(self._model, data)
        body.q[:], body.qd[:] = data.qpos[self._positions], data.qvel[dofs]
        return touch

    def _filled(self, body: Body) -> Tip:
        """Puts M, h, J of this moment into the body's room; the tip."""
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
        R = Mat3(*(_three(row) for row in axes))
        return Tip(
            _three(at), R, _three(velocity[:3]), _three(velocity[3:]), _three(bias[:3]), _three(bias[3:])
        )


def _three(values: Any) -> Vec3:
    return Vec3(*map(float, values))
