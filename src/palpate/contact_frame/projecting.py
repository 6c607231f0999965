"""A record in three dimensions projected on the contact's normal.

A check of lever arm, axes and torque says whether the force passes through the point that is said to touch. The arm's
own mass and compliance are removed.
"""

from typing import Any

import numpy as np

from palpate.arrays import Array, Mask
from palpate.contact_frame import free_motion
from palpate.contact_frame.load import NOTABLE_SCALE_STD, Normal, fit_load, main_axis, scale_std, turns
from palpate.contact_frame.signals_in_base import (
    BaseSignals,
    CompensatedForce,
    ContactFrame,
    base_signals,
    compensate,
)
from palpate.errors import InputError
from palpate.identification import Identification, Verdict
from palpate.records import Record

_MIN_FORCE_RATIO = 0.3
"""Smallest force whose line of action is used, as a fraction of the largest: there the line is three times as
uncertain, for the same noise of the torque."""


def line_misses_tcp(signals: BaseSignals, free: Mask, inside: Mask, frame: ContactFrame) -> float | None:
    """Distance of the contact force's line of action from the tool centre point [m]; the median over the contact.

    A force f at r gives the torque r x f about the point that the torque is about, so the line is at
    |f x (tau - r x f)| / |f|^2 from r. None without a torque, or where the log does not show its bias.

    Args:
        signals: force and torque in the tool's axes.
        free: rows in which nothing is touched, shape (n,).
        inside: rows in contact, shape (n,).
        frame: the lever arm.
    """
    if signals.torque is None:
        return None
    finite = free_motion.finite_rows(signals.force) & free_motion.finite_rows(signals.torque)
    free = free & finite
    inside = inside & finite
    if (
        free.sum() < free_motion.MIN_ROWS
        or inside.sum() < free_motion.MIN_ROWS
        or not np.ptp(signals.torque[finite])
    ):
        return None
    force = signals.force[inside] - signals.force[free].mean(axis=0)
    torque = signals.torque[inside] - signals.torque[free].mean(axis=0)
    size = np.linalg.norm(force, axis=1)
    strong = size > _MIN_FORCE_RATIO * size.max()
    lever = np.array(frame.tcp) - np.array(frame.wrench_at)
    remaining_torque = torque[strong] - np.cross(lever, force[strong])
    return float(
        np.median(np.linalg.norm(np.cross(force[strong], remaining_torque), axis=1) / size[strong] ** 2)
    )


_MIN_CORRELATION = 0.65
"""Correlation that noise shows once in a thousand logs of twenty independent rows (Student's t with 18 degrees)."""


def project(record: Record, frame: ContactFrame) -> Record:
    """Force and position along the contact's normal, of a wrench and a pose.

    The point that touches is p + R tcp, with the pose p, R; the force's weight and bias are those of the free rows; the
    normal is given, or the direction in which the force changes. Position grows into the surface, and the force is
    positive when it presses.

    Args:
        record: with `time`, `force_x`, ..., `position_x`, ..., and where there are some `torque_x`, ...,
            `quaternion_x`, ..., `quaternion_w`; as `palpate.logs.read_wrench_and_pose` gives it.
        frame: as declared by the user.

    Returns:
        A record with `time` [s], `position` [m] and `force` [N]. Its `meta["contact_frame"]` holds what was declared
        and found; its `scale_std` is what the normal's uncertainty adds to K, B and M, as `identify(calibration=...)`.

    Raises:
        InputError: the declaration does not fit the record.
    """
    signals = base_signals(record, frame)
    signals, compensated, notes = compensate(signals, frame)
    normal = _normal(signals, compensated, frame)
    sign, normal, alerts = _orient(signals, compensated, normal, frame)
    position = (
        signals.position - signals.position[free_motion.finite_rows(signals.position)][0]
    ) @ normal.direction
    normal_scale_std = scale_std(normal, *_in_contact(signals, compensated))
    inertia = _inertia_in_free_motion(signals, compensated, sign, frame)
    notes += (
        alerts
        + _warnings(signals, compensated, normal, normal_scale_std)
        + _payload_warnings(compensated, signals, frame, inertia)
    )
    about = _summarize(signals, compensated, normal, sign, frame) | {
        "scale_std": normal_scale_std,
        "free_inertia_kg": inertia,
    }
    meta = {**record.meta, "contact_frame": about, "notes": [*record.meta.get("notes", ()), *notes]}
    columns = {
        "time": signals.time,
        "position": position,
        "force": sign * compensated.force @ normal.direction,
    }
    return Record(columns, {"time": "s", "position": "m", "force": "N"}, meta)


def _normal(signals: BaseSignals, compensated: CompensatedForce, frame: ContactFrame) -> Normal:
    if frame.normal is None:
        direction, std = main_axis(compensated.force[compensated.finite])
        return Normal(direction, std, estimated=True)
    direction = np.array(frame.normal) / np.linalg.norm(frame.normal)
    if frame.normal_frame == "tool":
        rows = compensated.inside if compensated.inside.any() else compensated.finite
        direction = (signals.rotations[rows] @ direction).mean(axis=0)
        direction /= np.linalg.norm(direction)
    return Normal(direction, 0.0, estimated=False)


def _in_contact(signals: BaseSignals, compensated: CompensatedForce) -> tuple[Array, Array]:
    """Forces and places in contact; of the whole log where there is none."""
    rows = (
        compensated.inside
        if (compensated.inside & compensated.finite).sum() > 1
        else np.ones(len(compensated.inside), bool)
    )
    placed = free_motion.finite_rows(signals.position)
    return compensated.force[rows & compensated.finite], signals.position[rows & placed]


def _orient(
    signals: BaseSignals, compensated: CompensatedForce, normal: Normal, frame: ContactFrame
) -> tuple[float, Normal, list[dict[str, Any]]]:
    """The sign that makes the force act from the tool on the surface, and the normal into the surface."""
    correlation = _correlation(signals, compensated, normal.direction)
    sign = {"action": 1.0, "reaction": -1.0, None: -1.0 if correlation < 0 else 1.0}[frame.force_sign]
    if frame.force_sign is not None and compensated.free.any() and sign * correlation < -_MIN_CORRELATION:
        opposite = "reaction" if frame.force_sign == "action" else "action"
        raise InputError(
            f"the wrench was declared to be the {frame.force_sign}, but falls as the tool goes in: say --force-sign"
            f" {opposite}, or check --wrench-frame and --normal"
        )
    press = sign * _mean_press(signals, compensated, normal.direction)
    if press >= 0:
        return sign, normal, []
    reversed_normal = Normal(-normal.direction, normal.std, normal.estimated)
    if normal.estimated:
        return sign, reversed_normal, []
    text = "the given normal points out of the surface; it was reversed"
    return sign, reversed_normal, [{"code": "position-sign-reversed", "text": text}]


def _correlation(signals: BaseSignals, compensated: CompensatedForce, direction: Array) -> float:
    """Correlation of force and position along a direction, in contact; the same for the opposite direction."""
    rows = (compensated.inside if compensated.inside.any() else compensated.finite) & compensated.finite
    placed = free_motion.finite_rows(signals.position)
    position = np.interp(signals.time[rows], signals.time[placed], signals.position[placed] @ direction)
    force = compensated.force[rows] @ direction
    if len(force) < 2 or not (np.ptp(position) and np.ptp(force)):
        return 0.0
    return float(np.corrcoef(position, force)[0, 1])


def _mean_press(signals: BaseSignals, compensated: CompensatedForce, direction: Array) -> float:
    """Mean force along a direction in contact less that in free motion [N]; 0 if the tool never leaves."""
    inside = compensated.inside & compensated.finite
    if not (compensated.free.any() and inside.any()):
        return 0.0
    return float(
        (compensated.force[inside].mean(axis=0) - compensated.force[compensated.free].mean(axis=0))
        @ direction
    )


def _warnings(
    signals: BaseSignals, compensated: CompensatedForce, normal: Normal, normal_scale_std: float
) -> list[dict[str, Any]]:
    notes = []
    if signals.guess:
        notes.append({"code": "frame-guess", "text": f"{signals.guess}; say --wrench-frame if it is not so"})
    if not normal.shown:
        text = "the force changes equally in all directions, so the normal is unknown: is there contact?"
        notes.append({"code": "normal-uncertain", "text": text})
    elif normal_scale_std > NOTABLE_SCALE_STD:
        text = (
            f"the normal is known to {np.degrees(normal.std):.2g} deg about each axis (one std), which leaves K, B and"
            f" M uncertain by {normal_scale_std:.2g} of their value; give --normal"
        )
        notes.append({"code": "normal-uncertain", "text": text})
    if not compensated.free.any():
        text = (
            "no free motion in the log: the force's bias, the tool's weight and the surface's position cannot be told"
            " apart, and none of them is given"
        )
        notes.append({"code": "contact-at-start", "text": text})
    return notes


def _inertia_in_free_motion(
    signals: BaseSignals, compensated: CompensatedForce, sign: float, frame: ContactFrame
) -> tuple[float, float] | None:
    """The mass by which the force follows the acceleration before the touch, and its std [kg].

    The tool's force on its sensor is m (g - a) minus its force on the surface: the reaction.
    """
    payload = frame.payload
    centre = payload.centre if payload is not None and payload.centre is not None else (0.0, 0.0, 0.0)
    off = np.array(frame.wrench_at) + np.array(centre) - np.array(frame.tcp)
    return free_motion.free_inertia(
        signals.time, -sign * compensated.force, signals.position + signals.rotations @ off, compensated.free
    )


def _payload_warnings(
    compensated: CompensatedForce,
    signals: BaseSignals,
    frame: ContactFrame,
    inertia: tuple[float, float] | None,
) -> list[dict[str, Any]]:
    """Contradictions between the free rows and the compensated or weighed tool."""
    from scipy.special import chdtri

    notes = []
    if free_motion.has_wrong_sign(inertia):
        assert inertia is not None
        notes.append({"code": "tool-inertia", "text": free_motion.wrong_sign_text(inertia)})
    free = compensated.free
    if frame.payload is None or not free.any() or not turns(signals.rotations[free]):
        return notes
    fitted = fit_load(signals.force[free], signals.rotations[free], weighs=True)
    off = float(np.linalg.norm(fitted.weight - np.array(frame.payload.weight)))
    if fitted.separable and off > float(chdtri(3, free_motion.FALSE_ALARM_RATE)) ** 0.5 * float(
        np.hypot(fitted.weight_std, frame.payload.weight_std)
    ):
        text = (
            f"the free rows weigh {off:.2g} N otherwise than the payload file says: is it of another tool, of a pose of"
            " another frame, or is the sensor saturated?"
        )
        notes.append({"code": "payload-doubtful", "text": text})
    return notes


def _summarize(
    signals: BaseSignals, compensated: CompensatedForce, normal: Normal, sign: float, frame: ContactFrame
) -> dict[str, Any]:
    """Declared and estimated properties, as plain values."""
    load = compensated.load
    return {
        "wrench_frame": signals.wrench_frame,
        "wrench_frame_said": frame.wrench_frame is not None,
        "sensor_rpy_rad": list(frame.sensor_rpy) if frame.sensor_rpy else None,
        "tcp_m": list(frame.tcp),
        "wrench_at_m": list(frame.wrench_at),
        "force_sign": "action" if sign > 0 else "reaction",
        "force_sign_said": frame.force_sign is not None,
        "gravity_compensated": frame.gravity_compensated,
        "normal": normal.direction.tolist(),
        "normal_found": normal.estimated,
        "normal_std_rad": normal.std,
        "normal_shown": normal.shown,
        "free_said_s": list(frame.free) if frame.free else None,
        "payload_said": frame.payload is not None,
        "free_rows": int(compensated.free.sum()),
        "bias_N": load.bias.tolist(),
        "weight_N": load.weight.tolist() if load.separable else None,
        "weight_std_N": load.weight_std if load.separable else None,
        "load_std_N": load.std,
        "line_of_action_off_m": line_misses_tcp(signals, compensated.free, compensated.inside, frame),
    }


def residual_of_press(
    press: Identification, about: dict[str, Any], time: Array, position: Array, velocity: Array, force: Array
) -> Array:
    """The force that a press leaves unexplained [N], shape (n, 3): along the normal by K, depth and speed, else whole.

    Each contact, and free motion, begins from a force of its own. A K that is not identified is fitted here.

    Args:
        press: its contacts and K.
        about: its normal and sign, as `project` gives them in `meta`.
        time: [s], shape (n,).
        position: of the tip in the base [m], shape (n, 3).
        velocity: likewise [m/s].
        force: in the base, of either sign [N], shape (n, 3).
    """
    n = np.array(about["normal"])
    force = force if about["force_sign"] == "action" else -force
    contact = np.zeros(len(time), int)
    for i, (start, end) in enumerate(press.contacts):
        contact[(time >= start) & (time <= end)] = i + 1
    begins = np.equal.outer(contact, np.unique(contact)).astype(float)
    depth, speed = (np.where(contact > 0, vectors @ n, 0.0) for vectors in (position, velocity))
    K = press.parameters["K"]
    along = force @ n
    residual = force - np.outer(along, n)
    columns = np.column_stack([begins, speed])
    if K.verdict is Verdict.IDENTIFIED and K.value is not None:
        along = along - K.value * depth
    else:
        columns = np.column_stack([columns, depth])
    residual -= begins @ np.linalg.lstsq(begins, residual, rcond=None)[0]
    unexplained: Array = residual + np.outer(
        along - columns @ np.linalg.lstsq(columns, along, rcond=None)[0], n
    )
    return unexplained
