"""Columns of CSV, Parquet and MATLAB files in SI units."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.errors import InputError
from palpate.logs.columns import Columns
from palpate.logs.kinds import Kind
from palpate.logs.mat import MatFile
from palpate.logs.missing import find_sentinel
from palpate.logs.roles import Loaded, check_apart, check_quantity, quantity, si_unit
from palpate.logs.table import Table
from palpate.units import split_spec, unit, unit_in_name


def open_table(path: Path, kind: Kind, delimiter: str | None = None) -> Columns:
    """A file of columns, read where they are asked for."""
    if kind is Kind.MAT:
        return MatFile(path)
    return Table(path, delimiter, parquet=kind is Kind.PARQUET)


def from_table(
    table: Columns, columns: Mapping[str, str], rate: float | None, missing: Sequence[str | float]
) -> Loaded:
    """The columns asked for, by role as `NAME` or `NAME:UNIT`; time from its column or from the rows per second.

    Raises:
        InputError: whatever is wrong with the file or with these arguments.
    """
    places = {role: table.resolve(split_spec(spec)[0]) for role, spec in columns.items()}
    check_apart(places, {role: table.names[place] for role, place in places.items()}, table.path)
    words = [str(word) for word in missing]
    arrays = dict(zip(places, table.numbers(list(places.values()), words), strict=True))
    if not len(next(iter(arrays.values()))):
        raise InputError(f"{table.path} holds a header and no rows; give a log with a row for each sample")
    notes: list[dict[str, Any]] = []
    units = {"time": "s"}
    for role, spec in columns.items():
        symbol, note = _symbol(role, spec, table, places[role])
        notes += note
        if role != "time":
            notes += _missing(role, arrays[role], table.names[places[role]], given=bool(words))
        units[role] = unit(symbol).si
        arrays[role] *= unit(symbol).factor
    start = _from_zero(arrays, rate, table.path)
    return Loaded(arrays, units, start, notes)


def _symbol(role: str, spec: str, table: Columns, place: int) -> tuple[str, list[dict[str, Any]]]:
    """The unit's symbol of one column: said, else stored in the file, else carried by the name, else SI."""
    name, symbol = split_spec(spec)
    own = table.names[place]
    if own in table.clocks and (symbol or "s") != "s":
        raise InputError(f"{name!r} holds dates and times, which are read as seconds; leave :{symbol} out")
    if symbol is not None:
        check_quantity(role, name, symbol)
        return symbol, []
    if own in table.clocks:
        check_quantity(role, name, "s")
        return "s", []
    if own in table.units:
        return table.units[own], []
    guess = unit_in_name(own, quantity(role))
    if guess and unit(guess).factor != 1.0:
        text = f"no unit was given for {own!r}: {guess} is taken from its name; say {name}:{guess} or what is right"
        return guess, [{"code": "unit-guess", "text": text}]
    return si_unit(role), []


def _missing(role: str, values: NDArray[np.float64], name: str, given: bool) -> list[dict[str, Any]]:
    """Turn what means "no reading" into NaN, and say so."""
    notes = []
    sentinel = None if given or role not in {"position", "force"} else find_sentinel(values)
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
