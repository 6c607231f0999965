"""From a record in three dimensions to one along the contact's normal, and to its identification.

A check of lever arm, axes and torque says whether the force passes through the point that is said to touch. The arm's
own mass and compliance are removed.
"""

from typing import Any

import numpy as np

from palpate.arrays import Array, Mask
from palpate.contact_frame import free_motion
from palpate.contact_frame.load import MATTERS, Normal, direction_of, load_of, scale_std, turns
from palpate.contact_frame.signals_in_base import BaseSignals, ContactFrame, Unloaded, in_range, signals_of
from palpate.errors import InputError
from palpate.identification import Identification, Verdict
from palpate.records import Record

_LEAST = 0.3
"""Of the largest force: the line of a weaker one is three times as uncertain, for the same noise of the torque."""


def line_misses_tcp(signals: BaseSignals, free: Mask, inside: Mask, frame: ContactFrame) -> float | None:
    """How far the contact force's line of action passes from the tool centre point [m]; the median over the contact.

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
    there = free_motion.read_rows(signals.force) & free_motion.read_rows(signals.torque)
    free, inside = free & there, inside & there
    if (
        free.sum() < free_motion.FEWEST
        or inside.sum() < free_motion.FEWEST
        or not np.ptp(signals.torque[there])
    ):
        return None
    force = signals.force[inside] - signals.force[free].mean(axis=0)
    torque = signals.torque[inside] - signals.torque[free].mean(axis=0)
    size = np.linalg.norm(force, axis=1)
    strong = size > _LEAST * size.max()
    lever = np.array(frame.tcp) - np.array(frame.wrench_at)
    left = torque[strong] - np.cross(lever, force[strong])
    return float(np.median(np.linalg.norm(np.cross(force[strong], left), axis=1) / size[strong] ** 2))


_FOLLOWS = 0.65
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
    signals = signals_of(record, frame)
    signals, freed, notes = in_range(signals, frame)
    normal = _normal(signals, freed, frame)
    sign, normal, turned = _orient(signals, freed, normal, frame)
    position = (signals.place - signals.place[free_motion.read_rows(signals.place)][0]) @ normal.direction
    spread = scale_std(normal, *_in_contact(signals, freed))
    inertia = _inertia_in_air(signals, freed, sign, frame)
    notes += turned + _warnings(signals, freed, normal, spread) + _doubts(freed, signals, frame, inertia)
    about = _about(signals, freed, normal, sign, frame) | {"scale_std": spread, "free_inertia_kg": inertia}
    meta = {**record.meta, "contact_frame": about, "notes": [*record.meta.get("notes", ()), *notes]}
    columns = {"time": signals.time, "position": position, "force": sign * freed.force @ normal.direction}
    return Record(columns, {"time": "s", "position": "m", "force": "N"}, meta)


def _normal(signals: BaseSignals, freed: Unloaded, frame: ContactFrame) -> Normal:
    if frame.normal is None:
        direction, std = direction_of(freed.force[freed.there])
        return Normal(direction, std, found=True)
    direction = np.array(frame.normal) / np.linalg.norm(frame.normal)
    if frame.normal_frame == "tool":
        rows = freed.inside if freed.inside.any() else freed.there
        direction = (signals.rotations[rows] @ direction).mean(axis=0)
        direction /= np.linalg.norm(direction)
    return Normal(direction, 0.0, found=False)


def _in_contact(signals: BaseSignals, freed: Unloaded) -> tuple[Array, Array]:
    """Forces and places in contact; of the whole log where there is none."""
    rows = freed.inside if (freed.inside & freed.there).sum() > 1 else np.ones(len(freed.inside), bool)
    placed = free_motion.read_rows(signals.place)
    return freed.force[rows & freed.there], signals.place[rows & placed]


def _orient(
    signals: BaseSignals, freed: Unloaded, normal: Normal, frame: ContactFrame
) -> tuple[float, Normal, list[dict[str, Any]]]:
    """The sign that makes the force act from the tool on the surface, and the normal into the surface."""
    together = _correlation(signals, freed, normal.direction)
    sign = {"action": 1.0, "reaction": -1.0, None: -1.0 if together < 0 else 1.0}[frame.force_sign]
    if frame.force_sign is not None and freed.free.any() and sign * together < -_FOLLOWS:
        other = "reaction" if frame.force_sign == "action" else "action"
        raise InputError(
            f"the wrench was declared to be the {frame.force_sign}, but falls as the tool goes in: say --force-sign"
            f" {other}, or check --wrench-frame and --normal"
        )
    pressing = sign * _mean_press(signals, freed, normal.direction)
    if pressing >= 0:
        return sign, normal, []
    turned = Normal(-normal.direction, normal.std, normal.found)
    if normal.found:
        return sign, turned, []
    text = "the given normal points out of the surface; it was reversed"
    return sign, turned, [{"code": "position-sign-reversed", "text": text}]


def _correlation(signals: BaseSignals, freed: Unloaded, direction: Array) -> float:
    """Of the force with the position along a direction, in contact; the same for the direction turned round."""
    rows = (freed.inside if freed.inside.any() else freed.there) & freed.there
    placed = free_motion.read_rows(signals.place)
    position = np.interp(signals.time[rows], signals.time[placed], signals.place[placed] @ direction)
    force = freed.force[rows] @ direction
    if len(force) < 2 or not (np.ptp(position) and np.ptp(force)):
        return 0.0
    return float(np.corrcoef(position, force)[0, 1])


def _mean_press(signals: BaseSignals, freed: Unloaded, direction: Array) -> float:
    """How much larger the force along a direction is in contact than out of it [N]; 0 if the tool never leaves."""
    inside = freed.inside & freed.there
    if not (freed.free.any() and inside.any()):
        return 0.0
    return float((freed.force[inside].mean(axis=0) - freed.force[freed.free].mean(axis=0)) @ direction)


def _warnings(signals: BaseSignals, freed: Unloaded, normal: Normal, spread: float) -> list[dict[str, Any]]:
    notes = []
    if signals.guess:
        notes.append({"code": "frame-guess", "text": f"{signals.guess}; say --wrench-frame if it is not so"})
    if not normal.shown:
        text = "the force changes equally in all directions, so the normal is unknown: is there contact?"
        notes.append({"code": "normal-uncertain", "text": text})
    elif spread > MATTERS:
        text = (
            f"the normal is known to {np.degrees(normal.std):.2g} deg about each axis (one std), which leaves K, B and"
            f" M uncertain by {spread:.2g} of their value; give --normal"
        )
        notes.append({"code": "normal-uncertain", "text": text})
    if not freed.free.any():
        text = (
            "no free motion in the log: the force's bias, the tool's weight and the surface's position cannot be told"
            " apart, and none of them is given"
        )
        notes.append({"code": "contact-at-start", "text": text})
    return notes


def _inertia_in_air(
    signals: BaseSignals, freed: Unloaded, sign: float, frame: ContactFrame
) -> tuple[float, float] | None:
    """The mass by which the force follows the acceleration before the touch, and its std [kg].

    The tool's force on its sensor is m (g - a) minus its force on the surface: the reaction.
    """
    payload = frame.payload
    centre = payload.centre if payload is not None and payload.centre is not None else (0.0, 0.0, 0.0)
    off = np.array(frame.wrench_at) + np.array(centre) - np.array(frame.tcp)
    return free_motion.free_inertia(
        signals.time, -sign * freed.force, signals.place + signals.rotations @ off, freed.free
    )


def _doubts(
    freed: Unloaded, signals: BaseSignals, frame: ContactFrame, inertia: tuple[float, float] | None
) -> list[dict[str, Any]]:
    """Contradictions between the free rows and the compensated or weighed tool."""
    from scipy.special import chdtri

    notes = []
    if free_motion.wrong_sign(inertia):
        assert inertia is not None
        notes.append({"code": "tool-inertia", "text": free_motion.wrong_sign_of(inertia)})
    free = freed.free
    if frame.payload is None or not free.any() or not turns(signals.rotations[free]):
        return notes
    own = load_of(signals.force[free], signals.rotations[free], weighs=True)
    off = float(np.linalg.norm(own.weight - np.array(frame.payload.weight)))
    if own.separable and off > float(chdtri(3, free_motion.CHANCE)) ** 0.5 * float(
        np.hypot(own.weight_std, frame.payload.weight_std)
    ):
        text = (
            f"the free rows weigh {off:.2g} N otherwise than the payload file says: is it of another tool, of a pose of"
            " another frame, or is the sensor saturated?"
        )
        notes.append({"code": "payload-doubtful", "text": text})
    return notes


def _about(
    signals: BaseSignals, freed: Unloaded, normal: Normal, sign: float, frame: ContactFrame
) -> dict[str, Any]:
    """Declared and estimated properties, as plain values."""
    load = freed.load
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
        "normal_found": normal.found,
        "normal_std_rad": normal.std,
        "normal_shown": normal.shown,
        "free_said_s": list(frame.free) if frame.free else None,
        "payload_said": frame.payload is not None,
        "free_rows": int(freed.free.sum()),
        "bias_N": load.bias.tolist(),
        "weight_N": load.weight.tolist() if load.separable else None,
        "weight_std_N": load.weight_std if load.separable else None,
        "load_std_N": load.std,
        "line_of_action_off_m": line_misses_tcp(signals, freed.free, freed.inside, frame),
    }


def residual_of_press(
    press: Identification, about: dict[str, Any], time: Array, place: Array, velocity: Array, force: Array
) -> Array:
    """The force that a press leaves unexplained [N], shape (n, 3): along the normal by K, depth and speed, else whole.

    Each contact, and free motion, begins from a force of its own. A K that is not identified is fitted here.

    Args:
        press: its contacts and K.
        about: its normal and sign, as `project` gives them in `meta`.
        time: [s], shape (n,).
        place: of the tip in the base [m], shape (n, 3).
        velocity: likewise [m/s].
        force: in the base, of either sign [N], shape (n, 3).
    """
    n = np.array(about["normal"])
    force = force if about["force_sign"] == "action" else -force
    contact = np.zeros(len(time), int)
    for i, (start, end) in enumerate(press.contacts):
        contact[(time >= start) & (time <= end)] = i + 1
    begins = np.equal.outer(contact, np.unique(contact)).astype(float)
    depth, speed = (np.where(contact > 0, vectors @ n, 0.0) for vectors in (place, velocity))
    K, along = press.parameters["K"], force @ n
    left = force - np.outer(along, n)
    columns = np.column_stack([begins, speed])
    if K.verdict is Verdict.IDENTIFIED and K.value is not None:
        along = along - K.value * depth
    else:
        columns = np.column_stack([columns, depth])
    left -= begins @ np.linalg.lstsq(begins, left, rcond=None)[0]
    found: Array = left + np.outer(along - columns @ np.linalg.lstsq(columns, along, rcond=None)[0], n)
    return found
