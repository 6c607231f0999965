"""Serial arms from TOML files, those that come with palpate and a user's own, and from URDF read by MuJoCo.

Meshes of URDF are left out: they say nothing of how an arm moves.
"""

from dataclasses import replace
from importlib.resources import files
from math import inf
from pathlib import Path
from typing import Annotated, Any, Literal
from xml.etree import ElementTree

import msgspec
import numpy as np
from msgspec import Meta

from palpate.arrays import Array
from palpate.errors import InputError, unknown
from palpate.files import read_bytes, read_table, read_text
from palpate.robots.serial.chain import KinematicChain, spread_of
from palpate.robots.serial.from_mujoco import arm_of
from palpate.robots.serial.linear import check_inertia
from palpate.robots.serial.loading import load_mjcf
from palpate.robots.serial.serial_arm import SerialArm

Triple = tuple[float, float, float]
NotNegative = Annotated[float, Meta(ge=0)]
Positive = Annotated[float, Meta(gt=0)]
GRAVITY = 9.81


class JointTable(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A joint and the link that it moves."""

    name: str
    at: Triple
    """Origin of its frame in the one before [m]."""
    turn: Triple = (0.0, 0.0, 0.0)
    """Roll, pitch, yaw of its frame in the one before [deg]; its axis is z."""
    kind: Literal["revolute", "prismatic"] = "revolute"
    range: tuple[float, float] = (-inf, inf)
    """[rad], or [m] where it slides."""
    torque: Positive = inf
    """[N m, N]."""
    speed: Positive = inf
    """[rad/s, m/s]."""
    rotor: NotNegative = 0.0
    """Inertia of motor and gear at the joint [kg m^2, kg]."""
    mass: NotNegative
    com: Triple = (0.0, 0.0, 0.0)
    """Centre of mass in its frame [m]."""
    inertia: tuple[float, float, float, float, float, float] = (0.0,) * 6
    """xx yy zz xy xz yz about the centre of mass [kg m^2]."""


class ArmFile(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Content of an arm's TOML file."""

    title: str
    home: list[float]
    """[rad, m]."""
    flange: Triple = (0.0, 0.0, 0.0)
    """The tip in the last joint's frame [m]."""
    flange_turn: Triple = (0.0, 0.0, 0.0)
    """Roll, pitch, yaw [deg]."""
    gravity: Triple = (0.0, 0.0, -GRAVITY)
    """Gravity in the base's axes [m/s^2]."""
    joint: list[JointTable]


def names() -> list[str]:
    """The arms that come with palpate."""
    folder = files("palpate.robots.serial").joinpath("arms")
    return sorted(f.name.removesuffix(".toml") for f in folder.iterdir() if f.name.endswith(".toml"))


def load_shipped(name: str) -> SerialArm:
    """An arm that comes with palpate.

    Raises:
        InputError: no such arm.
    """
    if name not in names():
        raise unknown("arm", name, names())
    file = files("palpate.robots.serial").joinpath("arms", f"{name}.toml")
    return parse(file.read_text(encoding="utf-8"), name)


def read(path: Path) -> SerialArm:
    """An arm from a file.

    Raises:
        InputError: as `parse`; a file that is far too long, or no text.
    """
    return parse(read_text(path, "an arm"), str(path))


def parse(text: str, where: str) -> SerialArm:
    """An arm from TOML; `where` names the text in errors.

    Raises:
        InputError: TOML that does not parse, an unknown or missing key, a number that is none, an inertia that is none.
    """
    file = read_table(text, where, ArmFile, finite=False)
    try:
        return _build(file)
    except InputError as error:
        raise InputError(f"{where}: {error}") from None


def _build(file: ArmFile) -> SerialArm:
    joints = file.joint
    if len(file.home) != len(joints):
        raise InputError(f"home needs {len(joints)} numbers, one a joint, got {len(file.home)}")
    notes = []
    for j in joints:
        _check_finite(f"joint {j.name}", (*j.at, *j.turn, j.rotor, *j.com))
        if not j.range[0] < j.range[1]:
            raise InputError(
                f"joint {j.name}: its range must be two numbers, the lower first, got {list(j.range)}"
            )
        notes.append(check_inertia(j.name, j.mass, symmetric(j.inertia)))
    _check_finite("home, flange and gravity", (*file.home, *file.flange, *file.flange_turn, *file.gravity))
    return SerialArm(
        title=file.title,
        names=tuple(j.name for j in joints),
        chain=_chain(file),
        lower=_column(j.range[0] for j in joints),
        upper=_column(j.range[1] for j in joints),
        torque=_column(j.torque for j in joints),
        speed=_column(j.speed for j in joints),
        home=_column(file.home),
        notes=tuple(note for note in notes if note),
    )


def _chain(file: ArmFile) -> KinematicChain:
    joints = file.joint
    least, spread = spread_of(np.array([symmetric(j.inertia) for j in joints]))
    return KinematicChain(
        at=np.array([j.at for j in joints], float).reshape(-1, 3),
        turn=np.array([rotation(j.turn) for j in joints]).reshape(-1, 3, 3),
        slide=_column(float(j.kind == "prismatic") for j in joints),
        mass=_column(j.mass for j in joints),
        com=np.array([j.com for j in joints], float).reshape(-1, 3),
        least=least,
        spread=spread,
        rotor=_column(j.rotor for j in joints),
        tip=np.array(file.flange, float),
        tip_turn=rotation(file.flange_turn),
        gravity=np.array(file.gravity, float),
    )


def symmetric(numbers: Any) -> Array:
    """A matrix from xx yy zz xy xz yz."""
    xx, yy, zz, xy, xz, yz = map(float, numbers)
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def rotation(degrees: Triple) -> Array:
    """Rz(yaw) Ry(pitch) Rx(roll); exact at whole quarter turns."""
    (a, b), (c, d), (e, f) = (_cosine_and_sine(angle) for angle in degrees)
    roll = np.array([[1.0, 0.0, 0.0], [0.0, a, -b], [0.0, b, a]])
    pitch = np.array([[c, 0.0, d], [0.0, 1.0, 0.0], [-d, 0.0, c]])
    yaw = np.array([[e, -f, 0.0], [f, e, 0.0], [0.0, 0.0, 1.0]])
    return yaw @ pitch @ roll


def _cosine_and_sine(degrees: float) -> tuple[float, float]:
    quarter = {0.0: (1.0, 0.0), 90.0: (0.0, 1.0), 180.0: (-1.0, 0.0), 270.0: (0.0, -1.0)}
    exact = quarter.get(degrees % 360.0)
    return exact or (float(np.cos(np.radians(degrees))), float(np.sin(np.radians(degrees))))


def _column(values: Any) -> Array:
    return np.array([float(v) for v in values])


def _check_finite(what: str, values: Any) -> None:
    if not all(np.isfinite(v) for v in values):
        raise InputError(f"{what}: every number must be finite, got {list(values)}")


_LARGEST = 1 << 24
"""Bytes of a file."""
_SEEN = ("visual", "collision")


def from_urdf(path: Path, link: str) -> SerialArm:
    """The arm of a URDF file, see `SerialArm.from_urdf`."""
    root = _robot(path)
    links = [element.get("name", "") for element in root.iter("link")]
    if link not in links:
        raise unknown(f"link in {path}", link, links)
    for part in root.iter("link"):
        for shape in [child for child in part if child.tag in _SEEN]:
            part.remove(shape)
    for section in root.findall("mujoco"):
        root.remove(section)
    options = ElementTree.SubElement(root, "mujoco")
    ElementTree.SubElement(options, "compiler", fusestatic="false", discardvisual="false")
    model, notes = load_mjcf(path, ElementTree.tostring(root, encoding="unicode"))
    arm = arm_of(model, link, str(path), notes)
    speeds = _speeds(root)
    return replace(
        arm,
        title=root.get("name") or arm.title,
        speed=np.array([speeds.get(name, np.inf) for name in arm.names]),
    )


def _robot(path: Path) -> ElementTree.Element:
    data = read_bytes(path, _LARGEST, "an arm")
    try:
        root = ElementTree.fromstring(data)  # noqa: S314 - Python's expat bounds what entities may grow to
    except (ElementTree.ParseError, ValueError, LookupError) as error:
        raise InputError(f"{path}: not XML: {error}") from None
    if root.tag != "robot":
        raise InputError(
            f"{path}: not URDF, its first element is <{root.tag}>; MJCF is read by its ending .xml"
        )
    return root


def _speeds(root: ElementTree.Element) -> dict[str, float]:
    """Limits of the joints' rates, which MuJoCo does not keep; 0 and what is no number are none."""
    speeds = {}
    for joint in root.iter("joint"):
        limit = joint.find("limit")
        try:
            value = float(limit.get("velocity", "0")) if limit is not None else 0.0
        except ValueError:
            value = 0.0
        if value > 0.0:
            speeds[joint.get("name", "")] = value
    return speeds
