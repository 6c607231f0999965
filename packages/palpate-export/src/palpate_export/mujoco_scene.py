"""A scene of MuJoCo with the contact in it: the scene is included, and a pair added for each geom that can touch.

MuJoCo's contact is a constraint, softened by R [1/kg]: with a constant impedance d, a penetration r and its rate v,
f = (k r + b v) / R for solref = (-d^2 k, -d b), in `direct` format (MuJoCo's documentation, Computation, Constraint
model). With solimp "d d" and the d as small as MuJoCo takes, f is K r + B v for solref = (-K d R, -B d R), to the
d-th part; R is read off the engine with the contact made, as it depends on both bodies. A pyramidal cone shares the
force among its edges, a flat probe among its points: 1/R is then the sum of theirs.
"""

import copy
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np

from palpate.errors import InputError, unknown
from palpate.files import open_file
from palpate.robots.serial.loading import load_mjcf, mujoco, refusals
from palpate_export.contact import Contact
from palpate_export.rig import MuJoCoRig, touch

IMPEDANCE = 1e-4
"""d, the least that MuJoCo takes (mjMINIMP)."""
_STICKING = 100.0
"""Rate at which friction stops a slip [1/s]: that of MuJoCo's default contact, 2 / 0.02 s."""
_WIDE = 10.0
"""Reach of a surface that is to touch everything, in extents of the scene."""
_CLOSE = 1e-6
"""Reach of a surface at the touch [m]."""
_HEAD = 1 << 16
"""Bytes in which an MJCF names itself, behind whatever comments."""
_ROUND = ("mjGEOM_SPHERE", "mjGEOM_ELLIPSOID")


_BEGIN = (
    "K and B begin at the touch, whatever margin the scene had; R was read off MuJoCo with the contact, and is that"
    " of these two bodies: export again when their masses change"
)
_SLIDE = (
    "in a contact as soft as this, MuJoCo's friction below its limit is a damper: a body at rest on a slope creeps; and"
    " where the probe slides, its cone lets friction into the normal force"
)
NOTES = (_BEGIN, _SLIDE)


@dataclass(frozen=True)
class GeomPair:
    """The contact of the surface with one geom.

    Args:
        probe: its name.
        softness: R of all points and edges together [1/kg].
        dimensions: condim.
        friction: five coefficients.
        points: of contact when pressed; None where the geom cannot be brought to the surface.
        mass: that the contact feels [kg]; likewise.
    """

    probe: str
    softness: float
    dimensions: int
    friction: tuple[float, ...]
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


@dataclass(frozen=True)
class MuJoCoScene:
    """A scene as MuJoCo compiles it.

    Args:
        path: of the MJCF.
        model: `mujoco.MjModel`.
        surface: the geom's name.
    """

    path: Path
    model: Any = field(repr=False)
    surface: str

    def geom(self, name: str) -> int:
        """The number of a geom by its name."""
        return int(mujoco().mj_name2id(self.model, mujoco().mjtObj.mjOBJ_GEOM, name))


def load_scene(path: Path, surface: str) -> MuJoCoScene:
    """Compile a scene.

    Raises:
        InputError: MuJoCo refuses it; it has no such geom.
        OSError: no such file.
    """
    model = _compile(path)
    names = [model.geom(i).name for i in range(model.ngeom)]
    if surface not in names:
        raise _no_geom(path, surface, names, model)
    return MuJoCoScene(path, model, surface)


def _compile(path: Path) -> Any:
    with open_file(path, "a scene of MuJoCo") as file:
        if b"<mujoco" not in file.read(_HEAD):
            raise InputError(f"{path}: no MJCF, which begins with <mujoco>; give a scene of MuJoCo")
    return load_mjcf(path, published=False)[0]


def _no_geom(path: Path, name: str, names: list[str], model: Any) -> InputError:
    named = [own for own in names if own]
    unnamed = len(names) - len(named)
    bodies = [model.body(i).name for i in range(model.nbody)]
    if name in bodies:
        own = [
            model.geom(i).name or "(no name)" for i in np.flatnonzero(model.geom_bodyid == bodies.index(name))
        ]
        return InputError(
            f"{path}: {name!r} is a body; name one of its geoms: {', '.join(own) or 'it has none'}"
        )
    if not named:
        return InputError(f"{path}: none of its {unnamed} geoms has a name; give the surface one")
    rest = f", and {unnamed} without a name" if unnamed else ""
    return InputError(f"{path}: {unknown('geom', name, named)}{rest}")


def pairs(scene: MuJoCoScene, probe: str | None) -> tuple[list[GeomPair], list[str]]:
    """The contacts of the surface with all that can touch it, or with one geom, and notes on them.

    Raises:
        InputError: nothing can touch it; no such geom; MuJoCo has a pair of them already.
    """
    _check_pairs(scene)
    reach, unnamed = _reach(scene, probe)
    if not reach:
        names = f"; {unnamed} geoms without a name could: name them" if unnamed else ""
        why = names or ", as contype and conaffinity have it"
        raise InputError(f"{scene.path}: nothing that has a name can touch {scene.surface!r}{why}")
    notes = [f"{unnamed} geoms without a name keep the scene's own contact with it"] if unnamed else []
    rough = _rough(scene, reach)
    found = [_measure_pair(rough, scene, name, own) for name, own in reach.items()]
    return found, notes + [note for pair in found for note in _notes(pair, _round(scene, pair.probe))]


def _notes(pair: GeomPair, round_one: bool) -> Iterator[str]:
    if pair.points is None:
        yield (
            f"{pair.probe!r} could not be brought to the surface by its joints: one point of contact is assumed for it"
        )
    elif pair.points > 1:
        yield f"{pair.probe!r} touches with {pair.points} points, which share K and B: correct while all of them touch"
    elif not round_one:
        yield f"{pair.probe!r} touched with one point, which has all of K and B: each more would add as much"


def _round(scene: MuJoCoScene, name: str) -> bool:
    kinds = [int(getattr(mujoco().mjtGeom, kind)) for kind in _ROUND]
    return int(scene.model.geom_type[scene.geom(name)]) in kinds


def _check_pairs(scene: MuJoCoScene) -> None:
    own, model = scene.geom(scene.surface), scene.model
    for i in range(model.npair):
        ends = int(model.pair_geom1[i]), int(model.pair_geom2[i])
        if own in ends:
            names = " and ".join(repr(model.geom(g).name) for g in ends)
            raise InputError(
                f"{scene.path}: it has a <pair> of {names} already; take that out, and export again"
            )


def _reach(scene: MuJoCoScene, probe: str | None) -> tuple[dict[str, tuple[int, tuple[float, ...]]], int]:
    """Dimensions and friction of the contact with each geom that can touch the surface; and how many have no name.

    Measured in MuJoCo, with a surface as large as the scene.
    """
    own = scene.geom(scene.surface)
    wide = copy.copy(scene.model)
    reach = _WIDE * (1.0 + float(wide.stat.extent))
    wide.geom_margin[own] = reach
    wide.body_margin[wide.geom_bodyid[own]] = reach  # by which the broad phase goes
    wide.opt.disableflags |= int(mujoco().mjtDisableBit.mjDSBL_MIDPHASE)
    data = mujoco().MjData(wide)
    mujoco().mj_forward(wide, data)
    found: dict[str, tuple[int, tuple[float, ...]]] = {}
    unnamed = set()
    for contact in data.contact:
        ends = [int(g) for g in contact.geom]
        if own not in ends:
            continue
        other = ends[1 - ends.index(own)]
        name = wide.geom(other).name
        if name:
            found.setdefault(name, (int(contact.dim), tuple(float(mu) for mu in contact.friction)))
        else:
            unnamed.add(other)
    if probe is None:
        return found, len(unnamed)
    if probe not in found:
        names = [wide.geom(i).name for i in range(wide.ngeom) if wide.geom(i).name]
        if probe in names:
            these = ", ".join(sorted(found)) or "none"
            raise InputError(f"{scene.path}: {probe!r} cannot touch {scene.surface!r}; these can: {these}")
        raise _no_geom(scene.path, probe, names, wide)
    return {probe: found[probe]}, 0


def _measure_pair(rough: Any, scene: MuJoCoScene, probe: str, own: tuple[int, tuple[float, ...]]) -> GeomPair:
    """A pair with its R, read off the engine with the contact made: at the touch, or else from afar."""
    rig = MuJoCoRig(rough, scene.geom(scene.surface), scene.geom(probe))
    mass = bring_to_touch(rig)
    near = copy.copy(rig.model)
    margin = _CLOSE if mass is not None else _WIDE * (1.0 + float(near.stat.extent))
    near.pair_margin[near.pair_margin >= 0.0] = margin
    rig.model = near
    mujoco().mj_forward(near, rig.data)
    held = rig.contacts()
    if not held:
        raise InputError(
            f"{scene.path}: MuJoCo makes no contact of {scene.surface!r} and {probe!r}; does either move?"
        )
    inverse = sum(_inverse(rig, i) for i in held)
    if mass is None:
        return GeomPair(probe, len(held) / inverse, *own)
    return GeomPair(probe, 1.0 / inverse, *own, len(held), mass)


def bring_to_touch(rig: MuJoCoRig) -> float | None:
    """Bring a rig to the touch from the model's own pose, or else from one of its keyframes; the mass that is felt."""
    rig.start()
    mass = touch(rig)
    for key in range(rig.model.nkey):
        if mass is not None:
            return mass
        rig.start(rig.model.key_qpos[key])
        mass = touch(rig)
    return mass


def _inverse(rig: MuJoCoRig, contact: int) -> float:
    """1/R of one point: of its normal, or of the edges of its pyramid together."""
    own = rig.data.contact[contact]
    pyramid = rig.model.opt.cone == int(mujoco().mjtCone.mjCONE_PYRAMIDAL)
    rows = 2 * (own.dim - 1) if pyramid and own.dim > 1 else 1
    first = int(own.efc_address)
    if first < 0:
        return 0.0
    return float(np.sum(1.0 / rig.data.efc_R[first : first + rows]))


def _rough(scene: MuJoCoScene, reach: Mapping[str, tuple[int, tuple[float, ...]]]) -> Any:
    """The scene with pairs of the right softness, and any stiffness."""
    with refusals(str(scene.path)):
        spec = mujoco().MjSpec.from_file(str(scene.path))
        for probe, (dimensions, friction) in reach.items():
            spec.add_pair(
                geomname1=scene.surface, geomname2=probe, condim=dimensions, friction=friction, margin=0.0, gap=0.0,
                solref=(-1.0, -1.0), solimp=(IMPEDANCE, IMPEDANCE, 1.0, 0.5, 2.0),
            )  # fmt: skip
        return spec.compile()


def xml(scene: MuJoCoScene, found: list[GeomPair], contact: Contact, folder: Path) -> str:
    """The scene with the pairs, for a file in a folder."""
    path = scene.path.absolute()
    named = os.path.relpath(path, folder.absolute())
    elliptic = scene.model.opt.cone == int(mujoco().mjtCone.mjCONE_ELLIPTIC)
    ratio = float(scene.model.opt.impratio) if elliptic else None
    lines = [_pair(scene.surface, pair, contact, ratio) for pair in found]
    return "\n".join(
        [
            f"<mujoco model={quoteattr(path.stem)}>",
            f"  <include file={quoteattr(named)}/>",
            "  <contact>",
            *lines,
            "  </contact>",
            "</mujoco>",
            "",
        ]
    )


def _pair(surface: str, pair: GeomPair, contact: Contact, ratio: float | None) -> str:
    own: Mapping[str, object] = {
        "geom1": surface,
        "geom2": pair.probe,
        "condim": pair.dimensions,
        "friction": " ".join(f"{mu:.9g}" for mu in pair.friction),
        "margin": 0,
        "gap": 0,
        "solimp": f"{IMPEDANCE} {IMPEDANCE} 1",
        "solref": " ".join(f"{number:.17g}" for number in pair.solref(contact)),
    }
    if (
        ratio is not None and pair.dimensions > 1
    ):  # tangential rows of their own: else friction were as soft as B
        own = {**own, "solreffriction": f"0 {-_STICKING * (1 - IMPEDANCE) / max(ratio, 1.0):.9g}"}
    return "    <pair " + " ".join(f"{name}={quoteattr(str(value))}" for name, value in own.items()) + "/>"


def compile_scene(path: Path) -> Any:
    """The model of a file that includes the scene.

    Raises:
        InputError: what MuJoCo refuses, such as meshes that are named from the scene's folder and not from this one.
    """
    with refusals(f"{path.parent}: with the scene included from there"):
        return mujoco().MjModel.from_xml_path(str(path))
