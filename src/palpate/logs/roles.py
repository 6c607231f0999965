"""Roles of a record's columns (time, length, force) and their possible units in a log."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from palpate.arrays import Array
from palpate.errors import InputError
from palpate.units import unit

WRENCH = ("force_x", "force_y", "force_z", "torque_x", "torque_y", "torque_z")
POSE = (
    "position_x",
    "position_y",
    "position_z",
    "quaternion_x",
    "quaternion_y",
    "quaternion_z",
    "quaternion_w",
)
"""Columns of a record in three dimensions, in the order in which their names are given."""

_QUANTITY = {
    "time": "time",
    "position": "length",
    "force": "force",
    "torque": "torque",
    "quaternion": "number",
    "rotvec": "angle",
    "rpy": "angle",
    "matrix": "number",
}
_SI = {
    "time": "s",
    "position": "m",
    "force": "N",
    "torque": "N m",
    "quaternion": "1",
    "rotvec": "rad",
    "rpy": "rad",
    "matrix": "1",
}
_ALLOWED = {
    "time": {"time"},
    "position": {"length", "angle", "number"},
    "force": {"force", "torque", "number"},
    "torque": {"torque"},
    "quaternion": {"number"},
    "rotvec": {"angle"},
    "rpy": {"angle"},
    "matrix": {"number"},
}


@dataclass
class Loaded:
    """Values of the requested columns of a file.

    Args:
        columns: by role, in SI units, each of shape (n,); with the role `time`, which begins at 0.
        units: SI unit by role.
        start: the first row's own time [s].
        notes: warnings, as a record's meta has them.
        facts: what else there is to say, a sentence each.
        frames: the frame that a topic's headers name, by role.
        joints: the position is that of a joint.
    """

    columns: dict[str, Array]
    units: dict[str, str]
    start: float
    notes: list[dict[str, Any]] = field(default_factory=list)
    facts: list[str] = field(default_factory=list)
    frames: dict[str, str] = field(default_factory=dict)
    joints: bool = False


def family(role: str) -> str:
    """Base role: `force` for `force` and for `force_x`."""
    return role.partition("_")[0]


def quantity(role: str) -> str:
    """Quantity of a role; empty for an unknown one."""
    return _QUANTITY.get(family(role), "")


def si_unit(role: str) -> str:
    """The unit of a role whose column has none of its own."""
    return _SI.get(family(role), "1")


def check_quantity(role: str, name: str, symbol: str) -> None:
    """Refuse a unit that a role cannot have."""
    found = unit(symbol).quantity
    if found not in _ALLOWED.get(family(role), {found}):
        raise InputError(
            f"{symbol!r} of {name}:{symbol} is a unit of {found}; {role} needs one of {quantity(role)}"
        )


def check_apart(places: Mapping[str, Any], names: Mapping[str, str], path: Path) -> None:
    """Refuse one column for two roles.

    Args:
        places: where each role's numbers come from.
        names: what to call that.
        path: of the log.
    """
    seen: dict[Any, str] = {}
    for role in sorted(places, key=lambda role: (family(role) not in _QUANTITY, role)):
        if family(role) not in _QUANTITY:
            break
        other = seen.setdefault(places[role], role)
        if other != role:
            both = " and ".join(sorted((other, role)))
            raise InputError(f"{both} cannot be the same column of {path}, {names[role]!r}; name two")
