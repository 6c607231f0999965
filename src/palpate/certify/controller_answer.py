"""The surfaces on which another project's controller is stable: computed, proved, and corrected where asked for.

The model is one axis on a spring without damping; `NOT_MODELLED` is said in the same sentence as each claim.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

import numpy as np

from palpate.certify import controller_file as files
from palpate.certify.controller_correction import (
    REPEATED_MOTION,
    CorrectionError,
    correct_node,
    dump,
    surfaces_between,
    with_changes,
)
from palpate.certify.controller_file import AxisLaw, ControllerFile, ControllerNode, Law
from palpate.certify.discrete_loop import (
    POINTS_PER_DECADE,
    PROVED_FRACTION,
    SCANNED_STIFFNESS,
    LoopOnSpring,
    overshoot,
    prove,
    runs_away_in_free_motion,
    stable_ranges,
)
from palpate.certify.upstream_laws import SOURCES, Admittance, ForwardDynamics, Timing
from palpate.errors import InputError
from palpate.files import parse_yaml

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence
    from pathlib import Path

MAX_PROVED_TICKS = 80
"""Ticks of a delay with which a proof takes a minute at most."""
PROVED_SPAN = 1e-3
"""Softest surface of a proof, as a fraction of the edge, unless a softer one is asked for."""
MAX_DELAY_TICKS = 200
NOT_MODELLED = {
    "ros2-admittance": "the other five axes and their coupling, the kinematics with its alpha, joint limits, "
    "saturation, the arm's servo beyond the delay",
    "fzi": "the other five axes and their coupling, the kinematics with its virtual link masses (1 kg at the tip is "
    "taken), joint limits, saturation (the compliance controller's spring is limited to 1 m, and below 1 um it is 0), "
    "the arm's servo beyond the delay",
    "crisp": "the other five axes and their coupling, the kinematics, the null space, error_clip, the limit "
    "max_delta_tau of the torque's change, friction and its compensation, elastic joints",
    "franka": "the other five axes and their coupling, the kinematics, the null space, the limit of the torque's "
    "change, friction, elastic joints",
}
Range = tuple[float, float]


class OneAxisLaw(Protocol):
    """A law that closes a loop of one axis; it can be hashed."""

    def loop(self, timing: Timing) -> LoopOnSpring:
        """One tick of the loop."""
        ...


class ControllerRequest(NamedTuple):
    """Numbers that the file does not hold.

    Args:
        controller: ros2-admittance, fzi, crisp or franka.
        delay: from the command to the motion, with all that is late in the reading [s].
        rate: ticks a second; None for the file's.
        mass: of the arm at its tip [kg], for torque controllers.
        surfaces: stiffnesses that the loop has to be stable on [N/m]; None for the answer alone.
    """

    controller: str
    delay: float | None
    rate: float | None = None
    mass: float | None = None
    surfaces: Range | None = None


class LawVerdict(NamedTuple):
    """Where one law is stable.

    Args:
        ranges: of stiffness [N/m], by eigenvalues.
        proved: of stiffness [N/m], in exact arithmetic, for the delay and for one tick more; None without a proof.
        reason: why there is no range or no proof; "" if nothing.
    """

    ranges: tuple[Range, ...]
    proved: Range | None
    reason: str = ""


class ControllerVerdict(NamedTuple):
    """Answer about a file.

    Args:
        answer: the object for a program, as docs/json.md has it.
        corrected: text of the corrected file; None without one.
        holds: the surfaces that are asked for are proved, or some without a request.
    """

    answer: dict[str, Any]
    corrected: str | None
    holds: bool


def certify_controller(path: Path, request: ControllerRequest) -> ControllerVerdict:
    """Judge a parameter file of another project's controller.

    Raises:
        InputError: no such file, entries that are not modelled, or a number that is missing.
    """
    file, passed = _with_force(files.read_controllers(path, request.controller), request)
    nodes = [_judge_node(node, file, request) for node in file.nodes]
    laws = [axis for node in nodes for axis in node["axes"].values() if axis["ranges"] is not None]
    ranges, proved = _common_ranges([(axis["ranges"], axis["proved"]) for axis in laws])
    headline = ranges[0] if ranges else None
    holds = _covers(proved, request.surfaces)
    corrected, text = None, None
    reasons = {
        "no axis has a force loop": not laws,
        "no surfaces are asked for (--stiffness LOW:HIGH)": request.surfaces is None,
        "the loop is stable on the surfaces asked for": holds,
    }
    why = next((reason for reason, applies in reasons.items() if applies), None)
    if why is None:
        try:
            corrected, text = _correct(file, request, path)
        except CorrectionError as error:
            why = str(error)
    answer = {
        "controller": request.controller,
        "source": SOURCES[request.controller]._asdict(),
        "proved": {"stiffness": proved},
        "exact": {"stiffness": headline, "ranges": ranges, "points_per_decade": POINTS_PER_DECADE},
        "first_unstable": _first_unstable(headline) if laws else None,
        "controllers": nodes,
        "passed_over": passed,
        "corrected": corrected,
        "not_corrected_because": why,
        "not_modelled": NOT_MODELLED[request.controller],
        "unused": [
            *(f"{node.name}.{entry}".lstrip(".") for node in file.nodes for entry in node.unused),
            *file.other,
        ],
    }
    return ControllerVerdict(answer, text, holds)


def _with_force(file: ControllerFile, request: ControllerRequest) -> tuple[ControllerFile, list[str]]:
    """The file with the controllers that measure the force, and the names of the others.

    Raises:
        InputError: none does, an entry that is not modelled, or a number that is missing.
    """
    nodes, passed = [], []
    for node in file.nodes:
        try:
            node_laws(node, file, request)
            nodes.append(node)
        except files.NoForceError as error:
            if len(file.nodes) == 1:
                raise
            passed.append(str(error))
    if not nodes:
        raise InputError("; ".join(passed))
    return file._replace(nodes=nodes), passed


def node_laws(
    node: ControllerNode, file: ControllerFile, request: ControllerRequest
) -> tuple[list[AxisLaw], Timing]:
    """Laws of a controller's axes, and when its commands act.

    Raises:
        InputError: an entry that is not modelled, or a number that is missing.
    """
    controller = request.controller
    files.check_plugin(node, controller)
    rate = files.node_rate(node, file.rate)
    if request.rate is not None or controller == "franka":
        rate = request.rate or files.FRANKA_RATE
    torque = controller in ("crisp", "franka")
    missing = [
        text
        for value, text in (
            (rate, "--rate HZ, the controller manager's update_rate"),
            (request.delay, "--delay, everything late between contact and motion, such as 24:ms"),
            (request.mass if torque else 1.0, "--mass, of the arm at its tip, such as 3:kg"),
        )
        if value is None
    ]
    if missing:
        raise InputError(f"{node.where}: the file does not say it; give {' and '.join(missing)}")
    assert rate is not None
    assert request.delay is not None
    if request.mass is not None and request.mass <= 0.0:
        raise InputError(f"--mass must be above 0 kg, got {request.mass:g}")
    check_timing(rate, request.delay, f"{node.where}: ")
    if torque:
        read = files.crisp_axes if controller == "crisp" else files.franka_axes
        axes, interface = read(node, float(request.mass or 0.0)), "torque"
    else:
        axes = files.admittance_axes(node) if controller == "ros2-admittance" else files.fzi_axes(node)
        interface = files.node_interface(node)
    if len(file.nodes) > 1 and not any(axis.law for axis in axes):
        raise files.NoForceError(f"{node.where}: {axes[0].reason}")
    return axes, Timing(rate, request.delay, interface)


def check_timing(rate: float, delay: float, where: str = "") -> None:
    """Refuse a rate or a delay beyond what is modelled.

    Raises:
        InputError: one is out of range.
    """
    if not 1.0 <= rate <= files.MAX_RATE or not 0.0 <= delay * rate <= MAX_DELAY_TICKS:
        raise InputError(
            f"{where}a rate from 1 to {files.MAX_RATE:g} Hz and a delay up to {MAX_DELAY_TICKS} ticks are modelled, "
            f"got {rate:g} Hz and {delay:g} s"
        )


def _judge_node(node: ControllerNode, file: ControllerFile, request: ControllerRequest) -> dict[str, Any]:
    laws, timing = node_laws(node, file, request)
    soft = None if request.surfaces is None else request.surfaces[0]
    axes = {}
    for axis, law, reason in laws:
        verdict = LawVerdict((), None) if law is None else judge_law(law, timing, soft)
        axes[axis] = {
            "ranges": None if law is None else list(verdict.ranges),
            "proved": verdict.proved,
            "reason": "; ".join(filter(None, (reason, verdict.reason))),
            "overshoot": _overshoot(law, timing, request.surfaces, stable=bool(verdict.ranges)),
        }
    result: dict[str, Any] = {
        "node": node.name,
        "rate_hz": timing.rate,
        "delay_s": timing.delay,
        "interface": timing.interface,
        "axes": axes,
        "left_out": node.defaults,
        "notes": _notes(node, file, request),
    }
    if request.controller == "fzi" and timing.interface == "position" and timing.delay * timing.rate >= 1.0:
        sensor = timing._replace(sensor=True)
        ideal = [judge_law(law, sensor, soft) for _, law, _ in laws if law is not None]
        ranges, proved = _common_ranges([(verdict.ranges, verdict.proved) for verdict in ideal])
        result["if_only_the_force_is_late"] = {"exact": ranges, "proved": proved}
    return result


def _notes(node: ControllerNode, file: ControllerFile, request: ControllerRequest) -> list[str]:
    notes, controller = [], request.controller
    if request.rate is not None and files.node_rate(node, file.rate) not in (None, request.rate):
        notes.append(f"--rate {request.rate:g} replaces the update_rate of the file")
    if controller in ("ros2-admittance", "fzi"):
        kinds = node.entries.get("command_interfaces", ())
        if isinstance(kinds, list) and len(kinds) > 1:
            notes.append("the file commands position and velocity; the arm is taken to follow the position")
        if controller == "fzi" and node.has("solver.forward_dynamics"):
            notes.append(
                "solver.forward_dynamics.link_mass has no effect: the source declares it with slashes"
            )
    whole = [name for name in node.used if name != "solver.iterations" and _has_integer(node.entries[name])]
    if whole and controller != "franka":
        notes.append(f"ROS 2 may refuse these numbers without a decimal point: {files.named(sorted(whole))}")
    if controller == "franka":
        notes.append(
            "written from the source and never compared with a run of it, unlike the models of the other controllers"
        )
    return [*notes, *_crisp_notes(node)] if controller == "crisp" else notes


def _crisp_notes(node: ControllerNode) -> Iterator[str]:
    if node.entries.get("use_friction") is True:
        yield "use_friction: its torque is taken to cancel the joints' friction"
    if not node.entries.get("use_local_jacobian", False):
        yield (
            "use_local_jacobian false: the source's forces act at the base's origin instead of the tip, so that they "
            "also turn the tip; that coupling is not modelled"
        )
    projected = node.entries.get("nullspace.projector_type") != "none"
    if projected and node.entries.get("nullspace.damping", -1.0) == -1.0:
        yield (
            "nullspace.damping -1, the default, is a negative damping in the source: on an arm of seven joints the "
            "motion that leaves the tip in place is driven, not damped; give a value above 0"
        )


def _has_integer(value: Any) -> bool:
    values = value if isinstance(value, list) else [value]
    return any(isinstance(v, int) and not isinstance(v, bool) for v in values)


@lru_cache(256)
def judge_law(law: OneAxisLaw, timing: Timing, soft: float | None = None) -> LawVerdict:
    """Where a law is stable on springs.

    Args:
        law: of one axis.
        timing: when its commands act.
        soft: softest surface of the proof [N/m]; None for a thousandth of the edge.
    """
    loop = law.loop(timing)
    try:
        loop.matrices(np.array([SCANNED_STIFFNESS[1]]))
    except OverflowError:
        return LawVerdict((), None, "its numbers grow beyond all bounds within a tick")
    ranges = () if runs_away_in_free_motion(loop) else tuple(stable_ranges(loop))
    if not ranges:
        return LawVerdict((), None, _unstable(law, timing))
    later = law.loop(timing.later())
    if timing.delay * timing.rate > MAX_PROVED_TICKS:
        return LawVerdict(ranges, None, f"a delay of more than {MAX_PROVED_TICKS} ticks: eigenvalues alone")
    both = _common([ranges, stable_ranges(later)])
    if not both or runs_away_in_free_motion(later):
        return LawVerdict(ranges, None, "unstable with one tick more of delay: nothing is proved")
    low, high = both[0]
    high *= 1.0 if high == SCANNED_STIFFNESS[1] else PROVED_FRACTION
    wanted = high * PROVED_SPAN if soft is None else min(soft, high * PROVED_SPAN)
    low = max(wanted, low if low == SCANNED_STIFFNESS[0] else low / PROVED_FRACTION)
    proved = prove([loop, later], low, high) if low < high else None
    return LawVerdict(ranges, proved, "" if proved else "no proof was found")


def _unstable(law: OneAxisLaw, timing: Timing) -> str:
    """Why a law is stable on no surface."""
    if isinstance(law, Admittance):
        decay = law.decay(timing.rate)
        if decay >= 2.0:
            return f"in free motion it runs away: (D/M + joint_damping)/update_rate must be below 2 and is {decay:.3g}"
        if decay <= 0.0:
            return "nothing damps it: D/M + joint_damping is not above 0"
        return "unstable in free motion or on every surface that was scanned: the delay is too long for its damping"
    if (
        isinstance(law, ForwardDynamics)
        and timing.interface == "position"
        and timing.delay
        and not timing.sensor
    ):
        return f"unstable: {REPEATED_MOTION}; command velocities, or make the measured position follow within a tick"
    return "unstable in free motion or on every surface that was scanned"


def _overshoot(law: Law | None, timing: Timing, surfaces: Range | None, *, stable: bool) -> float | None:
    if law is None or surfaces is None or not stable:
        return None
    largest = float(overshoot(law.loop(timing), surfaces_between(*surfaces)).max())
    return largest if largest < float("inf") else None


def _common_ranges(laws: list[tuple[Sequence[Range], Range | None]]) -> tuple[list[Range], Range | None]:
    """Ranges on which all laws are stable, and the one on which all are proved; none without a law."""
    if not laws:
        return [], None
    proved = _common([[proved] if proved else [] for _, proved in laws])
    return _common([ranges for ranges, _ in laws]), proved[0] if proved else None


def _common(families: Iterable[Sequence[Range]]) -> list[Range]:
    """Intervals that lie in an interval of every family, the softest first."""
    result = [SCANNED_STIFFNESS]
    for ranges in families:
        pairs = [(max(a, c), min(b, d)) for a, b in result for c, d in ranges]
        result = [(low, high) for low, high in pairs if low < high]
    return result


def _covers(proved: Range | None, surfaces: Range | None) -> bool:
    if proved is None or surfaces is None:
        return proved is not None
    return proved[0] <= surfaces[0] and surfaces[1] <= proved[1]


def _first_unstable(headline: Range | None) -> float | None:
    low, high = SCANNED_STIFFNESS
    if headline is None or headline[0] > low:
        return low
    return headline[1] if headline[1] < high else None


def _correct(file: ControllerFile, request: ControllerRequest, path: Path) -> tuple[dict[str, Any], str]:
    """Changed entries by their names, and the text of the file with them, which is read back and judged.

    Raises:
        CorrectionError: there is none; its text says why.
    """
    assert request.surfaces is not None
    changes: dict[tuple[str, ...], Any] = {}
    for node in file.nodes:
        laws, timing = node_laws(node, file, request)
        for entry, value in correct_node(node, laws, timing, request.surfaces).items():
            changes[*node.place, *entry.split(".")] = value
    text = dump(with_changes(file, changes))
    again, _ = _with_force(
        files.find_controllers(parse_yaml(text, str(path)), str(path), request.controller), request
    )
    for node in again.nodes:
        laws, timing = node_laws(node, again, request)
        for _, law, _ in laws:
            if law is None:
                continue
            verdict = judge_law(law, timing, request.surfaces[0])
            if not _covers(verdict.proved, request.surfaces):
                raise CorrectionError("the corrected numbers could not be proved when they were read back")
    return {".".join(name): value for name, value in changes.items()}, text
