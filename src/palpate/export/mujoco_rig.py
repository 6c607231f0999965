"""Two geoms of a MuJoCo scene, as a rig to press them on each other."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from typing import Any

import numpy as np

from palpate.arrays import Array
from palpate.export.rig import across
from palpate.robots.serial._extra import mujoco

_DIRECTED = 1e-6
"""Gap from which on its direction is taken [m]."""
_FAR = 1e3
"""Gap that is looked for [m]."""


def alone(model: Any, surface: int, probe: int) -> Any:
    """A copy of a model without weight and motors, in which only these two geoms touch."""
    own = copy.copy(model)
    own.opt.gravity[:] = 0.0
    own.opt.disableflags |= int(mujoco().mjtDisableBit.mjDSBL_ACTUATION)
    own.geom_contype[:], own.geom_conaffinity[:] = 0, 0
    for i in range(own.npair):
        if {int(own.pair_geom1[i]), int(own.pair_geom2[i])} != {surface, probe}:
            own.pair_margin[i] = -_FAR
    return own


class MuJoCoRig:
    """See `palpate.export.rig.Rig`.

    Args:
        model: `mujoco.MjModel`.
        surface, probe: the geoms' numbers.
        plate: the number of a slide joint that is the surface's own displacement, which is read then, with the force of
            its spring and damper; None to read penetration and force of the contact.
    """

    def __init__(self, model: Any, surface: int, probe: int, plate: int | None = None) -> None:
        self.model = alone(model, surface, probe)
        self.data = mujoco().MjData(self.model)
        self.surface, self.probe, self.plate = surface, probe, plate
        self.time_step = float(self.model.opt.timestep)
        self._normal = np.zeros(3)
        self._refresh()

    def start(self, positions: Sequence[float] | None = None) -> None:
        """Begin at the model's own pose, or at another."""
        mujoco().mj_resetData(self.model, self.data)
        if positions is not None:
            self.data.qpos[:] = positions
        self._refresh()

    def gap(self) -> tuple[float, Array]:
        """See `Rig.gap`; in contact, of the points together, each by its share of the force."""
        held = self._points()
        total = sum(force for force, *_ in held)
        if total > 0.0:
            shares = [(force / total, depth, rates) for force, depth, rates in held]
            return -sum(a * depth for a, depth, _ in shares), np.sum(
                [a * rates for a, _, rates in shares], axis=0
            )
        ends = np.zeros(6)
        distance = float(
            mujoco().mj_geomDistance(self.model, self.data, self.surface, self.probe, _FAR, ends)
        )
        way = (ends[3:] - ends[:3]) * np.sign(distance)
        length = float(np.linalg.norm(way))
        if length > _DIRECTED:  # at the touch itself the way has no direction
            self._normal = way / length
        return distance, self._rates(ends[:3], ends[3:])

    def _rates(self, at_surface: Array, at_probe: Array) -> Array:
        bodies = self.model.geom_bodyid
        moves = [np.zeros((3, self.model.nv)) for _ in range(2)]
        for own, point, geom in zip(moves, (at_surface, at_probe), (self.surface, self.probe), strict=True):
            mujoco().mj_jac(self.model, self.data, own, None, np.ascontiguousarray(point), int(bodies[geom]))
        past = moves[1] - moves[0] * (self.plate is None)  # a plate goes where it is pressed
        return across(self._normal) @ past

    def mass(self) -> Array:
        """See `Rig.mass`."""
        whole = np.zeros((self.model.nv, self.model.nv))
        for unit, row in zip(np.eye(self.model.nv), whole, strict=True):
            mujoco().mj_mulM(self.model, self.data, row, unit)
        return whole

    def velocity(self) -> Array:
        """See `Rig.velocity`."""
        return np.array(self.data.qvel)

    def move(self, change: Array) -> None:
        """See `Rig.move`."""
        mujoco().mj_integratePos(self.model, self.data.qpos, change, 1.0)
        for joint in np.flatnonzero(self.model.jnt_limited):
            if self.model.jnt_type[joint] >= int(mujoco().mjtJoint.mjJNT_SLIDE):
                at = self.model.jnt_qposadr[joint]
                self.data.qpos[at] = np.clip(self.data.qpos[at], *self.model.jnt_range[joint])
        self._refresh()

    def contacts(self) -> list[int]:
        """Numbers of the contacts between the two geoms."""
        pair = {self.surface, self.probe}
        return [i for i in range(self.data.ncon) if set(self.data.contact[i].geom) == pair]

    def step(self, force: Array) -> tuple[float, float, float]:
        """See `Rig.step`; penetration and rate are those of the state that the force belongs to, before the step."""
        data, model = self.data, self.model
        data.qfrc_applied[:] = force - data.qfrc_passive * (self.plate is None)
        if self.plate is not None:
            data.qfrc_applied[self.plate] = 0.0
        mujoco().mj_forward(model, data)
        row = self._read()
        mujoco().mj_step(model, data)
        return row

    def _points(self) -> list[tuple[float, float, Array]]:
        """Of each point of contact its force [N], its penetration [m], and its rates, as of a gap."""
        wrench, found = np.zeros(6), []
        for i in self.contacts():
            contact = self.data.contact[i]
            mujoco().mj_contactForce(self.model, self.data, i, wrench)
            outward = 1.0 if contact.geom[0] == self.surface else -1.0
            self._normal = outward * np.array(contact.frame[:3])
            found.append((float(wrench[0]), -float(contact.dist), self._rates(contact.pos, contact.pos)))
        return found

    def _read(self) -> tuple[float, float, float]:
        held = self._points()
        total = sum(force for force, *_ in held)
        if self.plate is not None:  # whose own mass takes its share of the force
            at = self.plate
            carried = total - float(self.model.body_mass[self.model.jnt_bodyid[at]] * self.data.qacc[at])
            return float(self.data.qpos[at]), float(self.data.qvel[at]), carried
        count = max(len(held), 1)
        deep = sum(depth for _, depth, _ in held) / count
        return deep, -float(sum(rates[0] @ self.data.qvel for *_, rates in held)) / count, total

    def _refresh(self) -> None:
        mujoco().mj_fwdPosition(self.model, self.data)
        mujoco().mj_fwdVelocity(self.model, self.data)
