"""Declared and estimated properties of an arm's log, in sentences."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from palpate.units import GRAVITY

_FAR = 0.01
"""Of a line of action from the point that touches [m]: a probe touches off its point by its radius, some millimetres;
a lever arm that is told wrong is off by centimetres."""


def describe(meta: Mapping[str, Any]) -> list[str]:
    """Sentences for a user, from the metadata of a record along the normal."""
    lines = list(meta.get("facts", ()))
    about = meta.get("contact_frame")
    if about and about.get("untouched"):
        lines.append("free motion only: this log gives no normal and no sign of the force")
    elif about:
        lines += [_wrench(about), _normal(about), _load(about), *_lever(about)]
    return lines + _arm(meta.get("arm") or {})


def _wrench(about: Mapping[str, Any]) -> str:
    side = {
        "action": "from the tool on the surface",
        "reaction": "from the surface on the tool",
    }
    sign = side[about["force_sign"]] + ("" if about["force_sign_said"] else " (found)")
    axes = (
        f"wrench in the {about['wrench_frame']}'s axes{'' if about['wrench_frame_said'] else ' (concluded)'}"
    )
    if about["sensor_rpy_rad"]:
        axes += f", turned by {_list_words(np.degrees(about['sensor_rpy_rad']))} deg"
    if any(about["tcp_m"]):
        axes += f"; the tool touches at {_list_words(1e3 * np.array(about['tcp_m']))} mm"
    return f"{axes}; {sign}"


def _normal(about: Mapping[str, Any]) -> str:
    normal = f"normal into the surface {_list_words(about['normal'])} in the base"
    if not about["normal_found"]:
        return f"{normal}, as given"
    std = np.degrees(about["normal_std_rad"])
    return f"{normal}, found from the force (std {std:.2g} deg), which adds {100 * about['scale_std']:.2g} % to K, B, M"


def _load(about: Mapping[str, Any]) -> str:
    if not about["free_rows"] and not about.get("payload_said"):
        return "no free motion: bias and weight are not known"
    if about["weight_N"] is None:
        what = "bias" if about["gravity_compensated"] else "bias and weight together"
        return f"{what} {_list_words(about['bias_N'])} N in the tool's axes (std {about['load_std_N']:.2g} N)"
    weight, std = float(np.linalg.norm(about["weight_N"])), about["weight_std_N"]
    if about.get("payload_said"):
        return (
            f"tool's weight {weight:.3g} N (std {std:.2g} N) by the payload file; bias {_list_words(about['bias_N'])} N"
            f"{'' if about['free_rows'] else ' by the same, as the log has no free motion'}"
        )
    mass = f"--tool-mass {weight / GRAVITY:.3g}:{std / GRAVITY:.1g} would subtract its inertia from M"
    return f"tool's weight {weight:.3g} N (std {std:.2g} N; {mass}); bias {_list_words(about['bias_N'])} N"


def _lever(about: Mapping[str, Any]) -> list[str]:
    off = about["line_of_action_off_m"]
    if off is None:
        return []
    doubt = "; are --tcp, --wrench-at and --wrench-frame right?" if off > _FAR else ""
    return [f"the force passes {1e3 * off:.2g} mm from the tool centre point, by the torque{doubt}"]


def _arm(arm: Mapping[str, Any]) -> list[str]:
    lines = []
    if arm.get("robot_stiffness_N_per_m"):
        value, std = arm["robot_stiffness_N_per_m"]
        lines.append(f"the arm's own {value:.4g} N/m (std {std:.2g}) are taken out of K")
    if any(arm.get("robot_mass_kg") or ()):
        value, std = arm["robot_mass_kg"]
        lines.append(f"the arm's {value:.3g} kg (std {std:.2g}) swing on that, which is taken out of M")
    if any(arm.get("tool_mass_kg") or ()):
        value, std = arm["tool_mass_kg"]
        lines.append(f"the tool's {value:.3g} kg (std {std:.2g}) are taken out of M")
    if arm.get("position_from"):
        lines.append(f"position from the {arm['position_from']}")
    if arm.get("force_filter", "none") != "none":
        lines.append(
            f"force filtered by {arm['force_filter']} before it was sampled; the position goes through the same"
        )
    return lines


def _list_words(values: Sequence[float] | np.ndarray[Any, Any]) -> str:
    return "(" + ", ".join(f"{value:.3g}" if abs(value) > 1e-9 else "0" for value in values) + ")"
