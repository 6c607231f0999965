"""Parameter files of other projects' force controllers: their entries, and the law of each axis.

Parameter files of ROS 2 or ROS 1, nested or with dots. Names, defaults and limits are those of the sources in
`palpate.certify.upstream_laws`.
"""

from __future__ import annotations

from math import inf
from typing import TYPE_CHECKING, Any, NamedTuple

from palpate.certify.upstream_laws import Admittance, CartesianImpedance, ForwardDynamics
from palpate.errors import InputError, unknown
from palpate.files import read_yaml
from palpate.text import printable

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

MAX_ENTRIES = 10_000
MAX_DEPTH = 32
MAX_LETTERS = 100
"""Most entries and levels of a file that are read (an alias may repeat itself without end), and letters of a value."""
MAX_RATE = 1e5
MAX_ITERATIONS = 100
"""Steps of a solver in a tick that are multiplied out in fractions."""
SECTIONS = {
    "ros2-admittance": ("admittance",),
    "fzi": ("pd_gains",),
    "crisp": ("task",),
    "franka": ("translational_stiffness",),
}
"""Words of which a parameter file of a controller has one."""
PLUGINS = {
    "ros2-admittance": ("admittance_controller/",),
    "fzi": (
        "cartesian_force_controller/",
        "cartesian_compliance_controller/",
        "cartesian_motion_controller/",
        "position_controllers/Cartesian",
        "velocity_controllers/Cartesian",
    ),
    "crisp": ("crisp_controllers/",),
    "franka": ("franka_example_controllers/",),
}
"""Beginnings of the types under which the sources that are modelled are loaded."""
UNPUBLISHED = {
    "ur": "force_mode's law is not published: damping and gain_scaling have no units in its manual; log a press, and "
    "use palpate identify and palpate tune",
}
AXES = ("x", "y", "z")
FRANKA_RATE = 1000.0
NO_TORQUE = (
    "k_pos 0 makes the damping 0 too: no torque acts along it, and contact is neither damped nor driven"
)
DRIVEN = (
    "with projector_type none is a negative damping of every joint, and nothing else acts: the arm runs away, in "
    "contact as in free motion, unless the friction of its joints holds it"
)
Law = Admittance | ForwardDynamics | CartesianImpedance


class ControllerNode:
    """Entries of one controller, by their names with dots; what is read is noted.

    Args:
        where: file and node, for messages.
        place: words of the node's name in the file; empty for a file of one controller.
        entries: values by name.
        plugin: type under which the controller is loaded; "" if the file does not say.
    """

    def __init__(self, where: str, place: tuple[str, ...], entries: dict[str, Any], plugin: str = ""):
        self.where, self.place, self.entries, self.plugin = where, place, entries, plugin
        self.used: set[str] = set()
        self.defaults: dict[str, Any] = {}

    @property
    def name(self) -> str:
        """Name of the node; "" for a file of one controller."""
        return shown(".".join(self.place))

    @property
    def unused(self) -> list[str]:
        """Names of the entries that no law has read."""
        return [name for name in self.entries if name not in self.used]

    def value(self, name: str, default: Any) -> Any:
        """Value of an entry; its default, which is noted, where the file leaves it out."""
        if name in self.entries:
            self.used.add(name)
            return self.entries[name]
        self.defaults[name] = default
        return default

    def number(self, name: str, default: float | None, low: float = -1e12, high: float = 1e12) -> float:
        """A finite number within the limits.

        Raises:
            InputError: none, or out of range; without a default, it is left out.
        """
        return self._checked(name, self.value(name, default), low, high)

    def numbers(self, name: str, low: float, high: float) -> list[float]:
        """Six finite numbers within the limits.

        Raises:
            InputError: not six, or out of range.
        """
        if self.has(f"{name}.x"):
            raise InputError(
                f"{self.where}: {name}.x, an entry for each axis, is of an older controller; the source that is "
                f"modelled reads {name} as six numbers"
            )
        values = self.value(name, None)
        if not isinstance(values, list) or len(values) != 6:
            raise InputError(
                f"{self.where}: {name} must be six numbers, one for each axis, got {shown(values)}"
            )
        return [self._checked(f"{name}[{i}]", value, low, high) for i, value in enumerate(values)]

    def flag(self, name: str, default: bool) -> bool:
        """True or false.

        Raises:
            InputError: neither.
        """
        value = self.value(name, default)
        if not isinstance(value, bool):
            raise InputError(f"{self.where}: {name} must be true or false, got {shown(value)}")
        return value

    def has(self, word: str) -> bool:
        """True if some entry's name is this word or begins with it and a dot."""
        return any(name == word or name.startswith(f"{word}.") for name in self.entries)

    def _checked(self, name: str, value: Any, low: float, high: float) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) < inf:
            raise InputError(f"{self.where}: {name} must be a number, got {shown(value)}")
        if not low <= value <= high:
            raise InputError(
                f"{self.where}: {name} must be from {low:g} to {high:g}, as its source checks, got {shown(value)}"
            )
        return float(value)


class NoForceError(InputError):
    """A controller that does not measure the force, or of another project: it is passed over beside others."""


class AxisLaw(NamedTuple):
    """One axis of a controller.

    Args:
        axis: x, y or z, in the frame that the controller uses.
        law: what it does with the force; None without a loop.
        reason: why there is no loop, or what the law lacks; "" if nothing.
    """

    axis: str
    law: Law | None
    reason: str = ""


class ControllerFile(NamedTuple):
    """Controllers of a parameter file.

    Args:
        nodes: those of the wanted kind.
        rate: ticks a second; None if the file does not say, or says several.
        other: names of entries outside those nodes.
        content: the file as YAML has it.
    """

    nodes: list[ControllerNode]
    rate: float | None
    other: list[str]
    content: dict[str, Any]


def read_controllers(path: Path, controller: str) -> ControllerFile:
    """The controllers of one kind in a file.

    Raises:
        InputError: no YAML file, more entries than a person writes, or no such controller; no such kind.
    """
    check_kind(controller)
    return find_controllers(read_yaml(path, "a parameter file"), str(path), controller)


def check_kind(controller: str) -> None:
    """Refuse what is no kind of controller, or one whose law nobody has published.

    Raises:
        InputError: it is not modelled.
    """
    if controller in UNPUBLISHED:
        raise InputError(f"--controller {controller}: {UNPUBLISHED[controller]}")
    if controller not in SECTIONS:
        raise unknown("controller", controller, [*SECTIONS, *UNPUBLISHED])


def find_controllers(content: dict[str, Any], path: str, controller: str) -> ControllerFile:
    """The controllers of one kind among the entries of a file.

    Raises:
        InputError: more entries than a person writes, or no such controller.
    """
    entries = flatten(content, path)
    section = SECTIONS[controller]
    places = {name[:i] for name in entries for i, word in enumerate(name) if word in section}
    inside: dict[tuple[str, ...], dict[str, Any]] = {}
    other: dict[tuple[str, ...], Any] = {}
    for name, value in entries.items():
        place = max((p for p in places if name[: len(p)] == p), key=len, default=None)
        if place is None:
            other[name] = value
        else:
            inside.setdefault(place, {})[".".join(name[len(place) :])] = value
    types = {name[-2].strip("/"): value for name, value in other.items() if name[-1] == "type" and name[1:]}
    nodes = []
    for place, values in inside.items():
        if any(name.split(".")[0] in section for name in values):
            label = ".".join(place)
            where = printable(f"{path}, {label}") if len(inside) > 1 and label else str(path)
            plugin = values.get("type", types.get(label.rpartition("/")[2], ""))
            nodes.append(ControllerNode(where, place, values, str(plugin)))
        else:
            other |= {(*place, *name.split(".")): value for name, value in values.items()}
    if not nodes:
        if any("pid_gains" in name for name in entries) and controller == "fzi":
            raise InputError(
                f"{path}: pid_gains is of an older controller; the source that is modelled reads pd_gains"
            )
        raise InputError(
            f"{path}: no settings of {controller}, whose files have entries named {' or '.join(section)}"
        )
    rates = {value for name, value in other.items() if name[-1] == "update_rate" and _is_rate(value)}
    rate = float(rates.pop()) if len(rates) == 1 else None
    names = [".".join(name) for name in other if name[-1] != "update_rate"]
    return ControllerFile(nodes, rate, names, content)


def node_rate(node: ControllerNode, shared: float | None) -> float | None:
    """Ticks a second: of the controller itself, else of its manager; None without one.

    Raises:
        InputError: no positive number.
    """
    if "update_rate" not in node.entries:
        return shared
    rate = node.number("update_rate", None, 0.0, MAX_RATE)
    return rate if rate > 0.0 else shared


def check_plugin(node: ControllerNode, controller: str) -> None:
    """Refuse a controller of the same entries that another source is loaded for.

    Raises:
        NoForceError: its type is of another project.
    """
    if node.plugin and not node.plugin.startswith(PLUGINS[controller]):
        raise NoForceError(
            f"{node.where}: its type is {shown(node.plugin)}, whose source is not the one that is modelled"
        )


def _is_rate(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and 0.0 < value <= MAX_RATE


def node_interface(node: ControllerNode) -> str:
    """Quantity that the controller commands; `position` where it commands position and velocity alike.

    Raises:
        InputError: neither a position nor a velocity.
    """
    kind = str(node.entries.get("type", "")).partition("_controllers/")[0]
    if not node.has("command_interfaces") and kind in ("position", "velocity"):  # ROS 1
        node.used.add("type")
        return kind
    kinds = node.value("command_interfaces", None if node.has("pd_gains") else ["position"])
    if not isinstance(kinds, list) or not kinds or not all(k in ("position", "velocity") for k in kinds):
        raise InputError(
            f"{node.where}: command_interfaces must be [position] or [velocity], got {shown(kinds)}; how the arm "
            "follows others is not modelled"
        )
    return "position" if "position" in kinds else "velocity"


def admittance_axes(node: ControllerNode) -> list[AxisLaw]:
    """Axes of ros2_controllers' admittance rule.

    Raises:
        InputError: an entry is missing or out of range.
    """
    M = node.numbers("admittance.mass", 1e-4, 1e6)
    S = node.numbers("admittance.stiffness", 0.0, 1e8)
    ratio = node.numbers("admittance.damping_ratio", -1e6, 1e6)
    joint_damping = node.number("admittance.joint_damping", 5.0, 0.0)
    alpha = node.number("ft_sensor.filter_coefficient", 0.05)
    selected = node.value("admittance.selected_axes", [True] * 6)
    if not isinstance(selected, list) or len(selected) != 6:
        raise InputError(f"{node.where}: admittance.selected_axes must be six times true or false")
    axes = []
    for i, axis in enumerate(AXES):
        law = Admittance(M[i], S[i], ratio[i], joint_damping, alpha)
        if selected[i] is not True:
            axes.append(AxisLaw(axis, None, "not among the selected_axes: the force does not move it"))
        elif S[i] == 0.0:
            axes.append(AxisLaw(axis, law, "stiffness 0 makes D = 2 damping_ratio sqrt(M S) = 0, so that "
                                "joint_damping alone damps it; write a stiffness above 0 for damping"))  # fmt: skip
        else:
            axes.append(AxisLaw(axis, law))
    return axes


def fzi_axes(node: ControllerNode) -> list[AxisLaw]:
    """Axes of FZI's force or compliance controller.

    Raises:
        InputError: a motion controller, another solver, or an entry out of range.
    """
    solver = node.value("ik_solver", "forward_dynamics")
    if solver != "forward_dynamics":
        raise InputError(f"{node.where}: ik_solver {shown(solver)} is not modelled; forward_dynamics is")
    compliance = node.has("compliance_ref_link") or node.has("stiffness")
    if not compliance and not node.has("ft_sensor_ref_link"):
        raise NoForceError(
            f"{node.where}: no ft_sensor_ref_link and no stiffness, so this is no force or compliance controller: a "
            "motion controller does not measure the force"
        )
    scale = node.number("solver.error_scale", 1.0)
    iterations = node.number("solver.iterations", 1, 1, MAX_ITERATIONS) if compliance else 1
    if iterations != int(iterations):
        raise InputError(f"{node.where}: solver.iterations must be a whole number, got {iterations:g}")
    axes = []
    for axis in AXES:
        p, d = (node.number(f"pd_gains.trans_{axis}.{gain}", 0.0) for gain in "pd")
        stiffness = node.number(f"stiffness.trans_{axis}", 500.0) if compliance else 0.0
        law = ForwardDynamics(scale * p, scale * d, stiffness, int(iterations))
        moves = scale != 0.0 and (p != 0.0 or d != 0.0)
        axes.append(
            AxisLaw(axis, law if moves else None, "" if moves else "gain 0: the force does not move it")
        )
    return axes


def crisp_axes(node: ControllerNode, mass: float) -> list[AxisLaw]:
    """Axes of CRISP's Cartesian impedance.

    Raises:
        InputError: torques in joint space, no torques at all, or an entry out of range.
    """
    if node.flag("stop_commands", False):
        raise InputError(f"{node.where}: stop_commands true, so that the controller commands no torque")
    operational = node.flag("use_operational_space", False)
    axes = []
    for axis in AXES:
        k = node.number(f"task.k_pos_{axis}", 500.0, 0.0, 5000.0)
        d = node.number(f"task.d_pos_{axis}", -1.0, -1.0, 5000.0)
        d = d if d > 0.0 else 2.0 * k**0.5
        law = CartesianImpedance(k, d, mass, operational) if k > 0.0 or d > 0.0 else None
        axes.append(AxisLaw(axis, law, "" if law else NO_TORQUE))
    return _with_joint_torques(node, axes)


def _with_joint_torques(node: ControllerNode, axes: list[AxisLaw]) -> list[AxisLaw]:
    """The axes, if no torques act in joint space; with the reason if those are sure to drive the arm.

    A negative damping W of all joints alone, M q'' = W q' - K q, has poles whose sum is the trace of W/M, above 0.
    """
    projector = node.value("nullspace.projector_type", "kinematic")
    stiffness = node.number("nullspace.stiffness", 1.0, 0.0, 500.0)
    damping = node.number("nullspace.damping", -1.0, -1.0, 500.0)
    weights = [value for name, value in node.entries.items() if name.startswith("nullspace.weights.")]
    if projector != "none" or not (stiffness or damping) or (weights and not any(weights)):
        return axes
    turns = any(
        node.entries.get(f"task.k_rot_{axis}", 30.0) != 0
        or node.entries.get(f"task.d_rot_{axis}", -1) not in (-1, 0)
        for axis in AXES
    )
    if damping < 0.0 and not (stiffness or turns or any(axis.law for axis in axes)):
        return [axis._replace(reason=f"nullspace.damping {damping:g} {DRIVEN}") for axis in axes]
    raise InputError(
        f"{node.where}: nullspace.projector_type none with stiffness {stiffness:g} and damping {damping:g} gives "
        "torques in joint space, which act along every axis by the arm's Jacobian; that is not modelled"
    )


def franka_axes(node: ControllerNode, mass: float) -> list[AxisLaw]:
    """Axes of Franka's Cartesian impedance example.

    Raises:
        InputError: an entry is out of range.
    """
    k = node.number("translational_stiffness", None, 0.0, 400.0)
    law = CartesianImpedance(k, 2.0 * k**0.5, mass) if k > 0.0 else None
    return [AxisLaw(axis, law, "" if law else "translational_stiffness 0: no torque acts") for axis in AXES]


def flatten(file: dict[str, Any], where: str) -> dict[tuple[str, ...], Any]:
    """Entries by the words of their names, in the order of the file; `ros__parameters` is no word of a name.

    Raises:
        InputError: too many, or too deep.
    """
    entries: dict[tuple[str, ...], Any] = {}
    waiting: list[tuple[tuple[str, ...], Any]] = [((), file)]
    for _ in range(MAX_ENTRIES):
        if not waiting:
            return entries
        name, value = waiting.pop()
        if len(name) > MAX_DEPTH:
            break
        if not isinstance(value, dict):
            entries[name] = value
            continue
        for key, inner in reversed(value.items()):
            words = () if key == "ros__parameters" else tuple(str(key).split("."))
            waiting.append(((*name, *words), inner))
    raise InputError(
        f"{where}: more than {MAX_ENTRIES} entries or {MAX_DEPTH} levels; give the parameters alone"
    )


def named(names: Iterable[str]) -> str:
    """Names of entries in one line; those that differ in the last word alone share it."""
    groups: dict[str, list[str]] = {}
    for name in names:
        head, dot, last = name.rpartition(".")
        groups.setdefault(shown(head) + dot, []).append(shown(last))
    return ", ".join(
        head + (last[0] if len(last) == 1 else f"({', '.join(last)})") for head, last in groups.items()
    )


def shown(value: Any) -> str:
    """A value of a stranger's file, printable and short."""
    text = str(value).lower() if value is None or isinstance(value, bool) else str(value)
    text = " ".join(printable(text).split())
    return text if len(text) <= MAX_LETTERS else f"{text[:MAX_LETTERS]}..."
