"""Columns of text, Parquet, MATLAB and spreadsheet files in SI units."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from palpate.arrays import Array
from palpate.errors import InputError
from palpate.logs.columns import find_sentinel
from palpate.logs.roles import Loaded, check_apart, check_quantity, epoch_unit, family, quantity, si_unit
from palpate.logs.tables import Sheet, Stated
from palpate.units import split_spec, unit, unit_in_name

_LOSSLESS = 2.0**53
"""Whole numbers above it are not exact as floats."""


def from_table(
    table: Sheet, columns: Mapping[str, str], rate: float | None, missing: Sequence[str | float]
) -> Loaded:
    """The columns asked for, by role as `NAME` or `NAME:UNIT`; time from its column or from the rows per second.

    Raises:
        InputError: a fault in the file or with these arguments.
    """
    places = {role: table.resolve(split_spec(spec)[0]) for role, spec in columns.items()}
    check_apart(places, {role: table.names[place] for role, place in places.items()}, table.path)
    words = [str(word) for word in missing]
    arrays = dict(zip(places, table.numbers(list(places.values()), words), strict=True))
    if not len(next(iter(arrays.values()))):
        raise InputError(f"{table.path} holds a header and no rows; give a log with a row for each sample")
    loaded = Loaded(arrays, {"time": "s"}, 0.0, list(table.notes))
    origin = _from_first(table, places, arrays)
    for role, spec in columns.items():
        name, stated = table.names[places[role]], table.stated.get(table.names[places[role]], Stated(None))
        epoch = _epoch(arrays["time"], origin) if role == "time" else None
        symbol = _symbol(role, spec, table, places[role], epoch, loaded.notes)
        if role != "time":
            loaded.notes += _missing(role, arrays[role], name, given=bool(words))
        loaded.units[role] = unit(symbol).si
        arrays[role] += stated.offset
        arrays[role] *= stated.scale * unit(symbol).factor
        if stated.scale != 1.0:
            loaded.facts.append(
                f"{name!r} is scaled by {stated.scale:g} {stated.unit} a volt, as {stated.where} says"
            )
        origin *= unit(symbol).factor if role == "time" else 1.0
    loaded.start = _time(table, arrays, rate, loaded) + origin
    return loaded


def _from_first(table: Sheet, places: Mapping[str, int], arrays: Mapping[str, Array]) -> float:
    """Take the first row's time off before it is scaled, in whole numbers where floats would lose some.

    Returns:
        The subtracted start, in the file's own unit; 0 without a time.
    """
    if "time" not in places or not np.isfinite(arrays["time"][0]):
        return 0.0
    time = arrays["time"]
    origin = float(time[0])
    counts = table.counts(places["time"]) if abs(origin) >= _LOSSLESS else None
    time[:] = time - origin if counts is None else counts - counts[0]
    return origin


def _epoch(time: Array, origin: float) -> str | None:
    """The unit in which a time counts from 1970; None if it does not."""
    steps = np.diff(time[:1000])
    return epoch_unit(origin + float(time[0]), float(np.median(steps)) if len(steps) else 0.0)


def _symbol(
    role: str, spec: str, table: Sheet, place: int, epoch: str | None, notes: list[dict[str, Any]]
) -> str:
    """The unit's symbol of one column: said, else stated in the file, else carried by the name, else SI."""
    name, symbol = split_spec(spec)
    own = table.names[place]
    stated = table.stated.get(own, Stated(None))
    if own in table.clocks:
        if (symbol or "s") != "s":
            raise InputError(
                f"{name!r} holds dates and times, which are read as seconds; leave :{symbol} out"
            )
        check_quantity(role, name, "s")
        return "s"
    if symbol is not None:
        check_quantity(role, name, symbol)
        _note_contradiction(name, symbol, own, role, stated, notes)
        return symbol
    if stated.unit is not None:
        check_quantity(role, name, stated.unit)
        if stated.where:
            text = f"{name!r} is taken in {stated.unit}, by {stated.where}; give {name}:UNIT if that is wrong"
            notes.append({"code": "unit-stated", "text": text})
        return stated.unit
    guess, why = unit_in_name(own, quantity(role)), "its name"
    if guess is None and epoch:
        guess, why = epoch, "its values, which then are dates"
    if guess and unit(guess).factor != 1.0:
        text = f"no unit was given for {own!r}: {guess} is taken from {why}; give {name}:{guess} or the right unit"
        notes.append({"code": "unit-guess", "text": text})
        return guess
    other = _other_unit(role, own)
    if other:
        text = f"{role} is read from {own!r}, whose name says {other}, a unit of {unit(other).quantity}"
        notes.append({"code": "columns-swapped", "text": f"{text}: is it the right column?"})
    return si_unit(role)


def _note_contradiction(
    name: str, symbol: str, own: str, role: str, stated: Stated, notes: list[dict[str, Any]]
) -> None:
    """Note that a unit is another than the column's name carries, or the file states."""
    other, where = (stated.unit, stated.where) if stated.unit and stated.where else (None, "its name")
    if other is None and name == own:  # a column that is named by its number is meant so
        other = unit_in_name(own, quantity(role))
    if other and unit(symbol) != unit(other):
        text = f"{name!r} is taken in {symbol} as given, but {where} says {other}: is it {name}:{other}?"
        notes.append({"code": "unit-doubtful", "text": text})


def _other_unit(role: str, name: str) -> str | None:
    """A unit that a column's name carries, of a quantity that the role is not."""
    others = {"time", "length", "force"} - {quantity(role)}
    if family(role) not in {"time", "position", "force"}:
        return None
    return next((symbol for other in sorted(others) if (symbol := unit_in_name(name, other))), None)


def _missing(role: str, values: Array, name: str, given: bool) -> list[dict[str, Any]]:
    """Turn values that mean "no reading" into NaN, and note it."""
    notes = []
    sentinel = None if given or role not in {"position", "force"} else find_sentinel(values)
    if sentinel is not None:
        values[values == sentinel] = np.nan
    count = int(np.isnan(values).sum())
    if count:
        share = f"{count} of {len(values)} rows ({count / len(values):.1%}) of {name!r}"
        why = f"hold {sentinel:g}, treated as no reading" if sentinel is not None else "hold no reading"
        row = int(np.flatnonzero(np.isnan(values))[0]) + 1
        notes.append(
            {
                "code": "missing-samples",
                "text": f"{share} {why} (the first is row {row}); they are interpolated",
            }
        )
    if count == len(values):
        raise InputError(f"column {name!r} ({role}) holds no reading at all")
    return notes


def _time(table: Sheet, arrays: dict[str, Array], rate: float | None, loaded: Loaded) -> float:
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


def _rate(table: Sheet, rate: float | None, loaded: Loaded) -> float:
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
