"""Wrench and pose of an arm's log, in three dimensions."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from palpate.arrays import Array
from palpate.errors import InputError, unknown
from palpate.logs import bags
from palpate.logs.formats import Kind, kind_of, open_table
from palpate.logs.read import read_log
from palpate.logs.roles import POSE, WRENCH, si_unit
from palpate.records import Record
from palpate.signals.rotations import quaternions_from

PLACE = ("position_x", "position_y", "position_z")
ABSENT = "-"
"""Name of an axis without a column, along which force and motion are zero."""
QUATERNION = ("quaternion_x", "quaternion_y", "quaternion_z", "quaternion_w")


@dataclass(frozen=True)
class PoseFormat:
    """One way to write a pose.

    Args:
        order: of its columns, for a user.
        roles: of the columns in turn; None for one that says nothing.
    """

    order: str
    roles: tuple[str | None, ...]


def _matrix(order: str, across: bool, whole: bool) -> PoseFormat:
    """A rotation matrix by rows or by columns, behind the place or in a matrix of four by four."""
    turn = [[f"matrix_{i}{j}" for j in range(3)] for i in range(3)]
    cells = [[*row, coordinate] for row, coordinate in zip(turn, PLACE, strict=True)] + [[None] * 4]
    if not whole:
        flat = [turn[i][j] if across else turn[j][i] for i in range(3) for j in range(3)]
        return PoseFormat(order, (*PLACE, *flat))
    return PoseFormat(
        order, tuple(cells[i][j] if across else cells[j][i] for i in range(4) for j in range(4))
    )


_POSE_FORMATS: dict[str, tuple[PoseFormat, ...]] = {
    "quaternion": (PoseFormat("x,y,z,qx,qy,qz,qw", (*PLACE, *QUATERNION)),),
    "quaternion-wxyz": (PoseFormat("x,y,z,qw,qx,qy,qz", (*PLACE, QUATERNION[3], *QUATERNION[:3])),),
    "rotation-vector": (PoseFormat("x,y,z,rx,ry,rz", (*PLACE, "rotvec_x", "rotvec_y", "rotvec_z")),),
    "rpy": (PoseFormat("x,y,z,roll,pitch,yaw", (*PLACE, "rpy_x", "rpy_y", "rpy_z")),),
    "matrix": (
        _matrix("x,y,z,r11,r12,r13,r21,...", across=True, whole=False),
        _matrix("the 16 of a 4 x 4 matrix by rows", across=True, whole=True),
    ),
    "matrix-by-columns": (
        _matrix("x,y,z,r11,r21,r31,r12,...", across=False, whole=False),
        _matrix("the 16 of a 4 x 4 matrix by columns", across=False, whole=True),
    ),
}
ROTATIONS = tuple(_POSE_FORMATS)


def pose_roles(rotation: str, names: list[str]) -> dict[str, str]:
    """Roles of the columns of a pose.

    Raises:
        InputError: no such rotation, or another number of columns than it has.
    """
    if rotation not in _POSE_FORMATS:
        raise unknown("rotation", rotation, _POSE_FORMATS)
    formats = _POSE_FORMATS[rotation]
    if len(names) == 3:
        return dict(zip(PLACE, names, strict=True))
    for layout in formats:
        if len(layout.roles) == len(names):
            return {role: name for role, name in zip(layout.roles, names, strict=True) if role is not None}
    fitting = [
        name
        for name, layouts in _POSE_FORMATS.items()
        if any(len(layout.roles) == len(names) for layout in layouts)
    ]
    hint = f"; {len(names)} columns are those of --rotation {' or '.join(fitting)}" if fitting else ""
    orders = ", or ".join(("x,y,z", *(layout.order for layout in formats)))
    raise InputError(f"--pose needs {orders}, got {len(names)} columns: {','.join(names)}{hint}")


def with_quaternions(columns: Mapping[str, Array]) -> dict[str, Array]:
    """Columns whose orientation, however it was written, is a quaternion; NaN where there is no reading.

    Raises:
        InputError: nine numbers are no rotation.
    """
    unrelated = {name: values for name, values in columns.items() if name.partition("_")[0] not in _FAMILIES}
    for family, names in _FAMILIES.items():
        if names[0] in columns:
            numbers = np.column_stack([columns[name] for name in names])
            return unrelated | dict(zip(QUATERNION, quaternions_from(family, numbers).T, strict=True))
    return unrelated


_FAMILIES = {
    "rotvec": ("rotvec_x", "rotvec_y", "rotvec_z"),
    "rpy": ("rpy_x", "rpy_y", "rpy_z"),
    "matrix": tuple(f"matrix_{i}{j}" for i in range(3) for j in range(3)),
}


_XYZ = ("x", "y", "z")


def _axes(*prefixes: str, axes: tuple[str, ...] = _XYZ) -> tuple[str, ...]:
    return tuple(f"{prefix}.{axis}".lstrip(".") for prefix in prefixes for axis in axes)


def _pose(position: str, turn: str) -> tuple[str, ...]:
    return (*_axes(position), *_axes(turn, axes=(*_XYZ, "w")))


_WRENCHES = {
    "geometry_msgs/msg/WrenchStamped": _axes("wrench.force", "wrench.torque"),
    "geometry_msgs/msg/Wrench": _axes("force", "torque"),
    "franka_msgs/msg/FrankaState": _axes("O_F_ext_hat_K", axes=("0", "1", "2", "3", "4", "5")),
    "franka_msgs/msg/FrankaRobotState": _axes("o_f_ext_hat_k.wrench.force", "o_f_ext_hat_k.wrench.torque"),
}
_POSES = {
    "geometry_msgs/msg/PoseStamped": _pose("pose.position", "pose.orientation"),
    "geometry_msgs/msg/Pose": _pose("position", "orientation"),
    "geometry_msgs/msg/PoseWithCovarianceStamped": _pose("pose.pose.position", "pose.pose.orientation"),
    "nav_msgs/msg/Odometry": _pose("pose.pose.position", "pose.pose.orientation"),
    "geometry_msgs/msg/TransformStamped": _pose("transform.translation", "transform.rotation"),
    "geometry_msgs/msg/PointStamped": _axes("point"),
    "geometry_msgs/msg/Point": _axes(""),
    "franka_msgs/msg/FrankaState": _axes("O_T_EE", axes=("12", "13", "14", "qx", "qy", "qz", "qw")),
    "franka_msgs/msg/FrankaRobotState": _pose("o_t_ee.pose.position", "o_t_ee.pose.orientation"),
}
"""Fields of the components, by the message types of a wrench or a pose.

Franka's states hold both, the wrench as estimated from the joints, in the base's axes.
"""
_COUNTS = {"wrench": (WRENCH, (3, 6)), "pose": (POSE, (3, 7))}
_ORDERS = {"wrench": "fx,fy,fz or fx,fy,fz,tx,ty,tz", "pose": "x,y,z or x,y,z,qx,qy,qz,qw"}


def is_wrench(kind: str) -> bool:
    """True if a type of message is a wrench."""
    return kind in _WRENCHES


def is_pose(kind: str) -> bool:
    """True if a type of message is a pose, or a point."""
    return kind in _POSES


def read_wrench_and_pose(
    path: str | Path,
    wrench: str | None = None,
    pose: str | None = None,
    rotation: str = "quaternion",
    **options: Any,
) -> Record:
    """Read wrench and pose of a log into a record of three dimensions.

    Args:
        path: of the log.
        wrench: a topic of a bag, or columns of any log, `fx,fy,fz` or `fx,fy,fz,tx,ty,tz`, each `NAME` or `NAME:UNIT`;
            of a bag the only topic that is one, when None.
        pose: likewise, `x,y,z` or `x,y,z,qx,qy,qz,qw`, or as `rotation` says.
        rotation: how the orientation is written: `quaternion`, `quaternion-wxyz`, `rotation-vector`, `rpy` (about fixed
            axes), `matrix` (by rows) or `matrix-by-columns`.
        options: of `read_log`: `time` of a log that is no bag, `start`, `end`, `missing`, ...

    Returns:
        A record with `time`, `force_x` ... `torque_z` and `position_x` ... `quaternion_w`, as far as they are there.

    Raises:
        InputError: a fault in the file or with these arguments, in one line.
    """
    path = Path(path)
    kind = kind_of(path)
    with bags.Bag(path, kind, options.get("limits")) if kind.is_bag else nullcontext() as bag:
        wrench = wrench or _only_topic("wrench", bag, path)
        pose = pose or _only_topic("pose", bag, path)
        columns = _columns("wrench", wrench, path, kind, bag) | _columns(
            "pose", pose, path, kind, bag, rotation
        )
    absent = [role for role, name in columns.items() if name == ABSENT]
    record = read_log(path, **(options | {role: columns[role] for role in columns if role not in absent}))
    zeros = {role: np.zeros(len(record["time"])) for role in absent}
    oriented = with_quaternions({**record.columns, **zeros})
    units = {**record.units, **{role: si_unit(role) for role in absent}}
    record = Record(oriented, {name: units.get(name, "1") for name in oriented}, record.meta)
    facts = [f"wrench of {wrench}, pose of {pose}", *record.meta.get("facts", ())]
    return Record(record.columns, record.units, {**record.meta, "facts": facts})


def _only_topic(what: str, bag: bags.Bag | None, path: Path) -> str:
    """The only topic of a bag that is a wrench, or a pose."""
    if bag is None:
        raise InputError(f"name the {what}'s columns of {path} with --{what} {_ORDERS[what]}")
    kinds = _WRENCHES if what == "wrench" else _POSES
    fitting = [
        topic.name for topic in bag.topics.values() if topic.kind in kinds and topic.count and topic.known
    ]
    if len(fitting) == 1:
        return fitting[0]
    listed = f"there are {', '.join(fitting)}" if fitting else f"none of its topics is a {what}"
    raise InputError(
        f"name the {what} of {path} with --{what} TOPIC ({listed}), or force and position with --force TOPIC.FIELD"
        f" --position TOPIC.FIELD; palpate topics {path} lists them"
    )


def _columns(
    what: str, spec: str, path: Path, kind: Kind, bag: bags.Bag | None, rotation: str = "quaternion"
) -> dict[str, str]:
    """The columns of the wrench and the pose, by role."""
    roles, counts = _COUNTS[what]
    names = spec.split(",")
    if {*names} == {ABSENT}:
        raise InputError(f"--{what} {spec} names no column; write - only for an axis that the log lacks")
    if len(names) == 1:
        names = _of_topic(what, spec, bag) if bag else _of_matrix(what, spec, path, kind, rotation)
        if bag:
            rotation = "quaternion"  # a message that is known says its order itself
    if what == "pose":
        return pose_roles(rotation, names)
    if len(names) not in counts:
        raise InputError(f"--{what} needs {_ORDERS[what]}, got {len(names)} columns: {','.join(names)}")
    return dict(zip(roles, names, strict=False))


def _of_topic(what: str, name: str, bag: bags.Bag) -> list[str]:
    topic = bag.topic(name)
    kinds = _WRENCHES if what == "wrench" else _POSES
    if topic.kind in kinds:
        return [f"{name}.{path}" for path in kinds[topic.kind]]
    raise InputError(
        f"{name} is a {topic.kind}, which palpate does not know as a {what}; name its fields:"
        f" --{what} {','.join(f'{name}.FIELD' for _ in range(3))}"
    )


def _of_matrix(what: str, name: str, path: Path, kind: Kind, rotation: str) -> list[str]:
    """The columns of a matrix of a MATLAB file; quaternions have two orders there, so they are not guessed at."""
    columns = [column for column in open_table(path, kind).names if column.rpartition(".")[0] == name]
    if what == "pose" and len(columns) > 3 and rotation == "quaternion":
        raise InputError(
            f"name the columns of {name} one by one, --pose {name}.0,{name}.1,...: x,y,z,qx,qy,qz,qw, the scalar last;"
            " or say how it is written with --rotation"
        )
    if not columns:
        raise InputError(f"--{what} needs {_ORDERS[what]} of {path}, got {name!r}")
    return columns
