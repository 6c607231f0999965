"""Options that name the signals of a log and how they are read."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Group, Parameter

from palpate.cli.options.flags import SIGNED
from palpate.errors import InputError

if TYPE_CHECKING:
    from palpate.logs.limits import Limits
    from palpate.records import Record

_SHOWN = 40
Rotation = Literal["quaternion", "quaternion-wxyz", "rotation-vector", "rpy", "matrix", "matrix-by-columns"]
GB = 2.0
"""Largest unpacked size of a log [GB]; the default of `palpate.logs.limits`."""


@Parameter(name="*", group=Group("Signals of the log", sort_key=1))
@dataclass(frozen=True, kw_only=True)
class LogOptions:
    """Columns or topics of a log, and which rows of it.

    Parameters
    ----------
    time
        Column of the time, in s if no unit is given; dates and times (ISO 8601) too. A bag has its own.
    rate
        Rows per second, for a log without a column of time.
    position
        Column of the position, in m if no unit is given; the unit 1 does not convert. TOPIC.FIELD of a bag.
    force
        Column of the force, in N if no unit is given; g is the reading of a scale. TOPIC.FIELD of a bag.
    wrench
        Topic of the wrench in a bag, if it is not the only one; or columns fx,fy,fz or fx,fy,fz,tx,ty,tz.
    pose
        Topic of the pose in a bag, if it is not the only one; or columns x,y,z or x,y,z,qx,qy,qz,qw.
    rotation
        Representation of the orientation in the pose's columns: quaternion (qx,qy,qz,qw), quaternion-wxyz,
        rotation-vector (rx,ry,rz as UR does), rpy (roll,pitch,yaw about fixed axes), matrix (by rows) or
        matrix-by-columns.
    start
        Leave out the rows before, in seconds from the first row.
    end
        Leave out the rows after, in seconds from the first row.
    missing
        A value that means "no reading", as -1; may be repeated. Common ones are detected.
    delimiter
        Between two cells of a text log; detected if not given.
    max_size
        Largest unpacked size, in GB; a larger log is refused.
    max_seconds
        Longest time to read the log; a log that takes longer is refused.
    """

    time: str | None = None
    rate: float | None = None
    position: str | None = None
    force: str | None = None
    wrench: str | None = None
    pose: str | None = None
    rotation: Rotation = "quaternion"
    start: Annotated[float | None, SIGNED] = None
    end: float | None = None
    missing: Annotated[tuple[str, ...], Parameter(allow_leading_hyphen=True, negative=())] = ()
    delimiter: str | None = None
    max_size: float = GB
    max_seconds: float = 600.0

    @property
    def plain(self) -> bool:
        """Whether no column is named."""
        named = (self.time, self.rate, self.position, self.force, self.wrench, self.pose)
        return all(name is None for name in named)


def read(log: Path, options: LogOptions, *, samples: bool) -> Record:
    """The record of a log: of force and position, or of wrench and pose.

    Args:
        log: the file.
        options: its signals and rows.
        samples: keep the force's readings at their own times, for a fit of the sensor's own samples.

    Raises:
        InputError: the file or an option is wrong.
    """
    from palpate.logs.kinds import kind_of
    from palpate.logs.own_runs import is_run, read_run

    limits = limits_of(options.max_size, options.max_seconds)
    cut: dict[str, Any] = {
        "start": options.start,
        "end": options.end,
        "missing": options.missing,
        "limits": limits,
    }
    if options.plain and is_run(log):
        return read_run(log, **cut)
    if kind_of(log).is_bag:
        return _of_bag(log, options, cut, samples)
    return _of_table(log, options, cut | {"delimiter": options.delimiter, "rate": options.rate})


def limits_of(max_size: float, max_seconds: float) -> Limits:
    """Limits of size [GB] and time [s]."""
    from palpate.logs.limits import Limits

    return Limits(max_size * 1e9, max_seconds)


def _of_bag(log: Path, options: LogOptions, cut: dict[str, Any], samples: bool) -> Record:
    from palpate.logs import read_log, read_wrench_and_pose

    one = _one_axis(options)
    if options.time or options.rate:
        raise InputError(f"the messages of {log} have their own times; leave out --time and --rate")
    if one is None:
        return read_wrench_and_pose(
            log, options.wrench, options.pose, options.rotation, held="force_x" if samples else None, **cut
        )
    return read_log(log, held="force" if samples else None, **cut, **one)


def _of_table(log: Path, options: LogOptions, cut: dict[str, Any]) -> Record:
    from palpate.logs import read_log, read_wrench_and_pose
    from palpate.logs.kinds import kind_of
    from palpate.logs.roles import POSE, WRENCH
    from palpate.logs.tables import open_table

    table = open_table(log, kind_of(log), options.delimiter, cut["limits"])
    there = list(table.names)
    time = options.time or ("time" if "time" in there and options.rate is None else None)
    columns: dict[str, Any] = {} if time is None else {"time": time}
    saved = options.position is None and options.force is None and {*WRENCH[:3], *POSE[:3]} <= set(there)
    if options.wrench or options.pose or saved:
        _one_axis(options)
        own = [_saved(names, there) if saved else None for names in (WRENCH, POSE)]
        return read_wrench_and_pose(
            log,
            options.wrench or own[0],
            options.pose or own[1],
            "quaternion" if saved and options.pose is None else options.rotation,
            **cut,
            **columns,
        )
    names: dict[str, Any] = {
        role: getattr(options, role) or (role if role in there else None) for role in ("position", "force")
    }
    timed = bool(columns) or options.rate is not None or table.rate is not None
    lacking = [] if timed else ["time"]
    lacking += [role for role, name in names.items() if name is None]
    if lacking:
        flags = ", ".join(f"--{role}" for role in lacking) + (" (or --rate)" if "time" in lacking else "")
        listed = f"{', '.join(there[:_SHOWN])}{', ...' if len(there) > _SHOWN else ''}"
        raise InputError(
            f"name the columns of {log} with {flags}; there are: {listed} (palpate topics {log} proposes a command)"
        )
    return read_log(log, **cut, **columns, **names)


def _saved(names: Sequence[str], there: Sequence[str]) -> str:
    """The record's own columns that exist."""
    return ",".join(name for name in names if name in there)


def _one_axis(options: LogOptions) -> dict[str, Any] | None:
    """Force and position of one axis, if these were named.

    Raises:
        InputError: they are mixed with wrench and pose, or one of them is missing.
    """
    one = {"position": options.position, "force": options.force}
    named = {role: name for role, name in one.items() if name is not None}
    if named and (options.wrench or options.pose):
        raise InputError(
            "give --force and --position of one axis, or --wrench and --pose in three, not of both"
        )
    if len(named) == 1:
        other = "force" if "position" in named else "position"
        raise InputError(f"--{next(iter(named))} needs its --{other}, as TOPIC.FIELD")
    return named or None
