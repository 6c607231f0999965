"""Roles of a record's columns (time, length, force) and their possible units in a log."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

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


class _Family(NamedTuple):
    quantity: str
    si: str
    allowed: frozenset[str] = frozenset()
    """Quantities of the units that its columns may have beside its own."""


_ANY_NUMBER = _Family("number", "1")
_ANGLE = _Family("angle", "rad")
_FAMILIES = {
    "time": _Family("time", "s"),
    "position": _Family("length", "m", frozenset({"angle", "number"})),
    "force": _Family("force", "N", frozenset({"torque", "number"})),
    "torque": _Family("torque", "N m"),
    "velocity": _Family("velocity", "m/s", frozenset({"angular velocity", "number"})),
    "quaternion": _ANY_NUMBER,
    "rotvec": _ANGLE,
    "rpy": _ANGLE,
    "matrix": _ANY_NUMBER,
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
        time_stated: the log, the name of the time or the user says its unit.
    """

    columns: dict[str, Array]
    units: dict[str, str]
    start: float
    notes: list[dict[str, Any]] = field(default_factory=list)
    facts: list[str] = field(default_factory=list)
    frames: dict[str, str] = field(default_factory=dict)
    joints: bool = False
    time_stated: bool = False


def family(role: str) -> str:
    """Base role: `force` for `force` and for `force_x`."""
    return role.partition("_")[0]


def quantity(role: str) -> str:
    """Quantity of a role; empty for an unknown one."""
    properties = _FAMILIES.get(family(role))
    return properties.quantity if properties else ""


def si_unit(role: str) -> str:
    """The unit of a role whose column has none of its own."""
    return _FAMILIES.get(family(role), _ANY_NUMBER).si


def check_quantity(role: str, name: str, symbol: str) -> None:
    """Refuse a unit that a role cannot have."""
    measured = unit(symbol).quantity
    properties = _FAMILIES.get(family(role))
    if properties and measured not in {properties.quantity, *properties.allowed}:
        raise InputError(
            f"{symbol!r} of {name}:{symbol} is a unit of {measured}; {role} needs one of {quantity(role)}"
        )


def check_apart(places: Mapping[str, Any], names: Mapping[str, str], path: Path) -> None:
    """Refuse one column for two roles.

    Args:
        places: where each role's numbers come from.
        names: what to call that.
        path: of the log.
    """
    roles: dict[Any, str] = {}
    for role in sorted(places, key=lambda role: (family(role) not in _FAMILIES, role)):
        if family(role) not in _FAMILIES:
            break
        first = roles.setdefault(places[role], role)
        if first != role:
            both = " and ".join(sorted((first, role)))
            raise InputError(f"{both} cannot be the same column of {path}, {names[role]!r}; name two")


LARGEST, SMALLEST = 1e30, 1e-30
"""Range of numbers in SI units: their fourth powers, the highest formed, fit in a float with room for sums."""
_MAX_RATE, _MIN_RATE = 200e3, 0.5
"""Rows a second: no sensor of force is read faster, and no contact is identified from fewer."""
_TIMES = {"min": 60.0, "s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
_CENTURY = (946_684_800.0, 4_102_444_800.0)
"""1 January of 2000 and of 2100 [s since 1970]."""
_USUAL_RATE = 1e3
"""Rows a second that a contact is usually recorded with."""


def epoch_unit(first: float, step: float) -> str | None:
    """The unit in which a time is a date between 2000 and 2100, and its rows come at a rate that there is.

    Args:
        first: of the time, as the file counts it.
        step: from row to row, likewise.
    """
    for symbol in ("s", "ms", "us", "ns"):
        begin, end = (seconds / _TIMES[symbol] for seconds in _CENTURY)
        if begin <= first < end and step > 0 and _MIN_RATE / 10 <= 1 / (step * _TIMES[symbol]) <= _MAX_RATE:
            return symbol
    return None


def usual_unit(step: float) -> str:
    """The unit of time in which rows so far apart come at about the usual rate; seconds if none is plausible.

    Args:
        step: from row to row, as the file counts it.
    """
    if step > 0 and _MIN_RATE <= 1 / step <= _MAX_RATE:
        return "s"
    near = min(_TIMES, key=lambda symbol: abs(np.log(max(step, 1e-300) * _TIMES[symbol] * _USUAL_RATE)))
    return near if step > 0 and 10 <= 1 / (step * _TIMES[near]) <= _MAX_RATE else "s"


def check_range(columns: Mapping[str, Array], names: Mapping[str, str], path: Path) -> None:
    """Refuse values that no measurement has and that calculations overflow by.

    Args:
        columns: in SI units, by role.
        names: their names in the file.
        path: of the log.

    Raises:
        InputError: a column and a value of it are named.
    """
    for role, values in columns.items():
        finite = values[np.isfinite(values)]
        if not len(finite):
            continue
        largest = float(finite[np.argmax(np.abs(finite))])
        span = float(np.ptp(finite))
        where = f"{path}: {names.get(role, role)!r} ({role})"
        if abs(largest) > LARGEST:
            raise InputError(
                f"{where} holds {largest:g} in SI units, which is no measurement; mend it, or its unit"
            )
        if 0 < span < SMALLEST:
            raise InputError(
                f"{where} changes by {span:g} in SI units in all, which is no measurement; mend it, or its unit"
            )


def implausible_times(loaded: Loaded, spec: str) -> list[dict[str, Any]]:
    """Doubts about the time of a log, as in a record's meta. Rows may be as rare as a stated unit says.

    Args:
        loaded: the columns, in SI units.
        spec: the user's name of the time, NAME or NAME:UNIT.

    Raises:
        InputError: the time runs backwards repeatedly.
    """
    columns, start = loaded.columns, loaded.start
    step = np.diff(columns["time"])
    if len(step) < 3 or not np.isfinite(step).all():
        return []
    back = int((step < 0).sum())
    if back:
        return _check_backwards(columns, step, back, spec)
    name = spec.rpartition(":")[0] or spec
    declared = ":" in spec
    dt = float(np.median(step[step > 0])) if (step > 0).any() else 0.0
    if not declared and np.all(step == 1.0) and start in {0.0, 1.0}:
        text = f"{name!r} is {start:g}, {start + 1:g}, {start + 2:g}, ...: it counts rows rather than seconds"
        return [_note("time-doubtful", f"{text}; give --rate with the rows a second instead of --time")]
    rare = 1 / _MIN_RATE if not loaded.time_stated else np.inf
    if dt and not 1 / _MAX_RATE <= dt <= rare:
        text = f"by {spec!r} there are {1 / dt:.3g} rows a second"
        return [_note("time-doubtful", f"{text}{_suggest_unit(name, dt, declared, spec)}")]
    return []


def _suggest_unit(name: str, dt: float, declared: bool, spec: str) -> str:
    """The unit by which the rate would be a usual one."""
    current = spec.rpartition(":")[2] if declared else "s"
    count = dt / _TIMES.get(current, 1.0)
    symbol = usual_unit(count)
    if symbol == current:
        return "; is its unit right?"
    return f"; is its unit {symbol}, with {1 / (count * _TIMES[symbol]):.4g} rows a second? Then say {name}:{symbol}"


def _check_backwards(columns: Mapping[str, Array], step: Array, back: int, spec: str) -> list[dict[str, Any]]:
    even = [role for role, values in columns.items() if role != "time" and _rises_evenly(values)]
    row = int(np.flatnonzero(step < 0)[0]) + 2
    text = f"the time {spec!r} goes back in {back} of {len(step)} rows (the first is row {row})"
    if even:
        raise InputError(f"{text}, while the {even[0]} goes on in even steps: are the two columns swapped?")
    if back > 0.1 * len(step):
        raise InputError(f"{text}: it is no time; name another column, or give --rate instead of --time")
    return []


def _rises_evenly(values: Array) -> bool:
    """True if a column rises or falls in even steps, as a time does."""
    step = np.diff(values[np.isfinite(values)])
    if len(step) < 10:
        return False
    middle = float(np.median(step))
    return bool((step * np.sign(middle) > 0).all() and np.abs(step - middle).max() < 0.5 * abs(middle))


def _note(code: str, text: str) -> dict[str, Any]:
    return {"code": code, "text": text}
