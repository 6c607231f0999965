"""Pressing a probe on a surface in a simulator: brought to the touch, pressed to and fro, K and B read off again.

The rig of MuJoCo presses two geoms of a scene on each other.
"""

import copy
from collections.abc import Sequence
from dataclasses import dataclass
from math import pi, sqrt
from typing import Any, Protocol

import numpy as np

from palpate.arrays import Array
from palpate.robots.serial.loading import mujoco

_TOUCHING = 1e-7
"""Gap that counts as the touch [m]; single-precision places of a few centimetres are as fine."""
_STEPS = 400
_FARTHEST = 0.1
"""Of one joint in one step on the way to the touch [rad or m]."""
_RAMP, _PERIODS = 1, 2
"""Periods of the force: until it is whole, and after that."""
_FINEST = 40
"""Time steps that a period has at least."""
_SHARE = 0.5
"""Amplitude of the force as a share of its mean: resonance at half the natural frequency, 4/3, lifts off nothing."""


_SINGULAR = 1e-6
"""Mobility, as a share of the largest, below which joints cannot move a probe that way."""


class Rig(Protocol):
    """A simulation in which two shapes can touch.

    Its joints are moved by hand to the touch, then it is stepped under a generalised force. Nothing else acts on it:
    no weight, no motors.
    """

    time_step: float

    def gap(self) -> tuple[float, Array]:
        """Distance [m], negative inside, and the velocity by the surface per generalised velocity, shape (3, n).

        The first row is along the normal, outward, the others along the surface.
        """
        ...

    def mass(self) -> Array:
        """Mass matrix, shape (n, n)."""
        ...

    def velocity(self) -> Array:
        """Generalised velocity, shape (n,)."""
        ...

    def move(self, change: Array) -> None:
        """Change the joints by hand, as far as their ranges allow."""
        ...

    def step(self, force: Array) -> tuple[float, float, float]:
        """One time step under a generalised force, shape (n,): penetration [m], its rate [m/s], contact force [N]."""
        ...


@dataclass(frozen=True)
class RigPress:
    """Result of a press in a simulator.

    Args:
        stiffness, damping: of the force over penetration and its rate, by least squares [N/m], [N s/m].
        depth, force: largest [m], [N].
        residual: largest deviation from K x + B v, as a share of the largest force.
        mass: effective mass of the probe at the contact [kg].
        time_step: [s].
        samples: in contact.
    """

    stiffness: float
    damping: float
    depth: float
    force: float
    residual: float
    mass: float
    time_step: float
    samples: int

    def errors(self, stiffness: float, damping: float) -> tuple[float, float]:
        """Of K, and of B, as shares; that of a B of zero is its force at the natural frequency as a share of K's."""
        of_damping = (
            abs(self.damping / damping - 1.0)
            if damping > 0.0
            else abs(self.damping) / sqrt(stiffness * self.mass)
        )
        return abs(self.stiffness / stiffness - 1.0), of_damping

    def to_json(self) -> dict[str, Any]:
        """The press as plain values."""
        return {
            "K": self.stiffness,
            "B": self.damping,
            "largest_depth_m": self.depth,
            "largest_force_N": self.force,
            "residual": self.residual,
            "mass_kg": self.mass,
            "time_step_s": self.time_step,
            "samples": self.samples,
        }


def touch(rig: Rig) -> float | None:
    """Bring the probe to the surface along the shortest way, by the joint motion of least kinetic energy.

    Returns:
        The mass that the contact feels, 1 / (J M^-1 J^T) [kg]; None if the probe cannot be brought there.
    """
    for _ in range(_STEPS):
        gap, rates = rig.gap()
        way = np.linalg.solve(rig.mass(), rates[0])
        mobility = float(rates[0] @ way)
        if not (np.isfinite(mobility) and mobility > 0.0):
            return None
        if abs(gap) <= _TOUCHING:
            return 1.0 / mobility
        change = -gap / mobility * way
        rig.move(change * min(1.0, _FARTHEST / float(np.abs(change).max())))
    return None


def press(rig: Rig, stiffness: float, force: float, *, inward: bool = False) -> RigPress | None:
    """Press from the touch on with a force that oscillates about `force`, and fit K x + B v to the contact's force.

    The probe is led along the normal, as far as its joints can: where a probe slides, friction is pressed too.

    Args:
        rig: at the touch.
        stiffness: that is expected [N/m].
        force: mean [N].
        inward: fit the loadings alone.

    Returns:
        The result; None if there was no contact, or the simulation did not stay finite.
    """
    path = _path(rig)
    if path is None:
        return None
    _, mass, _ = path
    natural = sqrt(stiffness / mass)
    pulse = min(natural / 2, 2 * pi / (_FINEST * rig.time_step))
    period = 2 * pi / pulse
    rows, held = [], 0.0
    for k in range(int((_RAMP + _PERIODS) * period / rig.time_step)):
        time = k * rig.time_step
        grown = min(time / (_RAMP * period), 1.0)
        asked = force * grown * (1.0 + _SHARE * np.sin(pulse * time))
        path = _path(rig)
        if path is None:
            return None
        row = rig.step(_drive(rig, path, asked, held, natural))
        if not np.all(np.isfinite(row)):
            return None
        held = row[2]
        rows.append(row)
    table = np.array(rows)
    return _fit(table[table[:, 1] > 0.0] if inward else table, mass, rig.time_step)


def _drive(rig: Rig, path: tuple[Array, float, Array], asked: float, held: float, natural: float) -> Array:
    """Generalised force that presses along the path, and lets nothing else move."""
    way, mass, normal = path
    velocity = rig.velocity()
    speed = float(normal @ velocity)
    along = (held - asked) / mass - natural * speed
    aside = (velocity - way * speed) / (2 * rig.time_step)
    return rig.mass() @ (way * along - aside) - held * normal


def _path(rig: Rig) -> tuple[Array, float, Array] | None:
    """Joint motion per metre along the normal; its mass [kg]; the normal's row.

    Of least kinetic energy among the motions that slide least.
    """
    _, rates = rig.gap()
    inertia = rig.mass()
    moved = np.linalg.solve(inertia, rates.T)
    way = moved @ np.linalg.pinv(rates @ moved, rcond=_SINGULAR)[:, 0]
    speed = float(rates[0] @ way)
    if not (np.isfinite(speed) and speed > _SINGULAR):
        return None
    way = way / speed
    return way, float(way @ inertia @ way), rates[0]


def _fit(rows: Array, mass: float, time_step: float) -> RigPress | None:
    held = rows[(rows[:, 2] > 0.0) & (rows[:, 0] > 0.0)]
    if len(held) < _FINEST:
        return None
    (K, B), *_ = np.linalg.lstsq(held[:, :2], held[:, 2], rcond=None)
    off = np.abs(held[:, :2] @ (K, B) - held[:, 2]).max()
    largest = float(held[:, 2].max())
    return RigPress(
        float(K), float(B), float(held[:, 0].max()), largest, float(off) / largest, mass, time_step, len(held)
    )


def across(normal: Array) -> Array:
    """An orthogonal matrix whose first row is the normal, shape (3, 3): Householder's reflection of the first axis."""
    if not normal.any():
        return np.zeros((3, 3))
    way = normal - np.array([1.0, 0.0, 0.0])
    square = float(way @ way)
    return np.eye(3) - (2.0 / square) * np.outer(way, way) if square > 0.0 else np.eye(3)


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
    """See `palpate_export.rig.Rig`.

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
        """Mass that is felt, see `Rig.mass`."""
        whole = np.zeros((self.model.nv, self.model.nv))
        for unit, row in zip(np.eye(self.model.nv), whole, strict=True):
            mujoco().mj_mulM(self.model, self.data, row, unit)
        return whole

    def velocity(self) -> Array:
        """Velocity of the probe, see `Rig.velocity`."""
        return np.array(self.data.qvel)

    def move(self, change: Array) -> None:
        """Moves the probe, see `Rig.move`."""
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
