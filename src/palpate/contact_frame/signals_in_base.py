"""A record of wrench and pose as vectors: the force in the tool's axes, the point that touches in the base's.

The user declares axes of the wrench, tool and normal of the contact. Saturated axes of the force sensor are detected
before the axes are rotated; weight and bias are removed, with the rows in free motion and in contact.
"""

from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from palpate.arrays import Array, Mask
from palpate.contact_frame.free_motion import contact_rows, finite_rows, rows_between
from palpate.contact_frame.load import Load, fit_load, fit_load_robustly, load_with_payload, turns, zero_load
from palpate.contact_frame.payload import Payload, Vector
from palpate.errors import InputError
from palpate.identification.sample_clock import at_limit
from palpate.records import Record
from palpate.signals.rotations import matrices_from_quaternions, matrix_from_rpy, to_base


@dataclass(frozen=True)
class ContactFrame:
    """Axes, points and signs of a wrench and a pose, and the normal.

    Args:
        wrench_frame: axes that the wrench is given in: the arm's base, the tool (the axes of the pose), or a sensor
            that is turned against the tool; None to use the frames of the messages' headers.
        sensor_rpy: how the sensor is turned against the tool: roll, pitch and yaw about fixed axes [rad].
        tcp: the point that touches, in the tool's axes from the pose's origin [m].
        wrench_at: the point that the torque is about, likewise [m]; only the lever arm's check needs it.
        force_sign: `action` acts from the tool on the surface, `reaction` from the surface on the tool;
            None to find out.
        normal: into the surface; None to find it from the force.
        normal_frame: axes of the normal: the base's, or the tool's.
        gravity_compensated: the tool's weight is already subtracted from the wrench.
        free: begin and end of a stretch in which nothing is touched [s]; None to find such stretches.
        payload: of the sensor, if it was weighed; its wrench must be in the same axes.

    Raises:
        InputError: they contradict each other.
    """

    wrench_frame: Literal["base", "tool", "sensor"] | None = None
    sensor_rpy: Vector | None = None
    tcp: Vector = (0.0, 0.0, 0.0)
    wrench_at: Vector = (0.0, 0.0, 0.0)
    force_sign: Literal["action", "reaction"] | None = None
    normal: Vector | None = None
    normal_frame: Literal["base", "tool"] = "base"
    gravity_compensated: bool = False
    free: tuple[float, float] | None = None
    payload: Payload | None = None

    def __post_init__(self) -> None:
        if (self.wrench_frame == "sensor") != (self.sensor_rpy is not None):
            raise InputError("a wrench in the sensor's axes needs --sensor-rpy, and no other frame takes it")
        if self.normal is not None and not np.linalg.norm(self.normal) > 0:
            raise InputError(
                "the normal must have a length, got 0,0,0; it points into the surface, as 0,0,-1"
            )
        if self.free is not None and not self.free[0] < self.free[1]:
            raise InputError(
                f"the interval of free motion must end after it begins, got {self.free[0]:g} to {self.free[1]:g} s"
            )
        if self.payload is not None:
            self._check_axes(self.payload)

    def _check_axes(self, payload: Payload) -> None:
        declared = (self.wrench_frame, self.sensor_rpy)
        if self.wrench_frame is not None and declared != (payload.wrench_frame, payload.sensor_rpy):
            raise InputError(
                f"the payload was weighed with a wrench in the {payload.wrench_frame}'s axes, and this wrench is said"
                f" to be in the {self.wrench_frame}'s: give the same --wrench-frame and --sensor-rpy, or weigh again"
            )


FORCE = ("force_x", "force_y", "force_z")
TORQUE = ("torque_x", "torque_y", "torque_z")
POSITION = ("position_x", "position_y", "position_z")
QUATERNION = ("quaternion_x", "quaternion_y", "quaternion_z", "quaternion_w")


@dataclass(frozen=True)
class BaseSignals:
    """Wrench and pose over time; NaN where there is no reading.

    Args:
        time: [s], shape (n,).
        recorded: the force in the axes that it was recorded in [N], shape (n, 3).
        force: in the tool's axes as the sensor shows it [N], shape (n, 3).
        torque: likewise [N m], about the point that the user named; None without one.
        rotations: of the tool in the base, shape (n, 3, 3).
        position: of the point that touches, in the base [m], shape (n, 3).
        wrench_frame: the axes that the wrench was given in.
        guess: how that was concluded, if it was not said.
        oriented: True if the pose has an orientation.
    """

    time: Array
    recorded: Array
    force: Array
    torque: Array | None
    rotations: Array
    position: Array
    wrench_frame: str
    guess: str | None
    oriented: bool


def base_signals(record: Record, frame: ContactFrame) -> BaseSignals:
    """Wrench and pose of a record in three dimensions.

    Raises:
        InputError: the wrench's axes are not known, or need an orientation that the record has not.
    """
    time = record["time"]
    position = _vectors(record, POSITION)
    oriented = QUATERNION[0] in record.columns
    if not oriented:
        _check_without_orientation(frame)
    rotations = np.tile(np.eye(3), (len(time), 1, 1))
    if oriented:
        rotations = matrices_from_quaternions(time, _vectors(record, QUATERNION))
    wrench_frame, guess = _wrench_frame(record, frame, oriented)
    torque = _vectors(record, TORQUE) if TORQUE[0] in record.columns else None
    into_tool = _wrench_rotations(wrench_frame, frame, rotations)
    return BaseSignals(
        time=time,
        recorded=_vectors(record, FORCE),
        force=to_base(into_tool, _vectors(record, FORCE)),
        torque=None if torque is None else to_base(into_tool, torque),
        rotations=rotations,
        position=position + rotations @ np.array(frame.tcp),
        wrench_frame=wrench_frame,
        guess=guess,
        oriented=oriented,
    )


def _vectors(record: Record, names: tuple[str, ...]) -> Array:
    return np.column_stack([record[name] for name in names])


def _check_without_orientation(frame: ContactFrame) -> None:
    needs = {
        "--wrench-frame tool or sensor": frame.wrench_frame in {"tool", "sensor"},
        "a lever arm (--tcp)": any(frame.tcp),
        "a normal in the tool's axes": frame.normal is not None and frame.normal_frame == "tool",
    }
    for what, needed in needs.items():
        if needed:
            raise InputError(
                f"{what} needs the pose's orientation, and this pose has none; log a quaternion with it"
            )


def _wrench_frame(record: Record, frame: ContactFrame, oriented: bool) -> tuple[str, str | None]:
    """The axes of the wrench; and the reason for them, if they were not declared."""
    if frame.wrench_frame is not None:
        return frame.wrench_frame, None
    if not oriented:
        return "base", "the pose has no orientation, so the wrench is taken to be in the base's axes"
    wrench, pose = (record.meta.get("frames", {}).get(role, "") for role in (FORCE[0], POSITION[0]))
    if not (wrench and pose):
        raise InputError(
            "the log does not name the axes of its wrench; say --wrench-frame base (the arm's base), tool (the axes of"
            " the pose) or sensor (turned against the tool by --sensor-rpy)"
        )
    axes = "base" if wrench == pose else "tool"
    return (
        axes,
        f"the wrench's header names {wrench!r} and the pose's {pose!r}: its axes are taken to be the {axes}'s",
    )


def _wrench_rotations(wrench_frame: str, frame: ContactFrame, rotations: Array) -> Array:
    """Rotations from the wrench's axes to the tool's, shape (n, 3, 3)."""
    if wrench_frame == "base":
        return rotations.transpose(0, 2, 1)
    if wrench_frame == "tool":
        return np.broadcast_to(np.eye(3), rotations.shape)
    assert frame.sensor_rpy is not None
    return np.broadcast_to(matrix_from_rpy(frame.sensor_rpy), rotations.shape)


def saturated_rows(force: Array, position: Array, inside: Mask) -> Mask:
    """Rows in contact in which an axis rests at exactly its extreme value while the tool moves on, shape (n,).

    Args:
        force: in the axes that it was recorded in [N], shape (n, 3); NaN where there is no reading.
        position: of the tool [m], shape (n, 3), likewise.
        inside: rows in contact, shape (n,).
    """
    saturated = np.zeros(len(force), bool)
    for axis in force.T:
        rows = np.isfinite(axis) & inside
        if rows.any() and np.ptp(np.float32(axis[rows])):  # what is below its grain is rounding, no range
            saturated |= at_limit(axis, position, (axis[rows].max(), axis[rows].min()), rows)
    return saturated


_MAX_ROUNDS = 4
"""Maximum rounds: the free rows give the weight, and the weight the free rows, until neither changes."""


@dataclass(frozen=True)
class CompensatedForce:
    """The force in the base's axes without weight and bias.

    Args:
        force: [N], shape (n, 3).
        finite: rows with a force, shape (n,).
        inside: rows in contact, shape (n,).
        free: rows with a force in which nothing is touched, shape (n,).
        load: the subtracted weight and bias.
    """

    force: Array
    finite: Mask
    inside: Mask
    free: Mask
    load: Load


def compensate(
    signals: BaseSignals, frame: ContactFrame
) -> tuple[BaseSignals, CompensatedForce, list[dict[str, Any]]]:
    """Take off weight and bias, and leave out the readings of a force at the end of its range.

    Returns:
        The signals without these readings, the force, and notes as a record's meta has them.

    Raises:
        InputError: no row has a force.
    """
    if not finite_rows(signals.force).any():
        raise InputError("no row has a reading of all three axes of the force: check the columns of --wrench")
    compensated = _remove_load(signals, frame)
    saturated = saturated_rows(signals.recorded, signals.position, compensated.inside)
    if not saturated.any():
        return signals, compensated, []
    signals = replace(signals, force=np.where(saturated[:, None], np.nan, signals.force))
    text = (
        f"an axis of the force rests at its extreme value for {int(saturated.sum())} rows; they are left out"
    )
    return signals, _remove_load(signals, frame), [{"code": "saturated", "text": text}]


def _remove_load(signals: BaseSignals, frame: ContactFrame) -> CompensatedForce:
    finite = finite_rows(signals.force)
    if frame.free is None:
        load, inside, free = _fit_load(signals, finite, frame)
    else:
        free = rows_between(signals.time, frame.free) & finite
        load = _load(signals, free, frame)
        inside, _ = _contact(signals, load)
    return CompensatedForce(load.taken_off(signals.force, signals.rotations), finite, inside, free, load)


def _load(signals: BaseSignals, free: Mask, frame: ContactFrame) -> Load:
    """Weight and bias by the free rows; the weight is the payload's where there is one."""
    force = signals.force[free]
    rotations = signals.rotations[free]
    if frame.payload is not None:
        return load_with_payload(force, rotations, frame.payload)
    return fit_load(force, rotations, weighs=not frame.gravity_compensated)


def _fit_load(signals: BaseSignals, finite: Mask, frame: ContactFrame) -> tuple[Load, Mask, Mask]:
    """Weight and bias by the free rows; which rows these are, depends on the weight where the tool turns."""
    turns_in_space = signals.oriented and turns(signals.rotations[finite])
    none = finite & False
    weighs = not frame.gravity_compensated
    if frame.payload is not None:
        load = _load(signals, none, frame)
    else:
        load = (
            fit_load_robustly(signals.force[finite], signals.rotations[finite], weighs=weighs)
            if turns_in_space
            else zero_load()
        )
    before = none
    for _ in range(_MAX_ROUNDS if turns_in_space else 1):
        inside, free = _contact(signals, load)
        free &= finite
        if free.any() and np.array_equal(free, before):
            break
        before = free
        if not free.any():
            return _load(signals, none, frame) if frame.payload else zero_load(), inside, free
        load = _load(signals, free, frame)
    return load, inside, free


def _contact(signals: BaseSignals, load: Load) -> tuple[Mask, Mask]:
    return contact_rows(signals.time, load.taken_off(signals.force, signals.rotations), signals.position)
