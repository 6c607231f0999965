"""The road from an arm's record to an identification: the press or slide in it, and the arm's own part taken off."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from palpate.contact_frame.arm import ArmDynamics, arm_meta, with_arm
from palpate.contact_frame.signals_in_base import FORCE, ContactFrame, base_signals
from palpate.errors import InputError
from palpate.identification import Code, Identification, Parameter, Verdict, Warn, identify
from palpate.records import Record


def identify_contact(
    record: Record,
    frame: ContactFrame | None = None,
    arm: ArmDynamics | None = None,
    *,
    tolerance: float = 0.25,
    calibration: float = 0.0,
    **options: Any,
) -> tuple[Identification, Record]:
    """Find what an arm touched.

    Args:
        record: force and position, or wrench and pose, over time.
        frame: how wrench and pose stand to each other and to the surface; not for a record of one axis.
        arm: mass and stiffness between the sensors and the surface.
        tolerance: largest half-width of an identified parameter's 95 % interval, as a share of its value.
        calibration: relative standard deviation of the scales of force and position together.
        options: of `palpate.identify`.

    Returns:
        The identification, and the record along the normal that it is of.

    Raises:
        InputError: the record or an argument is wrong, in one line.
    """
    arm = _with_recorded_arm(arm or ArmDynamics(), record.meta)
    normal_std = 0.0
    inertia = record.meta.get("tool_inertia_kg")
    in_space = FORCE[0] in record.columns
    if in_space:
        from palpate.contact_frame.projecting import project

        recorded = record
        record = project(record, frame or ContactFrame())
        normal_std, inertia = (
            record.meta["contact_frame"][name] for name in ("scale_std", "free_inertia_kg")
        )
    elif inertia is not None:
        record = _note_inertia_sign(record, inertia)
    if arm.stiffness is not None:
        options |= {"series_stiffness": arm.stiffness[0], "series_std": arm.stiffness[1]}
        options["series_mass"] = arm.mass
    elif arm.mass is not None:
        raise InputError("the robot's mass swings on the robot's own stiffness: give --robot-stiffness too")
    scale = float(np.hypot(calibration, normal_std))
    result = identify(record, tolerance=tolerance, calibration=scale, **options)
    if in_space and not record.meta["contact_frame"]["normal_shown"]:
        result = _refuse_direction(result)
    if in_space and Code.NO_CONTACT.word in result.codes:
        result, record = _without_contact(result, record)
    if inertia is not None:
        result = _reject_wrong_inertia(result, inertia)
    about = arm_meta(arm) | {"force_filter": str(options.get("force_filter") or "none")}
    record = replace(record, meta={**record.meta, "arm": about})
    result = with_arm(result, arm, tolerance, from_pose=in_space)
    slide = None
    if in_space:
        from palpate.contact_frame.slide_friction import slide_in

        placed = frame or ContactFrame()
        slide = slide_in(base_signals(recorded, placed), placed, arm, tolerance, calibration, result, record)
    if slide is None or slide.slide is None:
        return slide or result, record
    meta = {key: value for key, value in record.meta.items() if key != "contact_frame"}  # of a press
    return slide, replace(record, meta=meta)


def _with_recorded_arm(arm: ArmDynamics, recorded: Mapping[str, Any]) -> ArmDynamics:
    """An arm with what its record says of it; what is given goes first."""
    return replace(
        arm,
        position_from=arm.position_from or recorded.get("position_from"),
        tool_mass=arm.tool_mass or recorded.get("tool_mass_kg"),
        stiffness=arm.stiffness or recorded.get("robot_stiffness_N_per_m"),
        mass=arm.mass or recorded.get("robot_mass_kg"),
    )


def _note_inertia_sign(record: Record, inertia: tuple[float, float]) -> Record:
    """A record whose tool's inertia was weighed with the wrong sign says so."""
    from palpate.contact_frame.free_motion import has_wrong_sign, wrong_sign_text

    if not has_wrong_sign(inertia):
        return record
    note = {"code": Code.TOOL_INERTIA.word, "text": wrong_sign_text(inertia)}
    return replace(record, meta={**record.meta, "notes": [*record.meta.get("notes", ()), note]})


def _refuse_direction(result: Identification) -> Identification:
    """Refuse every parameter of a log whose force has no direction: a fit along any direction is chance."""
    reason = "the force has no direction, so there seems to be no contact"
    refused = {
        name: Parameter(None, None, None, p.unit, Verdict.NOT_IDENTIFIABLE, reason)
        for name, p in result.parameters.items()
    }
    warnings = [warn for warn in result.warnings if warn.code is not Code.NO_CONTACT]
    return replace(result, parameters=refused, warnings=(*warnings, Warn(Code.NO_CONTACT, reason)))


def _reject_wrong_inertia(result: Identification, inertia: tuple[float, float]) -> Identification:
    """A contact alone cannot separate a mass compensated with the wrong sign from a lag and a damping."""
    from palpate.contact_frame.free_motion import has_wrong_sign

    if not has_wrong_sign(inertia):
        return result
    reason = "the tool's inertia is in the force with the wrong sign (tool-inertia), which a damping and a lag hide"
    refused = {
        name: replace(p, verdict=Verdict.REJECTED, value=None, std=None, ci95=None, reason=reason)
        for name, p in result.parameters.items()
        if name in {"B", "M"}
    }
    return replace(result, parameters={**result.parameters, **refused})


def _without_contact(result: Identification, record: Record) -> tuple[Identification, Record]:
    """Remove what only a contact has: a beginning in contact, a normal, a sign of the force."""
    about = {**record.meta["contact_frame"], "untouched": True}
    warnings = tuple(
        w for w in result.warnings if w.code not in (Code.CONTACT_AT_START, Code.NORMAL_UNCERTAIN)
    )
    return replace(result, warnings=warnings), replace(record, meta={**record.meta, "contact_frame": about})
