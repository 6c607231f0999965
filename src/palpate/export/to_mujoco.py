"""MuJoCo: a scene with a contact pair for each geom that can touch the surface, and a press of two geoms.

MuJoCo's contact is a constraint, softened by R [1/kg]: with a constant impedance d, a penetration r and its rate v,
f = (k r + b v) / R for solref = (-d^2 k, -d b), in `direct` format (MuJoCo's documentation, Computation, Constraint
model). With solimp "d d" and the d as small as MuJoCo takes, f is K r + B v for solref = (-K d R, -B d R), to the
d-th part; R is read off the engine with the contact made, as it depends on both bodies. A pyramidal cone shares the
force among its edges, a flat probe among its points: 1/R is then the sum of theirs.
"""

import copy
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple
from xml.sax.saxutils import quoteattr

import numpy as np

from palpate.arrays import Array
from palpate.errors import InputError, unknown
from palpate.export.contact import Contact
from palpate.export.pressing import MIN_DIRECTED_GAP, normal_axes, touch
from palpate.files import open_file
from palpate.robots.serial.loading import load_mjcf, mujoco, refusals

IMPEDANCE = 1e-4
"""d, the least that MuJoCo takes (mjMINIMP)."""
SLIP_RATE = 100.0
"""Rate at which friction stops a slip [1/s]: that of MuJoCo's default contact, 2 / 0.02 s."""
WIDE = 10.0
"""Margin of a surface that is to touch everything, in extents of the scene."""
TOUCH_MARGIN = 1e-6
"""Margin of a surface at the touch [m]."""
MAX_GAP = 1e3
"""Largest gap that is measured [m]."""
ROUND = (2, 4)
"""Geom types that touch a plane with one point: mjGEOM_SPHERE, mjGEOM_ELLIPSOID."""
BODIES_NOTE = (
    "the force begins at the touch, whatever margin the scene had; the constraint's softness R was measured in MuJoCo"
    " and belongs to these two bodies: export again when their masses change"
)
FRICTION_NOTE = (
    "in a soft contact, MuJoCo's friction below its limit is a damper: a body at rest on a slope creeps; when the probe"
    " slides, MuJoCo's cone couples friction into the normal force"
)


class PlateFriction(NamedTuple):
    """Friction of a contact: condim, and its five coefficients."""

    dimensions: int
    coefficients: tuple[float, ...]


@dataclass(frozen=True)
class GeomPair:
    """The contact of the surface with one geom.

    Args:
        probe: its name.
        friction: of the contact.
        softness: R of all points and edges together [1/kg].
        points: of contact when pressed; None if the geom cannot be brought to the surface.
        mass: that the contact feels [kg]; likewise.
    """

    probe: str
    friction: PlateFriction
    softness: float
    points: int | None = None
    mass: float | None = None

    def solref(self, contact: Contact) -> tuple[float, float]:
        """(-K d R, -B d R)."""
        scale = IMPEDANCE * self.softness
        return -contact.stiffness.value * scale, -contact.damping.value * scale

    def longest_step(self, contact: Contact) -> float | None:
        """Time step up to which a mass on this spring and damper is stable, as MuJoCo steps it [s]; None if unknown.

        Speed first, then place, both forces from the step's begin: K h^2 + 2 B h < 4 m.
        """
        if self.mass is None:
            return None
        K, B = contact.stiffness.value, contact.damping.value
        return float((np.sqrt(B * B + 4 * K * self.mass) - B) / K)

    def to_json(self, contact: Contact) -> dict[str, Any]:
        """The numbers of the pair as plain values."""
        return {
            "solref": list(self.solref(contact)),
            "R": self.softness,
            "points": self.points,
            "mass_kg": self.mass,
            "longest_time_step_s": self.longest_step(contact),
        }


class MuJoCoScene:
    """A scene as MuJoCo compiles it.

    Args:
        path: of the MJCF.
        surface: the geom's name.

    Raises:
        InputError: MuJoCo refuses it; it has no such geom.
        OSError: no such file.
    """

    def __init__(self, path: Path, surface: str) -> None:
        with open_file(path, "a scene of MuJoCo") as file:
            if b"<mujoco" not in file.read(1 << 16):  # it may stand behind comments
                raise InputError(f"{path}: no MJCF, which begins with <mujoco>; give a scene of MuJoCo")
        self.path, self.surface = path, surface
        self.model, _ = load_mjcf(path, published=False)
        self.names = [self.model.geom(i).name for i in range(self.model.ngeom)]
        self._check_geom(surface)
        self._check_pairs()

    def geom(self, name: str) -> int:
        """The number of a geom by its name."""
        return int(mujoco().mj_name2id(self.model, mujoco().mjtObj.mjOBJ_GEOM, name))

    def _check_geom(self, name: str) -> None:
        """Refuse a name that no geom has."""
        if name in self.names:
            return
        bodies = [self.model.body(i).name for i in range(self.model.nbody)]
        if name in bodies:
            geoms = np.flatnonzero(self.model.geom_bodyid == bodies.index(name))
            listed = ", ".join(self.names[i] or "(no name)" for i in geoms)
            raise InputError(
                f"{self.path}: {name!r} is a body; name one of its geoms: {listed or 'it has none'}"
            )
        named = list(filter(None, self.names))
        unnamed = len(self.names) - len(named)
        if not named:
            raise InputError(f"{self.path}: none of its {unnamed} geoms has a name; give the surface one")
        remainder = f", and {unnamed} without a name" if unnamed else ""
        raise InputError(f"{self.path}: {unknown('geom', name, named)}{remainder}")

    def _check_pairs(self) -> None:
        """Refuse a surface that has a contact pair already."""
        model, surface = self.model, self.geom(self.surface)
        for ends in zip(model.pair_geom1, model.pair_geom2, strict=True):
            if surface in ends:
                names = " and ".join(repr(self.names[geom]) for geom in ends)
                raise InputError(
                    f"{self.path}: it has a <pair> of {names} already; take that out, and export again"
                )

    def pairs(self, probe: str | None) -> tuple[list[GeomPair], list[str]]:
        """The contacts of the surface with all named geoms that can touch it, or with one, and notes on them."""
        friction, unnamed = self._touching()
        notes = [f"{unnamed} geoms without a name keep the scene's own contact with it"] if unnamed else []
        if probe is not None:
            self._check_geom(probe)
            if probe not in friction:
                names_with_pairs = ", ".join(sorted(friction)) or "none"
                raise InputError(
                    f"{self.path}: {probe!r} cannot touch {self.surface!r}; these can: {names_with_pairs}"
                )
            friction, notes = {probe: friction[probe]}, []
        if not friction:
            names = f"; {unnamed} geoms without a name could: name them" if unnamed else ""
            reason = names or ", as contype and conaffinity have it"
            raise InputError(f"{self.path}: nothing that has a name can touch {self.surface!r}{reason}")
        model = self._with_pairs(friction)
        pairs = [self._measure(model, name, pair_friction) for name, pair_friction in friction.items()]
        return pairs, notes + [note for pair in pairs for note in self._notes(pair)]

    def _touching(self) -> tuple[dict[str, PlateFriction], int]:
        """Friction of the contact with each named geom that can touch the surface; the number of unnamed ones.

        Measured in MuJoCo, with a surface as large as the scene.
        """
        surface, model = self.geom(self.surface), copy.copy(self.model)
        margin = WIDE * (1.0 + float(model.stat.extent))
        model.geom_margin[surface] = margin
        model.body_margin[model.geom_bodyid[surface]] = margin  # the broad phase uses it
        model.opt.disableflags |= int(mujoco().mjtDisableBit.mjDSBL_MIDPHASE)
        data = mujoco().MjData(model)
        mujoco().mj_forward(model, data)
        friction: dict[str, PlateFriction] = {}
        unnamed = set()
        for contact in data.contact:
            ends = [int(geom) for geom in contact.geom]
            if surface not in ends:
                continue
            partner = ends[1 - ends.index(surface)]
            if self.names[partner]:
                coefficients = tuple(float(mu) for mu in contact.friction)
                friction.setdefault(self.names[partner], PlateFriction(int(contact.dim), coefficients))
            else:
                unnamed.add(partner)
        return friction, len(unnamed)

    def _with_pairs(self, friction: dict[str, PlateFriction]) -> Any:
        """The scene with pairs of the right impedance, and any stiffness."""
        with refusals(str(self.path)):
            spec = mujoco().MjSpec.from_file(str(self.path))
            for probe, pair_friction in friction.items():
                spec.add_pair(
                    geomname1=self.surface,
                    geomname2=probe,
                    condim=pair_friction.dimensions,
                    friction=pair_friction.coefficients,
                    margin=0.0,
                    gap=0.0,
                    solref=(-1.0, -1.0),
                    solimp=(IMPEDANCE, IMPEDANCE, 1.0, 0.5, 2.0),
                )
            return spec.compile()

    def _measure(self, model: Any, probe: str, friction: PlateFriction) -> GeomPair:
        """A pair with its R, read off the engine with the contact made: at the touch, or else from afar."""
        rig = MuJoCoRig(model, self.geom(self.surface), self.geom(probe))
        mass = bring_to_touch(rig)
        margin = WIDE * (1.0 + float(rig.model.stat.extent)) if mass is None else TOUCH_MARGIN
        rig.model.pair_margin[rig.model.pair_margin >= 0.0] = margin
        mujoco().mj_forward(rig.model, rig.data)
        contacts = rig.contacts()
        if not contacts:
            raise InputError(
                f"{self.path}: MuJoCo makes no contact of {self.surface!r} and {probe!r}; does either move?"
            )
        inverse = sum(map(rig.inverse_softness, contacts))
        if mass is None:
            return GeomPair(probe, friction, len(contacts) / inverse)
        return GeomPair(probe, friction, 1.0 / inverse, len(contacts), mass)

    def _notes(self, pair: GeomPair) -> list[str]:
        is_round = int(self.model.geom_type[self.geom(pair.probe)]) in ROUND
        if pair.points is None:
            how = "could not be brought to the surface by its joints: one point of contact is assumed for it"
        elif pair.points > 1:
            how = f"touches with {pair.points} points, which share K and B: correct while all of them touch"
        else:
            how = "touched at one point, which carries all of K and B: a second one would double them"
        return [] if pair.points == 1 and is_round else [f"{pair.probe!r} {how}"]

    def xml(self, pairs: Sequence[GeomPair], contact: Contact, folder: Path) -> str:
        """A file for a folder that includes the scene and has the pairs."""
        path = self.path.absolute()
        include = os.path.relpath(path, folder.absolute())
        lines = "\n".join(f"    {self._pair_xml(pair, contact)}" for pair in pairs)
        return f"""<mujoco model={quoteattr(path.stem)}>
  <include file={quoteattr(include)}/>
  <contact>
{lines}
  </contact>
</mujoco>
"""

    def _pair_xml(self, pair: GeomPair, contact: Contact) -> str:
        values: dict[str, object] = {
            "geom1": self.surface,
            "geom2": pair.probe,
            "condim": pair.friction.dimensions,
            "friction": " ".join(f"{mu:.9g}" for mu in pair.friction.coefficients),
            "margin": 0,
            "gap": 0,
            "solimp": f"{IMPEDANCE} {IMPEDANCE} 1",
            "solref": " ".join(f"{number:.17g}" for number in pair.solref(contact)),
        }
        option = self.model.opt
        if option.cone == int(mujoco().mjtCone.mjCONE_ELLIPTIC) and pair.friction.dimensions > 1:
            # Rows of their own for the tangents: else friction would be as soft as B.
            rate = -SLIP_RATE * (1 - IMPEDANCE) / max(float(option.impratio), 1.0)
            values["solreffriction"] = f"0 {rate:.9g}"
        return "<pair " + " ".join(f"{name}={quoteattr(str(value))}" for name, value in values.items()) + "/>"


def compile_scene(path: Path) -> Any:
    """The model of a file that includes the scene; an InputError if MuJoCo does not find its meshes from there."""
    with refusals(f"{path.parent}: with the scene included from there"):
        return mujoco().MjModel.from_xml_path(str(path))


class MuJoCoRig:
    """Two geoms of a scene without weight and motors, see `palpate.export.pressing.Rig`.

    Args:
        model: `mujoco.MjModel`.
        surface: the geom's number.
        probe: the geom's number.
    """

    def __init__(self, model: Any, surface: int, probe: int) -> None:
        self.model, self.pair = copy.copy(model), {surface, probe}
        self.surface, self.probe = surface, probe
        self.model.opt.gravity[:] = 0.0
        self.model.opt.disableflags |= int(mujoco().mjtDisableBit.mjDSBL_ACTUATION)
        self.model.geom_contype[:], self.model.geom_conaffinity[:] = 0, 0
        for i in range(model.npair):
            if {int(model.pair_geom1[i]), int(model.pair_geom2[i])} != self.pair:
                self.model.pair_margin[i] = -MAX_GAP
        self.data = mujoco().MjData(self.model)
        self.time_step = float(self.model.opt.timestep)
        self._normal = np.zeros(3)
        self._refresh()

    def start(self, positions: Array) -> None:
        """Begin at rest in a pose."""
        mujoco().mj_resetData(self.model, self.data)
        self.data.qpos[:] = positions
        self._refresh()

    def contacts(self) -> list[int]:
        """Numbers of the contacts between the two geoms."""
        return [i for i in range(self.data.ncon) if set(self.data.contact[i].geom) == self.pair]

    def inverse_softness(self, number: int) -> float:
        """1/R of a contact: of its normal, or of the edges of its pyramid together [kg]."""
        contact = self.data.contact[number]
        is_pyramid = self.model.opt.cone == int(mujoco().mjtCone.mjCONE_PYRAMIDAL) and contact.dim > 1
        first = int(contact.efc_address)
        if first < 0:
            return 0.0
        rows = 2 * (contact.dim - 1) if is_pyramid else 1
        return float(np.sum(1.0 / self.data.efc_R[first : first + rows]))

    def gap(self) -> tuple[float, Array]:
        """See `Rig.gap`; in contact, the mean over its points, weighted by their forces."""
        points = self._points()
        total = sum(force for force, *_ in points)
        if total > 0.0:
            depth = sum(force / total * depth for force, depth, _ in points)
            return -depth, np.sum([force / total * rates for force, _, rates in points], axis=0)
        ends = np.zeros(6)
        distance = float(
            mujoco().mj_geomDistance(self.model, self.data, self.surface, self.probe, MAX_GAP, ends)
        )
        direction = (ends[3:] - ends[:3]) * np.sign(distance)
        length = float(np.linalg.norm(direction))
        if length > MIN_DIRECTED_GAP:
            self._normal = direction / length
        return distance, self._rates(ends[:3], ends[3:])

    def _rates(self, at_surface: Array, at_probe: Array) -> Array:
        bodies = self.model.geom_bodyid
        moves = [np.zeros((3, self.model.nv)) for _ in range(2)]
        for move, point, geom in zip(moves, (at_surface, at_probe), (self.surface, self.probe), strict=True):
            mujoco().mj_jac(self.model, self.data, move, None, np.ascontiguousarray(point), int(bodies[geom]))
        return normal_axes(self._normal) @ (moves[1] - moves[0])

    def mass(self) -> Array:
        """Mass matrix of all joints, see `Rig.mass`."""
        mass = np.zeros((self.model.nv, self.model.nv))
        for unit, row in zip(np.eye(self.model.nv), mass, strict=True):
            mujoco().mj_mulM(self.model, self.data, row, unit)
        return mass

    def velocity(self) -> Array:
        """Velocities of all joints, see `Rig.velocity`."""
        return np.array(self.data.qvel)

    def move(self, change: Array) -> None:
        """Move the joints, see `Rig.move`."""
        mujoco().mj_integratePos(self.model, self.data.qpos, change, 1.0)
        for joint in np.flatnonzero(self.model.jnt_limited):
            if self.model.jnt_type[joint] >= int(mujoco().mjtJoint.mjJNT_SLIDE):
                at = self.model.jnt_qposadr[joint]
                self.data.qpos[at] = np.clip(self.data.qpos[at], *self.model.jnt_range[joint])
        self._refresh()

    def step(self, force: Array) -> tuple[float, float, float]:
        """See `Rig.step`; penetration and rate are those of the state that the force belongs to, before the step."""
        self.data.qfrc_applied[:] = force - self.data.qfrc_passive
        mujoco().mj_forward(self.model, self.data)
        points = self._points()
        count = max(len(points), 1)
        depth = sum(depth for _, depth, _ in points) / count
        rate = -float(sum(rates[0] @ self.data.qvel for *_, rates in points)) / count
        mujoco().mj_step(self.model, self.data)
        return depth, rate, sum(force for force, *_ in points)

    def _points(self) -> list[tuple[float, float, Array]]:
        """Force [N], penetration [m] and rates, as of a gap, of each point of contact."""
        wrench, points = np.zeros(6), []
        for i in self.contacts():
            contact = self.data.contact[i]
            mujoco().mj_contactForce(self.model, self.data, i, wrench)
            outward = 1.0 if contact.geom[0] == self.surface else -1.0
            self._normal = outward * np.array(contact.frame[:3])
            points.append((float(wrench[0]), -float(contact.dist), self._rates(contact.pos, contact.pos)))
        return points

    def _refresh(self) -> None:
        mujoco().mj_fwdPosition(self.model, self.data)
        mujoco().mj_fwdVelocity(self.model, self.data)


def bring_to_touch(rig: MuJoCoRig) -> float | None:
    """Bring a rig to the touch from the model's own pose, or else from one of its keyframes; the mass that is felt."""
    for positions in (rig.model.qpos0, *rig.model.key_qpos):
        rig.start(positions)
        mass = touch(rig)
        if mass is not None:
            return mass
    return None
