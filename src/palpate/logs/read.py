"""Logs and tables in memory as records in SI units."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

import msgspec
import numpy as np

from palpate.arrays import Array
from palpate.errors import InputError
from palpate.files.reading import ReadingLimits
from palpate.logs import bags, roles
from palpate.logs.formats import Kind, kind_of, open_table
from palpate.logs.tables.parquet import read_record, stored_about
from palpate.logs.tables.sheet import Sheet, Stated, find_sentinel, own_columns, read_frame
from palpate.records import Record
from palpate.signals.low_pass import LowPass
from palpate.units import split_spec, unit, unit_in_name


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
    join: Path | None = None,
    **columns: str,
) -> Record:
    """Read columns of a log into a record.

    `read_log("press.csv", time="time_s", position="position_mm:mm", force="force_mN:mN")` gives a record
    with the columns `time` [s, from 0], `position` [m] and `force` [N]. A file that palpate wrote needs no columns,
    and no more does one whose names, units and values leave nothing to guess.
    A bag gives fields of its messages, `read_log("press.mcap", position="/pose.pose.position.z",
    force="/wrench.wrench.force.z")`, aligned on the rows of the topic that has most messages.

    Args:
        path: text in columns (CSV, LabVIEW's .lvm, Aurora's .ddf, JSON, ...), Parquet, a spreadsheet, a MATLAB file,
            HDF5, npz, TDMS, an AFM curve, a ROS 1 bag, or a ROS 2 bag (its folder, or an MCAP or SQLite file of it);
            time may be dates and times (ISO 8601). Or a table in memory: a DataFrame of polars or pandas, an Arrow
            table or stream, a mapping of arrays.
        rate: rows per second [1/s], for a log without a column of time that does not state its rate either.
        start: leave out the rows before it, in seconds from the first row [s].
        end: leave out the rows from it on, likewise [s].
        missing: values that mean "no reading"; they become NaN, as empty cells do. A plain one is found by itself.
        delimiter: between two cells of a CSV file; found when None.
        held: the column whose readings are not moved in time where a bag's other topic has more of them, as
            `identify(force_filter=...)` wants its force; each stands in the first row after it.
        limits: of unpacked size and time; 2 GB and 600 s when None.
        join: a second log with further columns of the same time.
        columns: by the name that the record gives it, a column's name or number with its unit: `NAME:UNIT`; of a bag
            `TOPIC.FIELD:UNIT`.

    Returns:
        A record whose `meta` holds `source`, `start_s` (the first row's own time), `notes` (assumptions), and,
        of a bag, `facts` (how it was read), `frames` (that its headers name, by column) and `position_from` (`joints`);
        `time_stated` where the log or the name of the time says its unit.

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
    if kind.is_bag:
        if rate is not None:
            raise InputError(f"the messages of {path} have their own times; leave out --rate")
        with bags.Bag(path, kind, limits) as bag:
            loaded = bags.from_bag(bag, columns, missing, held)
    else:
        loaded = from_table(open_table(path, kind, delimiter, limits, join), columns, rate, missing)
    roles.check_range(loaded.columns, {role: split_spec(spec)[0] for role, spec in columns.items()}, path)
    if "time" in columns:
        loaded.notes += roles.implausible_times(loaded, columns["time"])
    return _record(loaded, path, start, end)


def _record(loaded: roles.Loaded, path: Path, start: float | None, end: float | None) -> Record:
    meta: dict[str, Any] = {"source": str(path), "start_s": loaded.start, "notes": loaded.notes}
    if loaded.facts:
        meta["facts"] = loaded.facts
    if loaded.frames:
        meta["frames"] = loaded.frames
    if loaded.joints:
        meta["position_from"] = "joints"
    if loaded.time_stated:
        meta["time_stated"] = True
    arrays = _cut(loaded.columns, start, end, path)
    return Record(arrays, {name: loaded.units[name] for name in arrays}, meta)


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
    """True if a file is the record of a run."""
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


def _arm(path: Path, entries: Any) -> dict[str, Any]:
    """Compliances and masses on both sides of the force sensor, with standard deviations, if known."""
    if not isinstance(entries, dict):
        return {}
    try:
        return {name: msgspec.convert(entries[name], kind) for name, kind in _ARM.items() if name in entries}
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
        sensors = msgspec.convert(instruments, _Instruments)
    except msgspec.ValidationError as error:
        raise InputError(
            f"{path}: its metadata of the instruments is damaged ({error}); run it again"
        ) from None
    if sensors.force is None or sensors.force.filter == "unknown":
        return {}
    low_pass = LowPass.parse(sensors.force.filter)
    lag = low_pass.lag + sensors.force.delay_s - sensors.position.lag_s
    return {"lag": lag, "force_filter": sensors.force.filter}


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


_LOSSLESS = 2.0**53
"""Whole numbers above it are not exact as floats."""


def from_table(
    table: Sheet, columns: Mapping[str, str], rate: float | None, missing: Sequence[str | float]
) -> roles.Loaded:
    """The columns asked for, by role as `NAME` or `NAME:UNIT`; time from its column or from the rows per second.

    Raises:
        InputError: a fault in the file or with these arguments.
    """
    places = {role: table.resolve(split_spec(spec)[0]) for role, spec in columns.items()}
    roles.check_apart(places, {role: table.names[index] for role, index in places.items()}, table.path)
    words = [str(word) for word in missing]
    arrays = dict(zip(places, table.numbers(list(places.values()), words), strict=True))
    filled = np.flatnonzero(np.any([np.isfinite(values) for values in arrays.values()], axis=0))
    rows = (
        slice(filled[0], filled[-1] + 1) if len(filled) else slice(None)
    )  # of two tests, one may be shorter
    arrays = {role: values[rows] for role, values in arrays.items()}
    if not len(next(iter(arrays.values()))):
        raise InputError(f"{table.path} holds a header and no rows; give a log with a row for each sample")
    loaded = roles.Loaded(arrays, {"time": "s"}, 0.0, list(table.notes))
    origin = _subtract_start(table, places, arrays, rows)
    for role, spec in columns.items():
        name = table.names[places[role]]
        stated = table.stated.get(table.names[places[role]], Stated(None))
        epoch = _epoch(arrays["time"], origin) if role == "time" else None
        symbol = _symbol(role, spec, table, places[role], epoch, loaded.notes)
        if role != "time":
            loaded.notes += _mark_missing(role, arrays[role], name, declared=bool(words))
        if role == "time":
            said = ":" in spec or stated.unit or unit_in_name(name, "time")
            loaded.time_stated = bool(said) or name in table.clocks
        loaded.units[role] = unit(symbol).si
        arrays[role] += stated.offset
        arrays[role] *= stated.scale * unit(symbol).factor
        if stated.scale != 1.0:
            loaded.facts.append(
                f"{name!r} is scaled by {stated.scale:g} {stated.unit} a {stated.of}, as {stated.where} says"
            )
        origin *= unit(symbol).factor if role == "time" else 1.0
    loaded.start = _time(table, arrays, rate, loaded) + origin
    return loaded


def _subtract_start(
    table: Sheet, places: Mapping[str, int], arrays: Mapping[str, Array], rows: slice
) -> float:
    """Take the first row's time off before it is scaled, in whole numbers where floats would lose some.

    Returns:
        The subtracted start, in the file's own unit; 0 without a time.
    """
    if "time" not in places or not np.isfinite(arrays["time"][0]):
        return 0.0
    time = arrays["time"]
    origin = float(time[0])
    counts = table.counts(places["time"]) if abs(origin) >= _LOSSLESS else None
    time[:] = time - origin if counts is None else (counts[rows] - counts[rows][0])
    return origin


def _epoch(time: Array, origin: float) -> str | None:
    """The unit in which a time counts from 1970; None if it does not."""
    steps = np.diff(time[:1000])
    return roles.epoch_unit(origin + float(time[0]), float(np.median(steps)) if len(steps) else 0.0)


def _symbol(
    role: str, spec: str, table: Sheet, index: int, epoch: str | None, notes: list[dict[str, Any]]
) -> str:
    """The unit's symbol of one column: said, else stated in the file, else carried by the name, else SI."""
    name, symbol = split_spec(spec)
    title = table.names[index]
    stated = table.stated.get(title, Stated(None))
    if title in table.clocks:
        if (symbol or "s") != "s":
            raise InputError(
                f"{name!r} holds dates and times, which are read as seconds; leave :{symbol} out"
            )
        roles.check_quantity(role, name, "s")
        return "s"
    if symbol is not None:
        roles.check_quantity(role, name, symbol)
        _note_contradiction(name, symbol, title, role, stated, notes)
        return symbol
    if stated.unit is not None:
        roles.check_quantity(role, name, stated.unit)
        if stated.where:
            text = f"{name!r} is taken in {stated.unit}, by {stated.where}; give {name}:UNIT if that is wrong"
            notes.append({"code": "unit-stated", "text": text})
        return stated.unit
    code = "unit-stated"
    why = "its name"
    carried = unit_in_name(title, roles.quantity(role))
    if carried is None and epoch:
        code = "unit-guess"
        why = "its values, which then are dates"
        carried = epoch
    if carried and unit(carried).factor != 1.0:
        text = (
            f"no unit was given for {title!r}: {carried} is taken from {why}; "
            f"give {name}:{carried} or the right unit"
        )
        notes.append({"code": code, "text": text})
        return carried
    mismatch = _other_unit(role, title)
    if mismatch:
        text = (
            f"{role} is read from {title!r}, whose name says {mismatch}, a unit of {unit(mismatch).quantity}"
        )
        notes.append({"code": "columns-swapped", "text": f"{text}: is it the right column?"})
    return roles.si_unit(role)


def _note_contradiction(
    name: str, symbol: str, column: str, role: str, stated: Stated, notes: list[dict[str, Any]]
) -> None:
    """Note that a unit is another than the column's name carries, or the file states."""
    contrary, where = (stated.unit, stated.where) if stated.unit and stated.where else (None, "its name")
    if contrary is None and name == column:  # a column that is named by its number is meant so
        contrary = unit_in_name(column, roles.quantity(role))
    if contrary and unit(symbol) != unit(contrary):
        text = (
            f"{name!r} is taken in {symbol} as given, but {where} says {contrary}: is it {name}:{contrary}?"
        )
        notes.append({"code": "unit-doubtful", "text": text})


def _other_unit(role: str, name: str) -> str | None:
    """A unit that a column's name carries, of a quantity that the role is not."""
    quantities = {"time", "length", "force"} - {roles.quantity(role)}
    if roles.family(role) not in {"time", "position", "force"}:
        return None
    return next((symbol for quantity in sorted(quantities) if (symbol := unit_in_name(name, quantity))), None)


def _mark_missing(role: str, values: Array, name: str, declared: bool) -> list[dict[str, Any]]:
    """Turn values that mean "no reading" into NaN, and note it."""
    notes = []
    sentinel = None if declared or role not in {"position", "force"} else find_sentinel(values)
    if sentinel is not None:
        values[values == sentinel] = np.nan
    count = int(np.isnan(values).sum())
    if count:
        rows = f"{count} of {len(values)} rows ({count / len(values):.1%}) of {name!r}"
        why = f"hold {sentinel:g}, treated as no reading" if sentinel is not None else "hold no reading"
        row = int(np.flatnonzero(np.isnan(values))[0]) + 1
        notes.append(
            {
                "code": "missing-samples",
                "text": f"{rows} {why} (the first is row {row}); they are interpolated",
            }
        )
    if count == len(values):
        raise InputError(f"column {name!r} ({role}) holds no reading at all")
    return notes


def _time(table: Sheet, arrays: dict[str, Array], rate: float | None, loaded: roles.Loaded) -> float:
    """Make time start at 0, so that unix time keeps its digits; make it from the rate where there is no column."""
    if "time" not in arrays:
        arrays["time"] = np.arange(len(next(iter(arrays.values())))) / _rate(table, rate, loaded)
        return 0.0
    if rate is not None:
        raise InputError("give the time's column or the rate, not both")
    time = arrays["time"]
    if np.isnan(time).any():
        row = int(np.flatnonzero(np.isnan(time))[0]) + 1
        raise InputError(
            f"{table.path}: row {row} has no time; remove the row, or give --rate instead of --time"
        )
    origin = float(time[0])
    time -= origin
    return origin


def _rate(table: Sheet, rate: float | None, loaded: roles.Loaded) -> float:
    """Rows per second: said, or stated in the file."""
    if rate is None and table.rate is not None:
        loaded.facts.append(
            f"timed by {table.rate:g} rows a second, as {Path(table.path).name} itself states"
        )
        return table.rate
    if rate is None:
        raise InputError(
            "a log needs its time: name its column with --time, or give rows per second with --rate"
        )
    if not (np.isfinite(rate) and rate > 0):
        raise InputError(f"the rate must be above 0 rows a second, got {rate:g}")
    if table.rate is not None and not np.isclose(rate, table.rate, rtol=1e-3):
        text = f"rows are taken at {rate:g} per second as given, but the file states {table.rate:g}"
        loaded.notes.append({"code": "time-doubtful", "text": text})
    return rate
