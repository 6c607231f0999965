"""From a log file to a record in SI units."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.errors import InputError
from palpate.logs.missing import find_sentinel
from palpate.logs.store import read_record
from palpate.logs.table import Table
from palpate.records import Record
from palpate.units import split_spec, unit, unit_in_name

_QUANTITY = {"time": "time", "position": "length", "force": "force"}
_SI = {"time": "s", "position": "m", "force": "N"}


def read_log(
    path: str | Path,
    *,
    rate: float | None = None,
    start: float | None = None,
    end: float | None = None,
    missing: Sequence[str | float] = (),
    delimiter: str | None = None,
    **columns: str,
) -> Record:
    """Read columns of a log into a record.

    `read_log("press.csv", time="time_s", position="position_mm:mm", force="force_mN:mN")` gives a record
    with the columns `time` [s, from 0], `position` [m] and `force` [N]. A file that palpate wrote needs no columns.

    Args:
        path: CSV with or without a header, in any usual dialect, or Parquet; time may be dates and times (ISO 8601).
        rate: rows per second [1/s], for a log without a column of time.
        start: leave out the rows before it, in seconds from the first row [s].
        end: leave out the rows from it on, likewise [s].
        missing: values that mean "no reading"; they become NaN, as empty cells do. A plain one is found by itself.
        delimiter: between two cells of a CSV file; found when None.
        columns: by the name that the record gives it, a column's name or number with its unit: `NAME:UNIT`.

    Returns:
        A record whose `meta` holds `source`, `start_s` (the first row's own time) and `notes` (what was assumed).

    Raises:
        InputError: whatever is wrong with the file or with these arguments, in one line.
    """
    path = Path(path)
    if not columns:
        return read_record(path)
    table = Table(path, delimiter)
    places = {role: table.resolve(split_spec(spec)[0]) for role, spec in columns.items()}
    _check_apart(places, table)
    words = [str(word) for word in missing]
    arrays = dict(zip(places, table.numbers(list(places.values()), words), strict=True))
    if not len(next(iter(arrays.values()))):
        raise InputError(f"{path} holds a header and no rows; give a log with a row for each sample")
    notes: list[dict[str, Any]] = []
    units = {}
    for role, spec in columns.items():
        symbol, note = _symbol(role, spec, table, places[role])
        notes += note
        if role != "time":
            notes += _missing(role, arrays[role], table.names[places[role]], given=bool(words))
        units[role] = unit(symbol).si
        arrays[role] *= unit(symbol).factor
    meta: dict[str, Any] = {"source": str(path), "start_s": _from_zero(arrays, rate, path), "notes": notes}
    units.setdefault("time", "s")
    kept = _cut(arrays, start, end, path)
    return Record(kept, {name: units[name] for name in kept}, meta)


def _check_apart(places: dict[str, int], table: Table) -> None:
    """Time, position and force are three columns."""
    seen: dict[int, str] = {}
    for role in _QUANTITY.keys() & places.keys():
        other = seen.setdefault(places[role], role)
        if other != role:
            name = table.names[places[role]]
            both = " and ".join(sorted((other, role)))
            raise InputError(f"{both} cannot be the same column of {table.path}, {name!r}; name two")


def columns_of(path: str | Path, delimiter: str | None = None) -> list[str]:
    """Names of a log's columns; numbers from 0 if it has no header.

    Raises:
        InputError: the file is missing or is none that can be read.
    """
    return list(Table(Path(path), delimiter).names)


def _symbol(role: str, spec: str, table: Table, place: int) -> tuple[str, list[dict[str, Any]]]:
    """The unit's symbol of one column: said, else stored in the file, else carried by the name, else SI."""
    name, symbol = split_spec(spec)
    own = table.names[place]
    if own in table.clocks and (symbol or "s") != "s":
        raise InputError(f"{name!r} holds dates and times, which are read as seconds; leave :{symbol} out")
    if symbol is not None:
        _check_quantity(role, name, symbol)
        return symbol, []
    if own in table.clocks:
        _check_quantity(role, name, "s")
        return "s", []
    if own in table.units:
        return table.units[own], []
    guess = unit_in_name(own, _QUANTITY.get(role, ""))
    if guess and unit(guess).factor != 1.0:
        text = f"no unit was given for {own!r}: {guess} is taken from its name; say {name}:{guess} or what is right"
        return guess, [{"code": "unit-guess", "text": text}]
    return _SI.get(role, "1"), []


def _check_quantity(role: str, name: str, symbol: str) -> None:
    allowed = {
        "time": {"time"},
        "position": {"length", "angle", "number"},
        "force": {"force", "torque", "number"},
    }
    found = unit(symbol).quantity
    if found not in allowed.get(role, {found}):
        raise InputError(
            f"{symbol!r} of {name}:{symbol} is a unit of {found}; {role} needs one of {_QUANTITY[role]}"
        )


def _missing(role: str, values: NDArray[np.float64], name: str, given: bool) -> list[dict[str, Any]]:
    """Turn what means "no reading" into NaN, and say so."""
    notes = []
    sentinel = None if given else find_sentinel(values)
    if sentinel is not None:
        values[values == sentinel] = np.nan
    count = int(np.isnan(values).sum())
    if count:
        share = f"{count} of {len(values)} rows ({count / len(values):.1%}) of {name!r}"
        why = f"hold {sentinel:g}, taken as no reading" if sentinel is not None else "hold no reading"
        row = int(np.flatnonzero(np.isnan(values))[0]) + 1
        notes.append(
            {"code": "missing-samples", "text": f"{share} {why} (the first is row {row}); they are bridged"}
        )
    if count == len(values):
        raise InputError(f"column {name!r} ({role}) holds no reading at all")
    return notes


def _from_zero(arrays: dict[str, NDArray[np.float64]], rate: float | None, path: Path) -> float:
    """Make time start at 0, so that unix time keeps its digits; make it from the rate where there is no column."""
    n = len(next(iter(arrays.values())))
    if "time" not in arrays:
        if rate is None:
            raise InputError(
                "a log needs its time: name its column with --time, or give rows per second with --rate"
            )
        if not (np.isfinite(rate) and rate > 0):
            raise InputError(f"the rate must be above 0 rows a second, got {rate:g}")
        arrays["time"] = np.arange(n) / rate
        return 0.0
    if rate is not None:
        raise InputError("give the time's column or the rate, not both")
    time = arrays["time"]
    if np.isnan(time).any():
        row = int(np.flatnonzero(np.isnan(time))[0]) + 1
        raise InputError(f"{path}: row {row} has no time; remove the row, or give --rate instead of --time")
    origin = float(time[0])
    time -= origin
    return origin


def _cut(
    arrays: dict[str, NDArray[np.float64]], start: float | None, end: float | None, path: Path
) -> dict[str, NDArray[np.float64]]:
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
        raise InputError(f"no row of {path} is left by {' and '.join(bounds)}; the log spans {span}")
    return {name: values[keep] for name, values in arrays.items()}
