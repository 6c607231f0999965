"""Numbers with which a controller is stable on the surfaces asked for, as its file writes them."""

from __future__ import annotations

from io import StringIO
from math import sqrt
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from palpate.certify.discrete_loop import overshoot, runs_away_in_free_motion
from palpate.certify.upstream_laws import Admittance, CartesianImpedance, ForwardDynamics, Timing

if TYPE_CHECKING:
    from collections.abc import Iterator

    from palpate.arrays import Array
    from palpate.certify.controller_file import AxisLaw, ControllerFile, ControllerNode, Law

MAX_OVERSHOOT = 0.08
"""Overshoot of a corrected loop on the surfaces that are tried; 10 % are promised on those between."""
SURFACES_TRIED = 17
SPARE = 1.3
"""Factor by which the stiffest surface of a correction is stiffer than asked for: room for one tick more of delay."""
NO_SETTING = (
    "no numbers were found that this rule can run at this rate and that overshoot by at most 10 % there"
)


AnyLaw = TypeVar("AnyLaw", Admittance, CartesianImpedance)


class CorrectionError(Exception):
    """No numbers were found; the text says why, in a sentence."""


def surfaces_between(low: float, high: float) -> Array:
    """Stiffnesses at which a loop is tried, ends included [N/m]."""
    return np.geomspace(low, high, SURFACES_TRIED)


def is_acceptable(law: Law, timing: Timing, surfaces: tuple[float, float]) -> bool:
    """True if the law is stable in free motion and overshoots little on all surfaces; the stiffest is tried first."""
    loops = [law.loop(timing), law.loop(timing.later())]
    if any(runs_away_in_free_motion(loop) for loop in loops):
        return False
    if overshoot(loops[1], [surfaces[1] * SPARE])[0] > MAX_OVERSHOOT:
        return False
    return all(overshoot(loop, surfaces_between(*surfaces)).max() <= MAX_OVERSHOOT for loop in loops)


def correct_node(
    node: ControllerNode, laws: list[AxisLaw], timing: Timing, surfaces: tuple[float, float]
) -> dict[str, Any]:
    """Entries of a controller to change, and their values.

    Raises:
        CorrectionError: there are none; its text says why.
    """
    acceptable = {axis: law is None or is_acceptable(law, timing, surfaces) for axis, law, _ in laws}
    if all(acceptable.values()):
        return {}
    kind = type(next(law for _, law, _ in laws if law is not None))
    if kind is Admittance:
        return _correct_admittance(node, laws, timing, surfaces, acceptable)
    if kind is ForwardDynamics:
        return _correct_forward_dynamics(node, laws, timing, surfaces)
    return _correct_impedance(node, laws, timing, surfaces, acceptable)


def _first(
    candidates: Iterator[AnyLaw], timing: Timing, surfaces: tuple[float, float], reason: str
) -> AnyLaw:
    for law in candidates:
        if is_acceptable(law, timing, surfaces):
            return law
    raise CorrectionError(f"{NO_SETTING}: {reason}")


def _correct_admittance(
    node: ControllerNode,
    laws: list[AxisLaw],
    timing: Timing,
    surfaces: tuple[float, float],
    acceptable: dict[str, bool],
) -> dict[str, Any]:
    lists = {
        name: [float(value) for value in node.entries[f"admittance.{name}"]]
        for name in ("mass", "stiffness", "damping_ratio")
    }
    for i, (axis, law, _) in enumerate(laws):
        if acceptable[axis]:
            continue
        assert isinstance(law, Admittance)
        reason = (
            f"along {axis}, h D/M must stay below 2, and the delay and the filter ask for a D of about their lag "
            "times the stiffness, which settles too slowly on the softest surface"
        )
        better = _first(_admittances(law, timing, surfaces), timing, surfaces, reason)
        for name, values in lists.items():
            values[i] = getattr(better, name)
    return {f"admittance.{name}": values for name, values in lists.items()}


def _admittances(law: Admittance, timing: Timing, surfaces: tuple[float, float]) -> Iterator[Admittance]:
    """Admittances from little damping to much; the mass bounds h D/M, and is the lighter the faster."""
    h = 1.0 / timing.rate
    alpha = min(1.0, max(law.filter_coefficient, 1e-6))
    lag = timing.delay + 2.0 * h + (1.0 - alpha) / alpha * h
    stiffness = law.stiffness if law.stiffness > 0.0 else 1.0
    for D in surfaces[1] * lag * np.geomspace(0.25, 32.0, 15):
        for decay in (0.9, 0.45, 0.2, 0.1, 0.05, 0.02):
            if decay <= h * law.joint_damping:
                continue
            mass = _rounded(h * D / (decay - h * law.joint_damping))
            ratio = _rounded(D / (2.0 * sqrt(mass * stiffness)))
            if 1e-4 <= mass <= 1e6:
                yield law._replace(mass=mass, stiffness=stiffness, damping_ratio=ratio)


def _correct_forward_dynamics(
    node: ControllerNode, laws: list[AxisLaw], timing: Timing, surfaces: tuple[float, float]
) -> dict[str, Any]:
    scale = float(node.entries.get("solver.error_scale", 1.0))
    for factor in np.geomspace(1.0, 1e-6, 100)[1:]:
        smaller = _rounded(scale * factor)
        scaled = [
            law._replace(p=law.p / scale * smaller, d=law.d / scale * smaller)
            for _, law, _ in laws
            if isinstance(law, ForwardDynamics)
        ]
        if all(is_acceptable(law, timing, surfaces) for law in dict.fromkeys(scaled)):
            return {"solver.error_scale": smaller}
    raise CorrectionError(
        f"{NO_SETTING}: no smaller error_scale helps" + (
            "; behind a position interface the solver starts at the measured position, so that a motion which is late "
            "by n ticks repeats every n ticks, whatever the gain"
            if timing.interface == "position"
            else ""
        )
    )  # fmt: skip


def _correct_impedance(
    node: ControllerNode,
    laws: list[AxisLaw],
    timing: Timing,
    surfaces: tuple[float, float],
    acceptable: dict[str, bool],
) -> dict[str, Any]:
    changes = {}
    reason = (
        "the torque's delay and the tick bound the damping, and the arm's mass swings on the stiffest surface"
    )
    for axis, law, _ in laws:
        if acceptable[axis]:
            continue
        assert isinstance(law, CartesianImpedance)
        if "translational_stiffness" in node.entries:
            tried = (law._replace(stiffness=k, damping=2.0 * sqrt(k)) for k in range(400, 0, -5))
            better = _first(iter(tried), timing, surfaces, reason)
            changes["translational_stiffness"] = float(better.stiffness)
        else:
            near = law.damping * np.geomspace(1e-2, 1e3, 101) if law.damping else np.geomspace(1.0, 5e3, 101)
            near = near[np.argsort(abs(np.log(near / near[40])))]
            tried = (law._replace(damping=_rounded(d)) for d in near if d <= 5e3)
            changes[f"task.d_pos_{axis}"] = _first(iter(tried), timing, surfaces, reason).damping
    return changes


def _rounded(value: float) -> float:
    return float(f"{value:.6g}")


def with_changes(file: ControllerFile, changes: dict[tuple[str, ...], Any]) -> dict[str, Any]:
    """The file's content with other values; entries that it lacks are added to their controller, with dots."""
    left = dict(changes)
    places = {node.place for node in file.nodes}

    def rebuild(value: Any, name: tuple[str, ...]) -> Any:
        if not isinstance(value, dict):
            return left.pop(name, value)
        result = {
            key: rebuild(inner, (*name, *(() if key == "ros__parameters" else str(key).split("."))))
            for key, inner in value.items()
        }
        if name in places and "ros__parameters" not in value:
            for other in [full for full in left if full[: len(name)] == name and full not in present]:
                result[".".join(other[len(name) :])] = left.pop(other)
        return result

    from palpate.certify.controller_file import flatten

    present = set(flatten(file.content, ""))
    content: dict[str, Any] = rebuild(file.content, ())
    return content


def dump(content: dict[str, Any]) -> str:
    """The text of a YAML file; numbers keep their decimal point, which ROS 2 needs."""
    from ruamel.yaml import YAML

    yaml = YAML(typ="safe", pure=True)
    yaml.default_flow_style = False
    yaml.sort_base_mapping_type_on_output = False  # type: ignore[assignment]
    stream = StringIO()
    yaml.dump(content, stream)
    return stream.getvalue()
