"""Identification of an arm's log: projected on the contact's normal, with the arm's own mass and compliance removed."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from palpate.contact_frame.arm import with_arm
from palpate.contact_frame.declared import Arm, ContactFrame
from palpate.contact_frame.free_motion.inertia import wrong_sign, wrong_sign_of
from palpate.contact_frame.projecting import project
from palpate.contact_frame.signals_in_base import FORCE
from palpate.errors import InputError
from palpate.identification import Code, Identification, Parameter, Verdict, Warn, identify
from palpate.records import Record


def identify_contact(
    record: Record,
    frame: ContactFrame | None = None,
    arm: Arm | None = None,
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
    arm = arm or Arm()
    arm = replace(
        arm,
        position_from=arm.position_from or record.meta.get("position_from"),
        tool_mass=arm.tool_mass or record.meta.get("tool_mass_kg"),
        stiffness=arm.stiffness or record.meta.get("robot_stiffness_N_per_m"),
        mass=arm.mass or record.meta.get("robot_mass_kg"),
    )
    spread, inertia = 0.0, record.meta.get("tool_inertia_kg")
    in_space = FORCE[0] in record.columns
    if in_space:
        record = project(record, frame or ContactFrame())
        spread, inertia = (record.meta["contact_frame"][name] for name in ("scale_std", "air_inertia_kg"))
    elif inertia is not None and wrong_sign(inertia):
        record = _note_inertia_sign(record, inertia)
    if arm.stiffness is not None:
        options |= {"series_stiffness": arm.stiffness[0], "series_std": arm.stiffness[1]}
        options["series_mass"] = arm.mass
    elif arm.mass is not None:
        raise InputError("the robot's mass swings on the robot's own stiffness: give --robot-stiffness too")
    scale = float(np.hypot(calibration, spread))
    found = identify(record, tolerance=tolerance, calibration=scale, **options)
    if in_space and not record.meta["contact_frame"]["normal_shown"]:
        found = _refuse_direction(found)
    if in_space and Code.NO_CONTACT.word in found.codes:
        found, record = _all_free(found, record)
    if wrong_sign(inertia):
        found = _mistaken(found)
    about = _about(arm) | {"force_filter": str(options.get("force_filter") or "none")}
    record = replace(record, meta={**record.meta, "arm": about})
    return with_arm(found, arm, tolerance, from_pose=in_space), record


def _note_inertia_sign(record: Record, inertia: tuple[float, float]) -> Record:
    """A record whose tool's inertia was weighed with the wrong sign says so."""
    note = {"code": Code.TOOL_INERTIA.word, "text": wrong_sign_of(inertia)}
    return replace(record, meta={**record.meta, "notes": [*record.meta.get("notes", ()), note]})


def _refuse_direction(found: Identification) -> Identification:
    """If the force has no direction, a fit along any direction is chance."""
    reason = "the force has no direction, so there seems to be no contact"
    refused = {
        name: Parameter(None, None, None, p.unit, Verdict.NOT_IDENTIFIABLE, reason)
        for name, p in found.parameters.items()
    }
    warnings = [warn for warn in found.warnings if warn.code is not Code.NO_CONTACT]
    return replace(found, parameters=refused, warnings=(*warnings, Warn(Code.NO_CONTACT, reason)))


def _mistaken(found: Identification) -> Identification:
    """A contact alone cannot separate a mass compensated with the wrong sign from a lag and a damping."""
    reason = "the tool's inertia is in the force with the wrong sign (tool-inertia), which a damping and a lag hide"
    refused = {
        name: replace(p, verdict=Verdict.REJECTED, value=None, std=None, ci95=None, reason=reason)
        for name, p in found.parameters.items()
        if name in {"B", "M"}
    }
    return replace(found, parameters={**found.parameters, **refused})


def _all_free(found: Identification, record: Record) -> tuple[Identification, Record]:
    """Where nothing is touched, there is no contact that the log could begin in, no normal and no side of a force."""
    about = {**record.meta["contact_frame"], "untouched": True}
    warnings = tuple(
        w for w in found.warnings if w.code not in (Code.CONTACT_AT_START, Code.NORMAL_UNCERTAIN)
    )
    return replace(found, warnings=warnings), replace(record, meta={**record.meta, "contact_frame": about})


def _about(arm: Arm) -> dict[str, Any]:
    """Properties of the arm, as plain values."""
    return {
        "tool_mass_kg": list(arm.tool_mass) if arm.tool_mass else None,
        "robot_stiffness_N_per_m": list(arm.stiffness) if arm.stiffness else None,
        "robot_mass_kg": list(arm.mass) if arm.mass else None,
        "position_from": arm.position_from,
    }
