"""Wrench and pose of an arm's log, in three dimensions."""

from collections.abc import Mapping
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from palpate.arrays import Array
from palpate.errors import InputError, unknown
from palpate.logs.formats import Bag, Kind, bag_reader, kind_of, open_table
from palpate.logs.read import read_log
from palpate.logs.roles import POSE, WRENCH
from palpate.records import Record

PLACE = ("position_x", "position_y", "position_z")
QUATERNION = ("quaternion_x", "quaternion_y", "quaternion_z", "quaternion_w")
_OFF = 0.1
"""By which a matrix may miss being a rotation: logs are rounded, and numbers in another order miss by far more."""


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
    cells = [[*row, place] for row, place in zip(turn, PLACE, strict=True)] + [[None] * 4]
    if not whole:
        flat = [turn[i][j] if across else turn[j][i] for i in range(3) for j in range(3)]
        return PoseFormat(order, (*PLACE, *flat))
    return PoseFormat(
        order, tuple(cells[i][j] if across else cells[j][i] for i in range(4) for j in range(4))
    )


_WAYS: dict[str, tuple[PoseFormat, ...]] = {
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
ROTATIONS = tuple(_WAYS)


def roles_of(rotation: str, names: list[str]) -> dict[str, str]:
    """Roles of the columns of a pose.

    Raises:
        InputError: no such rotation, or another number of columns than it has.
    """
    if rotation not in _WAYS:
        raise unknown("rotation", rotation, _WAYS)
    ways = _WAYS[rotation]
    if len(names) == 3:
        return dict(zip(PLACE, names, strict=True))
    for way in ways:
        if len(way.roles) == len(names):
            return {role: name for role, name in zip(way.roles, names, strict=True) if role is not None}
    others = [name for name, known in _WAYS.items() if any(len(way.roles) == len(names) for way in known)]
    hint = f"; {len(names)} columns are those of --rotation {' or '.join(others)}" if others else ""
    orders = ", or ".join(("x,y,z", *(way.order for way in ways)))
    raise InputError(f"--pose needs {orders}, got {len(names)} columns: {','.join(names)}{hint}")


def with_quaternions(columns: Mapping[str, Array]) -> dict[str, Array]:
    """Columns whose orientation, however it was written, is a quaternion; NaN where there is no reading.

    Raises:
        InputError: nine numbers are no rotation.
    """
    others = {name: values for name, values in columns.items() if name.partition("_")[0] not in _FAMILIES}
    for family, names in _FAMILIES.items():
        if names[0] in columns:
            numbers = np.column_stack([columns[name] for name in names])
            return others | dict(zip(QUATERNION, _quaternions(family, numbers).T, strict=True))
    return others


_FAMILIES = {
    "rotvec": ("rotvec_x", "rotvec_y", "rotvec_z"),
    "rpy": ("rpy_x", "rpy_y", "rpy_z"),
    "matrix": tuple(f"matrix_{i}{j}" for i in range(3) for j in range(3)),
}


def _quaternions(family: str, numbers: Array) -> Array:
    from scipy.spatial.transform import Rotation

    there = np.isfinite(numbers).all(axis=1)
    found = np.full((len(numbers), 4), np.nan)
    if family == "rotvec":
        found[there] = Rotation.from_rotvec(numbers[there]).as_quat()
    elif family == "rpy":
        found[there] = Rotation.from_euler("xyz", numbers[there]).as_quat()
    else:
        matrices = numbers[there].reshape(-1, 3, 3)
        _check_rotations(matrices)
        found[there] = Rotation.from_matrix(matrices).as_quat()
    return found


def _check_rotations(matrices: Array) -> None:
    off = np.abs(matrices @ matrices.transpose(0, 2, 1) - np.eye(3)).max(axis=(1, 2))
    turned = np.linalg.det(matrices) if len(matrices) else np.ones(0)
    bad = np.flatnonzero((off > _OFF) | (turned < 0))
    if len(bad):
        row = int(bad[0])
        why = (
            f"its rows are not orthonormal: they are off by {off[row]:.2g}"
            if off[row] > _OFF
            else "it is a reflection, with determinant -1"
        )
        raise InputError(
            f"row {row + 1} of the pose's matrix is no rotation: {why}; are the columns in the order of --rotation?"
        )


_XYZ = ("x", "y", "z")


def _axes(*prefixes: str, axes: tuple[str, ...] = _XYZ) -> tuple[str, ...]:
    return tuple(f"{prefix}.{axis}".lstrip(".") for prefix in prefixes for axis in axes)


def _pose(place: str, turn: str) -> tuple[str, ...]:
    return (*_axes(place), *_axes(turn, axes=(*_XYZ, "w")))


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
"""Where the components are, by the types that palpate knows as a wrench or as a pose.

Franka's states hold both, the wrench as estimated from the joints, in the base's axes.
"""
_COUNTS = {"wrench": (WRENCH, (3, 6)), "pose": (POSE, (3, 7))}
_ORDERS = {"wrench": "fx,fy,fz or fx,fy,fz,tx,ty,tz", "pose": "x,y,z or x,y,z,qx,qy,qz,qw"}


def is_wrench(kind: str) -> bool:
    """Whether a type of message is a wrench."""
    return kind in _WRENCHES


def is_pose(kind: str) -> bool:
    """Whether a type of message is a pose, or a point."""
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
    with bag_reader().Bag(path, kind, options.get("limits")) if kind.is_bag else nullcontext() as bag:
        wrench = wrench or _only("wrench", bag, path)
        pose = pose or _only("pose", bag, path)
        columns = _columns("wrench", wrench, path, kind, bag) | _columns(
            "pose", pose, path, kind, bag, rotation
        )
    record = read_log(path, **(options | columns))
    turned = with_quaternions(record.columns)
    record = Record(turned, {name: record.units.get(name, "1") for name in turned}, record.meta)
    facts = [f"wrench of {wrench}, pose of {pose}", *record.meta.get("facts", ())]
    return Record(record.columns, record.units, {**record.meta, "facts": facts})


def _only(what: str, bag: Bag | None, path: Path) -> str:
    """The only topic of a bag that is a wrench, or a pose."""
    if bag is None:
        raise InputError(f"name the {what}'s columns of {path} with --{what} {_ORDERS[what]}")
    known = _WRENCHES if what == "wrench" else _POSES
    there = [
        topic.name for topic in bag.topics.values() if topic.kind in known and topic.count and topic.known
    ]
    if len(there) == 1:
        return there[0]
    found = f"there are {', '.join(there)}" if there else f"none of its topics is a {what}"
    raise InputError(
        f"name the {what} of {path} with --{what} TOPIC ({found}), or force and position with --force TOPIC.FIELD"
        f" --position TOPIC.FIELD; palpate topics {path} lists them"
    )


def _columns(
    what: str, spec: str, path: Path, kind: Kind, bag: Bag | None, rotation: str = "quaternion"
) -> dict[str, str]:
    """The columns of the wrench and the pose, by role."""
    roles, counts = _COUNTS[what]
    names = spec.split(",")
    if len(names) == 1:
        names = _of_topic(what, spec, bag) if bag else _of_matrix(what, spec, path, kind, rotation)
        if bag:
            rotation = "quaternion"  # a message that is known says its order itself
    if what == "pose":
        return roles_of(rotation, names)
    if len(names) not in counts:
        raise InputError(f"--{what} needs {_ORDERS[what]}, got {len(names)} columns: {','.join(names)}")
    return dict(zip(roles, names, strict=False))


def _of_topic(what: str, name: str, bag: Bag) -> list[str]:
    topic = bag.topic(name)
    known = _WRENCHES if what == "wrench" else _POSES
    if topic.kind in known:
        return [f"{name}.{path}" for path in known[topic.kind]]
    raise InputError(
        f"{name} is a {topic.kind}, which palpate does not know as a {what}; name its fields:"
        f" --{what} {','.join(f'{name}.FIELD' for _ in range(3))}"
    )


def _of_matrix(what: str, name: str, path: Path, kind: Kind, rotation: str) -> list[str]:
    """The columns of a matrix of a MATLAB file; quaternions have two orders there, so they are not guessed at."""
    columns = [own for own in open_table(path, kind).names if own.rpartition(".")[0] == name]
    if what == "pose" and len(columns) > 3 and rotation == "quaternion":
        raise InputError(
            f"name the columns of {name} one by one, --pose {name}.0,{name}.1,...: x,y,z,qx,qy,qz,qw, the scalar last;"
            " or say how it is written with --rotation"
        )
    if not columns:
        raise InputError(f"--{what} needs {_ORDERS[what]} of {path}, got {name!r}")
    return columns
