"""A record of wrench and pose as vectors: the force in the tool's axes, the point that touches in the base's."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.arrays import Array
from palpate.contact_frame.declared import ContactFrame
from palpate.contact_frame.vectors import matrices
from palpate.errors import InputError
from palpate.records import Record

FORCE = ("force_x", "force_y", "force_z")
TORQUE = ("torque_x", "torque_y", "torque_z")
POSITION = ("position_x", "position_y", "position_z")
QUATERNION = ("quaternion_x", "quaternion_y", "quaternion_z", "quaternion_w")


@dataclass(frozen=True)
class Signals:
    """Wrench and pose over time; NaN where there is no reading.

    Args:
        time: [s], shape (n,).
        recorded: the force in the axes that it was recorded in [N], shape (n, 3).
        force: in the tool's axes as the sensor shows it [N], shape (n, 3).
        torque: likewise [N m], about the point that the user named; None without one.
        rotations: of the tool in the base, shape (n, 3, 3).
        place: of the point that touches, in the base [m], shape (n, 3).
        wrench_frame: the axes that the wrench was given in.
        guess: how that was concluded, if it was not said.
        turned: whether the pose has an orientation.
    """

    time: Array
    recorded: Array
    force: Array
    torque: Array | None
    rotations: Array
    place: Array
    wrench_frame: str
    guess: str | None
    turned: bool


def signals_of(record: Record, frame: ContactFrame) -> Signals:
    """Wrench and pose of a record in three dimensions.

    Raises:
        InputError: the wrench's axes are not known, or need an orientation that the record has not.
    """
    time, place = record["time"], _vectors(record, POSITION)
    turned = QUATERNION[0] in record.columns
    if not turned:
        _check_without_orientation(frame)
    rotations = (
        matrices(time, _vectors(record, QUATERNION)) if turned else np.tile(np.eye(3), (len(time), 1, 1))
    )
    wrench_frame, guess = _wrench_frame(record, frame, turned)
    torque = _vectors(record, TORQUE) if TORQUE[0] in record.columns else None
    into_tool = _into_tool(wrench_frame, frame, rotations)
    return Signals(
        time=time,
        recorded=_vectors(record, FORCE),
        force=np.einsum("nij,nj->ni", into_tool, _vectors(record, FORCE)),
        torque=None if torque is None else np.einsum("nij,nj->ni", into_tool, torque),
        rotations=rotations,
        place=place + rotations @ np.array(frame.tcp),
        wrench_frame=wrench_frame,
        guess=guess,
        turned=turned,
    )


def _vectors(record: Record, names: tuple[str, ...]) -> Array:
    return np.column_stack([record[name] for name in names])


def _check_without_orientation(frame: ContactFrame) -> None:
    needs = {
        "--wrench-frame tool or sensor": frame.wrench_frame in {"tool", "sensor"},
        "a lever arm (--tcp)": any(frame.tcp),
        "a normal in the tool's axes": frame.normal is not None and frame.normal_frame == "tool",
    }
    for what, wanted in needs.items():
        if wanted:
            raise InputError(
                f"{what} needs the pose's orientation, and this pose has none; log a quaternion with it"
            )


def _wrench_frame(record: Record, frame: ContactFrame, turned: bool) -> tuple[str, str | None]:
    """The axes of the wrench; and the reason for them, if they were not declared."""
    if frame.wrench_frame is not None:
        return frame.wrench_frame, None
    if not turned:
        return "base", "the pose has no orientation, so the wrench is taken to be in the base's axes"
    own, pose = (record.meta.get("frames", {}).get(role, "") for role in (FORCE[0], POSITION[0]))
    if not (own and pose):
        raise InputError(
            "the log does not name the axes of its wrench; say --wrench-frame base (the arm's base), tool (the axes of"
            " the pose) or sensor (turned against the tool by --sensor-rpy)"
        )
    found = "base" if own == pose else "tool"
    return (
        found,
        f"the wrench's header names {own!r} and the pose's {pose!r}: its axes are taken to be the {found}'s",
    )


def _into_tool(wrench_frame: str, frame: ContactFrame, rotations: Array) -> Array:
    """Rotations from the wrench's axes to the tool's, shape (n, 3, 3)."""
    if wrench_frame == "base":
        return rotations.transpose(0, 2, 1)
    if wrench_frame == "tool":
        return np.broadcast_to(np.eye(3), rotations.shape)
    from scipy.spatial.transform import Rotation

    turn: Array = Rotation.from_euler("xyz", frame.sensor_rpy).as_matrix()
    return np.broadcast_to(turn, rotations.shape)
