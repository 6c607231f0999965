"""From a log file to a record in SI units."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import msgspec
import numpy as np

from palpate.arrays import Array
from palpate.errors import InputError
from palpate.files.limits import ReadingLimits
from palpate.logs.bags import bag_reader
from palpate.logs.from_table import from_table
from palpate.logs.kinds import Kind, kind_of
from palpate.logs.roles import Loaded, check_range, implausible_times
from palpate.logs.tables import open_table
from palpate.logs.tables.parquet import read_record, stored_about
from palpate.logs.tables.sheet import own_columns, read_frame
from palpate.records import Record
from palpate.signals.low_pass import LowPass
from palpate.units import split_spec


# More than seven arguments: the options of a user's call.
def read_log(
    path: str | Path | Any,
    *,
    rate: float | None = None,
    start: float | None = None,
    end: float | None = None,
    missing: Sequence[str | float] = (),
    delimiter: str | None = None,
    held: str | None = None,
    limits: ReadingLimits | None = None,
    **columns: str,
) -> Record:
    """Read columns of a log into a record.

    `read_log("press.csv", time="time_s", position="position_mm:mm", force="force_mN:mN")` gives a record
    with the columns `time` [s, from 0], `position` [m] and `force` [N]. A file that palpate wrote needs no columns,
    and no more does one whose names, units and values leave nothing to guess.
    A bag gives fields of its messages, `read_log("press.mcap", position="/pose.pose.position.z",
    force="/wrench.wrench.force.z")`, aligned on the rows of the topic that has most messages.

    Args:
        path: text in columns (CSV, LabVIEW's .lvm, Aurora's .ddf, ...), Parquet, a spreadsheet, a MATLAB file (v4 to
            v7), a ROS 1 bag, or a ROS 2 bag (its folder, or an MCAP or SQLite file of it); time may be dates and times
            (ISO 8601). Or a table in memory: a DataFrame of polars or pandas, an Arrow table or stream, a mapping of
            arrays.
        rate: rows per second [1/s], for a log without a column of time that does not state its rate either.
        start: leave out the rows before it, in seconds from the first row [s].
        end: leave out the rows from it on, likewise [s].
        missing: values that mean "no reading"; they become NaN, as empty cells do. A plain one is found by itself.
        delimiter: between two cells of a CSV file; found when None.
        held: the column whose readings are not moved in time where a bag's other topic has more of them, as
            `identify(force_filter=...)` wants its force; each stands in the first row after it.
        limits: of unpacked size and time; 2 GB and 600 s when None.
        columns: by the name that the record gives it, a column's name or number with its unit: `NAME:UNIT`; of a bag
            `TOPIC.FIELD:UNIT`.

    Returns:
        A record whose `meta` holds `source`, `start_s` (the first row's own time), `notes` (assumptions), and,
        of a bag, `facts` (how it was read), `frames` (that its headers name, by column) and `position_from` (`joints`).

    Raises:
        InputError: a fault in the file or with these arguments, in one line.
    """
    if not isinstance(path, str | Path):
        frame = read_frame(path)
        loaded = from_table(frame, columns or own_columns(frame, rate), rate, missing)
        return _record(loaded, frame.path, start, end)
    path, kind = Path(path), kind_of(Path(path))
    if not columns:
        return read_record(path, limits)
    if kind.is_bag and rate is not None:
        raise InputError(f"the messages of {path} have their own times; leave out --rate")
    if kind.is_bag:
        with bag_reader().Bag(path, kind, limits) as bag:
            loaded = bag_reader().from_bag(bag, columns, missing, held)
    else:
        loaded = from_table(open_table(path, kind, delimiter, limits), columns, rate, missing)
    check_range(loaded.columns, {role: split_spec(spec)[0] for role, spec in columns.items()}, path)
    if "time" in columns:
        loaded.notes += implausible_times(loaded.columns, loaded.start, columns["time"])
    return _record(loaded, path, start, end)


def _record(loaded: Loaded, path: Path, start: float | None, end: float | None) -> Record:
    meta: dict[str, Any] = {"source": str(path), "start_s": loaded.start, "notes": loaded.notes}
    if loaded.facts:
        meta["facts"] = loaded.facts
    if loaded.frames:
        meta["frames"] = loaded.frames
    if loaded.joints:
        meta["position_from"] = "joints"
    kept = _cut(loaded.columns, start, end, path)
    return Record(kept, {name: loaded.units[name] for name in kept}, meta)


def columns_of(path: str | Path, delimiter: str | None = None) -> list[str]:
    """Names of a log's columns; numbers from 0 if it has no header.

    Raises:
        InputError: the file is missing or unreadable, or is a bag, which has topics.
    """
    kind = kind_of(Path(path))
    if kind.is_bag:
        raise InputError(f"{path} is a bag and has topics, not columns; palpate topics {path} lists them")
    return list(open_table(Path(path), kind, delimiter).names)


def _cut(arrays: dict[str, Array], start: float | None, end: float | None, path: Path) -> dict[str, Array]:
    if start is None and end is None:
        return arrays
    time = arrays["time"]
    slack = (
        1e-3 * float(np.median(np.abs(np.diff(time)))) if len(time) > 1 else 0.0
    )  # a row's time has rounding
    keep = (time >= (-np.inf if start is None else start - slack)) & (
        time < (np.inf if end is None else end - slack)
    )
    if not keep.any():
        span = f"{time.min():.6g} to {time.max():.6g} s"
        bounds = [
            f"--{name} {value:g}" for name, value in (("start", start), ("end", end)) if value is not None
        ]
        raise InputError(f"no row of {path} remains after {' and '.join(bounds)}; the log spans {span}")
    return {name: values[keep] for name, values in arrays.items()}


RUN = {"time": "t", "position": "x_measured", "force": "force_sampled"}
"""Columns of a run's record that form a log: the encoder's position, and the sampled force."""


def is_run(path: Path) -> bool:
    """Whether a file is the record of a run."""
    if kind_of(path) is not Kind.PARQUET:
        return False
    about = stored_about(path)
    return about is not None and set(RUN.values()) <= set(about.units)


def read_run(path: Path, **options: Any) -> Record:
    """Time, position and force of a run's record; `options` are those of `read_log`."""
    record = read_log(path, **(options | RUN))
    about = stored_about(path)
    if about is not None and "wire" in about.meta:
        fact = (
            "a press over a wire: force and position along its direction, the force relative to free motion"
        )
        source = "tip" if about.meta.get("position_from") == "tip" else "joints"
        meta = {**record.meta, "facts": [fact], "position_from": source, **_arm(path, about.meta["wire"])}
        return Record(record.columns, record.units, meta)
    fact = f"a run's record: {RUN['position']} and {RUN['force']}, with the record's own instruments"
    # Without a tool the bench's force is that on the surface itself.
    arm = {} if about is None else _arm(path, about.meta)
    return Record(record.columns, record.units, {**record.meta, **_NO_TOOL, **arm, "facts": [fact]})


def _arm(path: Path, known: Any) -> dict[str, Any]:
    """Compliances and masses on both sides of the force sensor, with standard deviations, if known."""
    if not isinstance(known, dict):
        return {}
    try:
        return {name: msgspec.convert(known[name], kind) for name, kind in _ARM.items() if name in known}
    except msgspec.ValidationError as error:
        raise InputError(f"{path}: its metadata of the arm is damaged ({error}); press again") from None


def measured_by(path: Path) -> dict[str, Any]:
    """The lag [s] and the force filter that a run's record states, as `palpate.identify` takes them; or neither.

    The lag is that of a fresh reading: the sensor's low-pass at rest, its wait, less what the position is late.
    """
    about = stored_about(path)
    instruments = about.meta.get("instruments") if about else None
    if instruments is None:
        return {}
    try:
        found = msgspec.convert(instruments, _Instruments)
    except msgspec.ValidationError as error:
        raise InputError(
            f"{path}: its metadata of the instruments is damaged ({error}); run it again"
        ) from None
    if found.force is None or found.force.filter == "unknown":
        return {}
    low_pass = LowPass.parse(found.force.filter)
    lag = low_pass.lag + found.force.delay_s - found.position.lag_s
    return {"lag": lag, "force_filter": found.force.filter if low_pass.roll_off else None}


_Kilograms = Annotated[float, msgspec.Meta(ge=0, le=1e3)]
_Followed = Annotated[float, msgspec.Meta(ge=-1e3, le=1e3)]
_Stiffness = Annotated[float, msgspec.Meta(gt=0, le=1e9)]
_Deviation = Annotated[float, msgspec.Meta(ge=0, le=1e9)]
_ARM: dict[str, Any] = {
    "robot_stiffness_N_per_m": tuple[_Stiffness, _Deviation],
    "robot_mass_kg": tuple[_Kilograms, _Kilograms],
    "tool_mass_kg": tuple[_Kilograms, _Kilograms],
    "tool_inertia_kg": tuple[_Followed, _Kilograms],
}
_NO_TOOL = {"tool_mass_kg": (0.0, 0.0)}


class _Force(msgspec.Struct, frozen=True):
    filter: str
    delay_s: float


class _Position(msgspec.Struct, frozen=True):
    lag_s: float = 0.0


class _Instruments(msgspec.Struct, frozen=True):
    force: _Force | None = None
    position: _Position = _Position()
