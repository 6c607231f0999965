"""Refusal of other projects' force controllers: the entries of a parameter file that decide the motion.

None of these laws is modelled as its source runs it, so no file of theirs is proved stable and none is corrected. The
refusal names what is missing and every entry that decides the motion. Sources: `admittance_rule_impl.hpp` of
ros-controls/ros2_controllers; `ForwardDynamicsSolver.cpp` of fzi-forschungszentrum-informatik/cartesian_controllers;
`cartesian_controller.cpp` of utiasDSL/crisp_controllers; `cartesian_impedance_example_controller` of franka_ros.
"""

from collections.abc import Iterator
from math import sqrt
from pathlib import Path
from typing import Any, NamedTuple, NoReturn

from palpate.errors import InputError, unknown
from palpate.files import read_yaml
from palpate.text import printable

MAX_ENTRIES = 10_000
MAX_DEPTH = 32
MAX_LETTERS = 100
"""Most entries and levels of a file that are read (an alias may repeat itself without end), and letters of a value."""
EXPLICIT_LIMIT = 2.0
"""h D / M from which v <- v - h (D / M) v grows in free motion: the factor 1 - h D / M is then below -1."""


class ForeignLaw(NamedTuple):
    """Law of another project's controller, as far as a refusal needs it.

    Args:
        section: entries of which a file must have one, to be a parameter file of this controller.
        missing: part of the law that is not modelled.
        defaults: entries that decide the motion where the file leaves them out, with the value at its source.
    """

    section: tuple[str, ...]
    missing: str
    defaults: dict[str, str]


class ControllerRefusedError(InputError):
    """A controller's parameter file is refused; its text may be longer, because it names every entry."""

    longest = 6000


class ControllerEntries(NamedTuple):
    """Entries of one file, by their names with dots; without the node's name where only one node has this controller.

    Args:
        deciding: entries that decide the motion, or may.
        unused: groups of entries known to be harmless, without the node's name, such as frames and joints.
    """

    deciding: dict[str, Any]
    unused: dict[str, Any]

    def find(self, name: str) -> Any:
        """Value of the first entry whose name ends so; None without one."""
        return next((value for full, value in self.deciding.items() if _ends(full, name)), None)


_RATE = {"update_rate": "the controller manager's"}
LAWS = {
    "ros2-admittance": ForeignLaw(
        ("admittance",),
        "the rule's explicit integration at update_rate, its filter of the wrench, its joint damping and its measured "
        "position",
        _RATE
        | {
            "ft_sensor.filter_coefficient": "0.05",
            "admittance.joint_damping": "5",
            "kinematics.alpha": "0.01",
        },
    ),
    "fzi": ForeignLaw(
        ("pd_gains", "solver"),
        "the solver, which accumulates its velocity in steps of 0.02 s, the number of steps a second, and the arm's "
        "servo behind a position interface",
        _RATE
        | {"solver.iterations": "1", "solver.error_scale": "1", "ik_solver": "forward_dynamics"}
        | {"command_interfaces": "none"},
    ),
    "crisp": ForeignLaw(
        ("task", "nullspace"),
        "the torque held for a tick, the limit of its change, the clipped error, the null-space torque and the arm's "
        "inertia",
        _RATE
        | {
            "use_operational_space": "false",
            "use_friction": "false",
            "limit_error": "true",
            "limit_torques": "true",
        }
        | {"max_delta_tau": "0.5", "nullspace.projector_type": "kinematic", "nullspace.stiffness": "1"},
    ),
    "franka": ForeignLaw(
        ("translational_stiffness", "rotational_stiffness", "nullspace_stiffness"),
        "the stiffness, which is set and filtered at run time, the limit of the torque's change, the null-space torque "
        "and the arm's inertia",
        {},
    ),
}
UNPUBLISHED = {
    "ur": "force_mode's law is not published: damping and gain_scaling have no units in its manual; log a press, and "
    "use palpate identify and palpate tune",
}
HARMLESS = {
    "arm_id", "base", "base_frame", "chainable_command_interfaces", "command_joints",
    "compliance_ref_link", "enable_parameter_update_without_reactivation", "end_effector_frame",
    "end_effector_link", "fixed_world_frame", "frame", "frame_id", "ft_sensor_ref_link",
    "hand_frame_control", "joint_names", "joints", "log", "name",
    "plugin_package", "publish_state_feedback", "robot_base_link",
    "robot_description", "state_interfaces", "tip", "topic", "use_sim_time",
}  # fmt: skip
"""Words of names that decide no motion: where, under which name, and what is published. Whatever is not here may."""
AXES = ("x", "y", "z", "rx", "ry", "rz")


def refuse_controller(path: Path, controller: str) -> NoReturn:
    """Refuse a parameter file of another project's controller, naming each entry that decides the motion.

    Args:
        path: of the YAML file.
        controller: ros2-admittance, fzi, crisp, franka or ur.

    Raises:
        InputError: always, in one line.
    """
    if controller in UNPUBLISHED:
        raise InputError(f"--controller {controller}: {UNPUBLISHED[controller]}")
    if controller not in LAWS:
        raise unknown("controller", controller, [*LAWS, *UNPUBLISHED])
    law = LAWS[controller]
    settings = read_settings(path, law)
    if not settings.deciding:
        raise InputError(
            f"{path}: no settings of {controller}, which has {' or '.join(law.section)}; name its file"
        )
    parts = [f"{path}: {controller} is not certified, because its law is not modelled: {law.missing}"]
    parts += find_admittance_faults(settings) if controller == "ros2-admittance" else ()
    parts.append("entries that decide the motion: " + _named(settings.deciding))
    absent = {name: value for name, value in law.defaults.items() if settings.find(name) is None}
    if absent:
        parts.append("left out, with the controller's default: " + _named(absent))
    if settings.unused:
        parts.append("not used: " + ", ".join(map(_in_one_line, settings.unused)))
    raise ControllerRefusedError(
        "; ".join(parts) + "; nothing is proved or written; palpate tune designs a loop that is proved"
    )


def read_settings(path: Path, law: ForeignLaw) -> ControllerEntries:
    """Entries of a controller in a parameter file of ROS 2 or ROS 1, nested or with dots, and the rates beside it.

    Raises:
        InputError: no YAML file, or more entries than a person writes.
    """
    entries = flatten(read_yaml(path, "a parameter file"), path)
    places = {name[:i] for name in entries for i, word in enumerate(name) if word in law.section}
    nodes = sorted(places, key=len, reverse=True)  # the innermost first
    settings = ControllerEntries({}, {})
    for name, value in entries.items():
        node = next((node for node in nodes if name[: len(node)] == node), None)
        if node is None and (not nodes or name[-1] != "update_rate"):
            continue
        inside = name[len(node or ()) :]
        harmless = [i for i, word in enumerate(inside) if word in HARMLESS]
        if node is not None and harmless:
            settings.unused[".".join(inside[: harmless[0] + 1])] = value
        else:
            settings.deciding[".".join(inside if len(nodes) == 1 else name)] = value
    return settings


def flatten(file: dict[str, Any], path: Path) -> dict[tuple[str, ...], Any]:
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
        f"{path}: more than {MAX_ENTRIES} entries or {MAX_DEPTH} levels; give the parameters alone"
    )


def find_admittance_faults(settings: ControllerEntries) -> Iterator[str]:
    """Sentences about the axes of admittances that have no damping of their own, or that run away in free motion."""
    for name in [name for name in settings.deciding if _ends(name, "admittance.mass")]:
        node = name.removesuffix("mass")
        lists: list[Any] = [
            settings.deciding.get(f"{node}{key}") for key in ("mass", "stiffness", "damping_ratio")
        ]
        if not all(isinstance(values, list) for values in lists):
            continue
        rate = settings.find("update_rate")
        joint_damping = settings.deciding.get(f"{node}joint_damping", 5.0)
        undamped, fast = [], []
        for axis, M, S, ratio in zip(AXES, *lists, strict=False):
            step = _euler_step((M, S, ratio), joint_damping, rate)
            undamped += [axis] if S == 0 and not isinstance(S, bool) else []
            fast += [f"{axis} ({step:.3g})"] if step >= EXPLICIT_LIMIT else []
        if undamped:
            yield (
                f"{node}stiffness 0 along {', '.join(undamped)} makes D = 2 damping_ratio sqrt(M S) = 0; write one "
                "above 0 for damping"
            )
        if fast:
            yield (
                f"in free motion it runs away along {', '.join(fast)}: (D/M + joint_damping)/update_rate must be below "
                f"{EXPLICIT_LIMIT:g}"
            )


def _euler_step(numbers: tuple[Any, Any, Any], joint_damping: Any, rate: Any) -> float:
    """h (D/M + joint_damping) of an axis with mass, stiffness and damping ratio; 0 where a number is missing."""
    if not all(map(_is_positive, (*numbers, rate))):
        return 0.0
    M, S, ratio = numbers
    return float((2.0 * ratio * sqrt(S / M) + (joint_damping if _is_positive(joint_damping) else 0.0)) / rate)


def _is_positive(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and 0.0 < value < 1e300


def _ends(full: str, name: str) -> bool:
    return f".{full}".endswith(f".{name}")


def _named(entries: dict[str, Any]) -> str:
    """Names and values, in one line."""
    return ", ".join(f"{_in_one_line(name)} {_in_one_line(value)}" for name, value in entries.items())


def _in_one_line(value: Any) -> str:
    text = str(value).lower() if value is None or isinstance(value, bool) else str(value)
    text = " ".join(printable(text).split())
    return text if len(text) <= MAX_LETTERS else f"{text[:MAX_LETTERS]}..."
