"""How logs write an orientation: quaternions of both orders, rotation vectors, matrices, roll, pitch and yaw."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from palpate.arrays import Array
from palpate.errors import InputError, unknown

PLACE = ("position_x", "position_y", "position_z")
QUATERNION = ("quaternion_x", "quaternion_y", "quaternion_z", "quaternion_w")
_OFF = 0.1
"""By which a matrix may miss being a rotation: logs are rounded, and numbers in another order miss by far more."""


@dataclass(frozen=True)
class Written:
    """One way to write a pose.

    Args:
        order: of its columns, for a user.
        roles: of the columns in turn; None for one that says nothing.
    """

    order: str
    roles: tuple[str | None, ...]


def _matrix(order: str, across: bool, whole: bool) -> Written:
    """A rotation matrix by rows or by columns, behind the place or in a matrix of four by four."""
    turn = [[f"matrix_{i}{j}" for j in range(3)] for i in range(3)]
    cells = [[*row, place] for row, place in zip(turn, PLACE, strict=True)] + [[None] * 4]
    if not whole:
        flat = [turn[i][j] if across else turn[j][i] for i in range(3) for j in range(3)]
        return Written(order, (*PLACE, *flat))
    return Written(order, tuple(cells[i][j] if across else cells[j][i] for i in range(4) for j in range(4)))


_WAYS: dict[str, tuple[Written, ...]] = {
    "quaternion": (Written("x,y,z,qx,qy,qz,qw", (*PLACE, *QUATERNION)),),
    "quaternion-wxyz": (Written("x,y,z,qw,qx,qy,qz", (*PLACE, QUATERNION[3], *QUATERNION[:3])),),
    "rotation-vector": (Written("x,y,z,rx,ry,rz", (*PLACE, "rotvec_x", "rotvec_y", "rotvec_z")),),
    "rpy": (Written("x,y,z,roll,pitch,yaw", (*PLACE, "rpy_x", "rpy_y", "rpy_z")),),
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
