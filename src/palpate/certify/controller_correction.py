"""Numbers with which a controller is stable on the surfaces asked for, as its file writes them."""

from __future__ import annotations

from io import StringIO
from math import sqrt
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.certify.controller_file import AXES, flatten
from palpate.certify.discrete_loop import overshoot, runs_away_in_free_motion
from palpate.certify.upstream_laws import Admittance, CartesianImpedance, ForwardDynamics, Timing

if TYPE_CHECKING:
    from collections.abc import Iterator

    from palpate.arrays import Array
    from palpate.certify.controller_file import AxisLaw, ControllerFile, ControllerNode, Law

REPEATED_MOTION = (
    "with a position interface the solver starts each tick at the measured position, so that a motion which is "
    "measured n ticks late is repeated every n ticks"
)
MAX_OVERSHOOT = 0.08
"""Overshoot of a corrected loop on the surfaces that are tried; 10 % are promised on those between."""
SURFACES_TRIED = 17
SPARE = 1.3
"""Factor by which the stiffest surface of a correction is stiffer than asked for: room for one tick more of delay."""
NO_SETTING = (
    "no numbers were found that this rule can run at this rate and that overshoot by at most 10 % there"
)
FRANKA_ENTRY = "translational_stiffness"
"""The one entry of Franka's example: its damping follows."""


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
    wrong = {
        axis: law for axis, law, _ in laws if law is not None and not is_acceptable(law, timing, surfaces)
    }
    if any(isinstance(law, ForwardDynamics) for law in wrong.values()):
        return _correct_forward_dynamics(node, laws, timing, surfaces)
    changes: dict[str, Any] = {}
    for axis, law in wrong.items():
        better = _first_acceptable(law, axis, node, timing, surfaces)
        if isinstance(better, CartesianImpedance) and FRANKA_ENTRY in node.entries:
            changes[FRANKA_ENTRY] = better.stiffness
        elif isinstance(better, CartesianImpedance):
            changes[f"task.d_pos_{axis}"] = better.damping
        else:
            for name in ("mass", "stiffness", "damping_ratio"):
                entry = f"admittance.{name}"
                values = changes.setdefault(entry, [float(value) for value in node.entries[entry]])
                values[AXES.index(axis)] = getattr(better, name)
    return changes


def _first_acceptable(
    law: Law, axis: str, node: ControllerNode, timing: Timing, surfaces: tuple[float, float]
) -> Any:
    if isinstance(law, Admittance):
        candidates: Iterator[Law] = _admittances(law, timing, surfaces)
        reason = (
            f"along {axis}, h D/M must stay below 2, and the delay and the filter ask for a D of about their lag "
            "times the stiffness, which settles too slowly on the softest surface"
        )
    else:
        assert isinstance(law, CartesianImpedance)
        candidates = _impedances(law, follows_stiffness=FRANKA_ENTRY in node.entries)
        reason = "the torque's delay and the tick bound the damping, and the arm's mass swings on the stiffest surface"
    for better in candidates:
        if is_acceptable(better, timing, surfaces):
            return better
    raise CorrectionError(f"{NO_SETTING}: {reason}")


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
    why = f"; {REPEATED_MOTION}, whatever the gain" if timing.interface == "position" else ""
    raise CorrectionError(f"{NO_SETTING}: no smaller error_scale helps{why}")


def _impedances(law: CartesianImpedance, *, follows_stiffness: bool) -> Iterator[CartesianImpedance]:
    """Impedances of other dampings, the nearest first; softer ones where the damping follows the stiffness."""
    if follows_stiffness:
        yield from (law._replace(stiffness=float(k), damping=2.0 * sqrt(k)) for k in range(400, 0, -5))
        return
    near = law.damping * np.geomspace(1e-2, 1e3, 101) if law.damping else np.geomspace(1.0, 5e3, 101)
    near = near[np.argsort(abs(np.log(near / near[40])))]
    yield from (law._replace(damping=_rounded(d)) for d in near if d <= 5e3)


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
