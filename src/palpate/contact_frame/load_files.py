"""A weighed tool as the load file of a controller, and whether such a file agrees with a log.

- `.script`, Universal Robots: `set_target_payload(m, cog)` of URScript (Script Manual, e-Series), from the flange.
- `.json`, Franka: `endeffector-config.json` of an end effector archive (Franka RIDE documentation 1.1.1, End effector
  commissioning): mass, centerOfMass, inertia and transformation by columns, from the flange.
- `.yaml`, ROS 2: the gravity compensation filter of control_toolbox (its parameters file: tool.mass, tool.CoG, which
  earlier releases call tool.pos, and tool.gravity_field), and gravity_compensation.CoG of the admittance controller of
  ros2_controllers, from the sensor.
"""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Literal, NamedTuple

import msgspec
import numpy as np

from palpate.arrays import Array
from palpate.contact_frame.free_motion import Vector
from palpate.contact_frame.signals_in_base import turn_of
from palpate.contact_frame.tool_payload import Weighed
from palpate.errors import InputError
from palpate.files import MADE, WRITTEN, as_json, read_text, read_yaml
from palpate.units import GRAVITY

_CALL = re.compile(r"^[^#\n]*\bset_(?:target_)?payload\s*\(([^#\n]*)\)", re.MULTILINE)
_NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
_NO_CENTRE = "the log has no torque that shows the centre of mass, and a load file needs it"


class ToolLoad(NamedTuple):
    """Load of a tool as a controller has it.

    Args:
        mass: [kg].
        centre: of mass, from the flange or the sensor [m], shape (3,); None if the file has none.
        axes: of the centre.
    """

    mass: float
    centre: Array | None
    axes: Literal["flange", "sensor"] = "flange"


class NumberOfLoad(NamedTuple):
    """A number of a load file beside the log's.

    Args:
        name: of the number.
        unit: SI.
        file: its value there.
        log: its value by the log.
        half: half-width of the interval that has all numbers of the file in 95 % of logs.
    """

    name: str
    unit: str
    file: float
    log: float
    half: float

    @property
    def agrees(self) -> bool:
        """Whether the file's value lies in the interval."""
        return abs(self.file - self.log) <= self.half


def load_text(found: Weighed, ending: str, flange: Vector) -> str:
    """The load file of a weighed tool.

    Args:
        found: with its payload.
        ending: `.script`, `.json`, `.yaml` or `.toml`.
        flange: or the sensor, from the point that the torque is about, in the tool's axes [m].

    Raises:
        InputError: the log does not show the centre of mass.
    """
    payload = found.payload
    assert payload is not None
    if ending == ".toml":
        return payload.to_toml()
    if "centre" not in found.parameters:
        raise InputError(_NO_CENTRE)
    if payload.mass <= found.parameters["mass"].half:
        raise InputError(
            "the log shows no weight: its driver subtracts the tool; log without that, or use --check"
        )
    mass = round(payload.mass, 5)
    at, _ = _centre(found, "sensor" if ending == ".yaml" else "flange", flange)
    x, y, z = (round(float(part), 5) for part in at)
    if ending == ".script":
        note = f"{MADE} payload. The inertia matrix is not in the log; that of the controller stays."
        return f"{note}\nset_target_payload({mass}, [{x}, {y}, {z}])\n"
    if ending == ".json":
        file = {
            "id": "palpate-tool",
            "name": "Tool",
            "color": "#808080",
            "mass": mass,
            "centerOfMass": [x, y, z],
        }
        frame = {"transformation": np.eye(4).ravel().tolist(), "inertia": [0.0] * 9}
        return as_json({WRITTEN: "palpate payload", **file, **frame}).decode()
    field = [round(w / payload.mass, 5) for w in payload.weight]
    return _ROS2.format(
        made=f"{MADE} payload", mass=mass, centre=[x, y, z], field=field, force=-payload.weight[2]
    )


_ROS2 = """{made}
# The filter, in the node that has the sensor; name its frames.
sensor_filter_chain:
  filter1:
    name: gravity_compensation
    type: control_filters/GravityCompensationWrench
    params:
      world_frame: base
      sensor_frame: sensor
      tool:
        mass: {mass}
        CoG: {centre}
        gravity_field: {field}
# Or in the admittance controller of ros2_controllers.
gravity_compensation:
  frame: {{id: sensor}}
  CoG: {{pos: {centre}, force: {force:.5f}}}
"""


def read_load(path: Path) -> ToolLoad:
    """The load of a tool in a controller's file.

    Raises:
        InputError: another kind of file, no load in it, or two that differ.
    """
    kinds = {".script": _of_script, ".json": _of_json, ".yaml": _of_yaml, ".yml": _of_yaml}
    if path.suffix not in kinds:
        raise InputError(
            f"{path}: a load file ends with .script (UR), .json (Franka), .yaml (ROS 2) or .toml"
        )
    loads = list(kinds[path.suffix](path))
    if not loads:
        raise InputError(f"{path}: there is no load of a tool in it")
    first = loads[0]
    numbers = np.array([[one.mass, *(np.zeros(3) if one.centre is None else one.centre)] for one in loads])
    if not np.isfinite(numbers).all() or first.mass < 0.0:
        raise InputError(f"{path}: a load needs a mass of at least 0 and finite numbers")
    if not np.allclose(numbers, numbers[0], atol=1e-3):
        raise InputError(f"{path}: it has {len(loads)} loads that differ; leave one in")
    return first


def _of_script(path: Path) -> Iterator[ToolLoad]:
    for words in _CALL.findall(read_text(path, "a load file")):
        plain, bracket, rest = words.partition("[")
        mass, centre = _NUMBER.findall(plain), _NUMBER.findall(rest.partition("]")[0])
        if len(mass) != 1 or (bracket and len(centre) != 3):
            raise InputError(f"{path}: set_target_payload needs a mass and three numbers, got ({words})")
        yield ToolLoad(float(mass[0]), np.array(centre, dtype=float) if centre else None)


def _of_json(path: Path) -> Iterator[ToolLoad]:
    try:
        file = msgspec.json.decode(read_text(path, "a load file"))
    except msgspec.DecodeError as error:
        raise InputError(f"{path} is no JSON file: {error}") from None
    if isinstance(file, dict) and "mass" in file:
        yield _load_from(path, file["mass"], file.get("centerOfMass"))


def _of_yaml(path: Path) -> Iterator[ToolLoad]:
    places: list[Any] = [read_yaml(path, "a load file")[0]]
    seen: set[int] = set()  # an alias may lead back
    while places:
        place = places.pop()
        if not isinstance(place, dict) or id(place) in seen:
            continue
        seen.add(id(place))
        tool, compensation = place.get("tool"), place.get("gravity_compensation")
        if isinstance(tool, dict) and "mass" in tool:
            yield _load_from(path, tool["mass"], tool.get("CoG", tool.get("pos")), "sensor")
        centre = compensation.get("CoG") if isinstance(compensation, dict) else None
        if isinstance(centre, dict) and "force" in centre:
            force = centre["force"]
            mass = abs(force) / GRAVITY if isinstance(force, int | float) else force
            yield _load_from(path, mass, centre.get("pos"), "sensor")
        places += place.values()


def _load_from(path: Path, mass: Any, centre: Any, axes: Literal["flange", "sensor"] = "flange") -> ToolLoad:
    try:
        return ToolLoad(
            float(mass), None if centre is None else np.array(centre, dtype=float).reshape(3), axes
        )
    except (TypeError, ValueError):
        raise InputError(f"{path}: a load needs a number and three, got {mass!r} and {centre!r}") from None


def compare(found: Weighed, file: ToolLoad, flange: Vector, *, compensated: bool) -> list[NumberOfLoad]:
    """Each number of a load file beside the log's.

    The intervals are those of the log, widened so that all of them hold together in 95 % of logs (Sidak).

    Args:
        found: by the log, with its payload.
        file: the load.
        flange: as of `load_text`.
        compensated: whether the controller subtracts this load in the log: then its mass is what it should not show.
    """
    from scipy.special import ndtri

    shown = found.parameters["mass"]
    rows = [("mass", "kg", file.mass, float(shown.value) + compensated * file.mass, float(shown.half))]
    if file.centre is not None and "centre" in found.parameters and not compensated:
        log, half = _centre(found, file.axes, flange)
        own = zip("xyz", file.centre, log, half, strict=True)
        rows += [(f"centre, {axis}", "m", float(a), float(b), float(c)) for axis, a, b, c in own]
    wider = float(ndtri(0.5 + 0.5 * 0.95 ** (1.0 / len(rows))) / ndtri(0.975))
    return [NumberOfLoad(*row[:4], wider * row[4]) for row in rows]


def _centre(found: Weighed, axes: str, flange: Vector) -> tuple[Array, Array]:
    """Centre of mass and the half-widths of its interval in the axes of a file [m], shape (3,) each."""
    centre = found.parameters["centre"]
    turn = np.eye(3)
    if axes == "sensor" and found.payload is not None and found.payload.sensor_rpy is not None:
        turn = turn_of(found.payload.sensor_rpy)
    return turn.T @ (centre.value - flange), np.sqrt(turn.T**2 @ centre.half**2)
