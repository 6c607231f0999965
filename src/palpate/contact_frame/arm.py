"""The arm's effect on the numbers: the tool's mass beyond the sensor, and the arm's own compliance."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from palpate.contact_frame.declared import Arm
from palpate.errors import InputError
from palpate.identification import Code, Identification, Parameter, Verdict, Warn

LOWER_BOUND = "a lower bound of the surface's stiffness"
"""Begins the reason of a K that holds the arm's own compliance."""
_STIFF = 1000.0
"""Above this an arm's own compliance, of 20 to 100 kN/m in a light one, takes more than some percent [N/m]."""


def with_arm(found: Identification, arm: Arm, tolerance: float, *, from_pose: bool) -> Identification:
    """An identification with the tool's mass taken out of M, and K bounded where the arm's compliance is in it.

    Args:
        found: of force and position as they were measured.
        arm: what is known of it.
        tolerance: largest half-width of an identified parameter's 95 % interval, as a share of its value.
        from_pose: the position is that of a pose, which most drivers make from the joints' encoders.
    """
    parameters = dict(found.parameters)
    if "M" in parameters and parameters["M"].unit == "kg":
        parameters["M"] = _of_swing(_without_tool(parameters["M"], arm, tolerance), arm)
    warnings, point = list(found.warnings), found.working_point
    warning = _compliance(parameters, arm, from_pose)
    if warning is not None:
        warnings.append(warning)
        if arm.position_from == "joints":
            parameters["K"] = _lower_bound(parameters["K"])
            point = point and replace(point, stiffness=_lower_bound(point.stiffness))
    return replace(found, parameters=parameters, working_point=point, warnings=tuple(warnings))


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


def _without_tool(mass: Parameter, arm: Arm, tolerance: float) -> Parameter:
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
    half = float(np.hypot((mass.ci95[1] - mass.ci95[0]) / 2, 1.96 * tool_std))
    std, low, high = half / 1.96, value - half, value + half
    taken = f"the tool's {tool:.3g} kg taken off"
    if low <= 0 <= high:
        bounds = f"95 %: {low:.3g} to {high:.3g} {mass.unit}"
        reason = f"{taken}, the log does not show the environment's ({bounds})"
        return Parameter(None, None, (low, high), mass.unit, Verdict.NOT_IDENTIFIABLE, reason)
    if high < 0:
        reason = f"{taken}, {value:.3g} kg are left, below zero: is the tool that heavy?"
        return Parameter(None, None, None, mass.unit, Verdict.REJECTED, reason)
    if mass.verdict is Verdict.IDENTIFIED and half > tolerance * value:
        reason = f"{taken}, the interval is wider than {tolerance:.0%}"
        return Parameter(value, std, (low, high), mass.unit, Verdict.NOT_IDENTIFIABLE, reason)
    return Parameter(value, std, (low, high), mass.unit, mass.verdict, f"{taken}; {mass.reason}")


def _of_swing(mass: Parameter, arm: Arm) -> Parameter:
    """M below zero, as caused by an undeclared swinging mass of the arm."""
    if arm.stiffness is None or arm.mass is not None or "below zero" not in mass.reason:
        return mass
    why = "the arm's mass m swings on its own stiffness k and counts as -K m/k: give --robot-mass"
    return replace(mass, reason=f"{mass.reason}; {why}")


def _compliance(parameters: Mapping[str, Parameter], arm: Arm, from_pose: bool) -> Warn | None:
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
    if from_pose and stiffness.unit == "N/m" and stiffness.value is not None and stiffness.value > _STIFF:
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
        or stiffness.value < _STIFF
        or stiffness.unit != "N/m"
    ):
        return stiffness
    reason = (
        f"{LOWER_BOUND}, at least {stiffness.ci95[0]:.4g} {stiffness.unit}: the arm's own compliance is in it; give"
        " --robot-stiffness"
    )
    return replace(stiffness, verdict=Verdict.NOT_IDENTIFIABLE, reason=reason)
