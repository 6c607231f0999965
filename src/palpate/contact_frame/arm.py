"""The object that an arm touched: an identification, with the mass and stiffness of the arm itself taken off."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from palpate.errors import InputError
from palpate.identification import Code, Identification, Parameter, Verdict, Warn
from palpate.signals.types import NORMAL
from palpate.units import GRAVITY


@dataclass(frozen=True)
class ArmDynamics:
    """Mass and stiffness between the sensors and the surface.

    Args:
        tool_mass: mass between the force sensor and the surface and its standard deviation [kg]; None if not known.
        stiffness: of the arm between the position sensors and the surface, with its std [N/m]; None if not known.
        mass: of the arm's tip before the force sensor, which swings on that stiffness, with its std [kg].
        position_from: source of the position: encoders in the `joints`, or a sensor of the `tip`.

    Raises:
        InputError: a negative mass, or one that no stiffness holds.
    """

    tool_mass: tuple[float, float] | None = None
    stiffness: tuple[float, float] | None = None
    mass: tuple[float, float] | None = None
    position_from: Literal["joints", "tip"] | None = None

    def __post_init__(self) -> None:
        if self.tool_mass is not None and not (self.tool_mass[0] >= 0 and self.tool_mass[1] >= 0):
            raise InputError(
                f"the tool's mass must be 0 kg or more, got {self.tool_mass[0]:g}:{self.tool_mass[1]:g}"
            )
        if self.mass is not None and not (self.mass[0] >= 0 and self.mass[1] >= 0):
            raise InputError(f"the robot's mass must be 0 kg or more, got {self.mass[0]:g}:{self.mass[1]:g}")


def arm_meta(arm: ArmDynamics) -> dict[str, Any]:
    """Properties of the arm, as plain values."""
    return {
        "tool_mass_kg": list(arm.tool_mass) if arm.tool_mass else None,
        "robot_stiffness_N_per_m": list(arm.stiffness) if arm.stiffness else None,
        "robot_mass_kg": list(arm.mass) if arm.mass else None,
        "position_from": arm.position_from,
    }


LOWER_BOUND = "a lower bound of the surface's stiffness"
"""Begins the reason of a K that holds the arm's own compliance."""
_COMPLIANCE_MATTERS = 1000.0
"""Above this an arm's own compliance, of 20 to 100 kN/m in a light one, takes more than some percent [N/m]."""


def with_arm(
    identification: Identification, arm: ArmDynamics, tolerance: float, *, from_pose: bool
) -> Identification:
    """An identification with the tool's mass taken out of M, and K bounded where the arm's compliance is in it.

    Args:
        identification: of force and position as they were measured.
        arm: what is known of it.
        tolerance: largest half-width of an identified parameter's 95 % interval, as a share of its value.
        from_pose: the position is that of a pose, which most drivers make from the joints' encoders.
    """
    parameters = dict(identification.parameters)
    if "M" in parameters and parameters["M"].unit == "kg":
        parameters["M"] = _explain_negative_mass(_subtract_tool_mass(parameters["M"], arm, tolerance), arm)
    warnings = list(identification.warnings)
    point = identification.working_point
    warning = _compliance_warning(parameters, arm, from_pose)
    if warning is not None:
        warnings.append(warning)
        if arm.position_from == "joints":
            parameters["K"] = _lower_bound(parameters["K"])
            point = point and replace(point, stiffness=_lower_bound(point.stiffness))
    return replace(identification, parameters=parameters, working_point=point, warnings=tuple(warnings))


def robot_stiffness(wall: Identification, name: str) -> tuple[float, float]:
    """The stiffness of an arm by its press on a rigid wall: all that gave way was the arm.

    Args:
        wall: the identification of that press.
        name: of the log.

    Returns:
        Stiffness and standard deviation [N/m].

    Raises:
        InputError: that log does not show it.
    """
    stiffness = wall.parameters.get("K")
    if stiffness is None or stiffness.value is None or stiffness.std is None or stiffness.unit != "N/m":
        reason = stiffness.reason if stiffness else f"{wall.model} has no K"
        raise InputError(
            f"{name} does not show the robot's stiffness: {reason}; press harder on something rigid"
        )
    return stiffness.value, stiffness.std


def _subtract_tool_mass(mass: Parameter, arm: ArmDynamics, tolerance: float) -> Parameter:
    """M of the environment alone; said to be that of both, if the tool's is not known."""
    if arm.tool_mass is None:
        if mass.value is None:
            return mass
        return replace(
            mass, reason=f"environment + tool beyond the force sensor (--tool-mass); {mass.reason}"
        )
    tool, tool_std = arm.tool_mass
    if not (tool or tool_std):
        return mass
    if mass.ci95 is None or (mass.value is None and mass.verdict is Verdict.REJECTED):
        return replace(
            mass, ci95=None, reason=f"{mass.reason}; the tool's {tool:.3g} kg are not taken off yet"
        )
    value = (mass.ci95[0] + mass.ci95[1]) / 2 - tool
    half = float(np.hypot((mass.ci95[1] - mass.ci95[0]) / 2, NORMAL * tool_std))
    std = half / NORMAL
    low = value - half
    high = value + half
    correction = f"the tool's {tool:.3g} kg taken off"
    if low <= 0 <= high:
        bounds = f"95 %: {low:.3g} to {high:.3g} {mass.unit}"
        reason = f"{correction}, the log does not show the environment's ({bounds})"
        return Parameter(None, None, (low, high), mass.unit, Verdict.NOT_IDENTIFIABLE, reason)
    if high < 0:
        reason = f"{correction}, {value:.3g} kg are left, below zero: is the tool that heavy?"
        return Parameter(None, None, None, mass.unit, Verdict.REJECTED, reason)
    if mass.verdict is Verdict.IDENTIFIED and half > tolerance * value:
        reason = f"{correction}, the interval is wider than {tolerance:.0%}"
        return Parameter(value, std, (low, high), mass.unit, Verdict.NOT_IDENTIFIABLE, reason)
    return Parameter(value, std, (low, high), mass.unit, mass.verdict, f"{correction}; {mass.reason}")


def _explain_negative_mass(mass: Parameter, arm: ArmDynamics) -> Parameter:
    """M below zero, as caused by an undeclared swinging mass of the arm."""
    if arm.stiffness is None or arm.mass is not None or "below zero" not in mass.reason:
        return mass
    why = "the arm's mass m swings on its own stiffness k and counts as -K m/k: give --robot-mass"
    return replace(mass, reason=f"{mass.reason}; {why}")


def _compliance_warning(
    parameters: Mapping[str, Parameter], arm: ArmDynamics, from_pose: bool
) -> Warn | None:
    """Warning about an arm of unknown compliance."""
    stiffness = parameters.get("K")
    if arm.stiffness is not None or arm.position_from == "tip" or stiffness is None:
        return None
    if arm.position_from == "joints":
        text = (
            "the position is that of the joints' encoders, so the arm gives way in series with the surface, and K is of"
            " both; give --robot-stiffness, or a press on a rigid wall with --robot-stiffness-from"
        )
        return Warn(Code.SERIES_COMPLIANCE, text)
    if (
        from_pose
        and stiffness.unit == "N/m"
        and stiffness.value is not None
        and stiffness.value > _COMPLIANCE_MATTERS
    ):
        text = (
            "a pose made from the joints' encoders does not show how the arm gives way: then say --position-from joints"
            " and --robot-stiffness; if something sees the tip itself, say --position-from tip"
        )
        return Warn(Code.SERIES_COMPLIANCE, text)
    return None


def _lower_bound(stiffness: Parameter) -> Parameter:
    """A high K of an arm of unknown stiffness is a lower bound."""
    if (
        stiffness.value is None
        or stiffness.ci95 is None
        or stiffness.value < _COMPLIANCE_MATTERS
        or stiffness.unit != "N/m"
    ):
        return stiffness
    reason = (
        f"{LOWER_BOUND}, at least {stiffness.ci95[0]:.4g} {stiffness.unit}: the arm's own compliance is in it; give"
        " --robot-stiffness"
    )
    return replace(stiffness, verdict=Verdict.NOT_IDENTIFIABLE, reason=reason)


_MAX_LEVER_ERROR = 0.01
"""Largest distance of the line of action from the point that touches [m]. A probe touches off its point by its radius,
some millimetres; a lever arm that is given wrongly is off by centimetres."""


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
    weight = float(np.linalg.norm(about["weight_N"]))
    std = about["weight_std_N"]
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
    doubt = "; are --tcp, --wrench-at and --wrench-frame right?" if off > _MAX_LEVER_ERROR else ""
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
