"""A file of columns: one value that the function of each format fills."""

import shlex
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from palpate.arrays import AnyArray, Array, Counts, Mask
from palpate.errors import InputError, unknown
from palpate.text import shorten

LONGEST = 200
"""Letters of a name; what is longer is text, and is shown by its beginning and its end."""

_MAX_QUOTED = 60
"""Letters of a cell that an error quotes."""


@dataclass(frozen=True)
class Stated:
    """Statements of the file about one of its columns.

    Args:
        unit: its symbol; None if the file gives none that palpate knows.
        where: the words for it: "the row of units"; empty where it goes without saying.
        scale, offset: a value in that unit is (number + offset) x scale.
        of: what the number counts.
    """

    unit: str | None
    where: str = ""
    scale: float = 1.0
    offset: float = 0.0
    of: str = "volt"


@dataclass(frozen=True)
class Cells:
    """One column as it was read.

    Args:
        numbers: shape (n,); NaN where there is no reading, and where a cell holds no finite number.
        wrong: the first such cell that holds something: its place, as "row 3", and its text; None if there is none.
        clock: it holds dates and times, which are seconds here.
    """

    numbers: Array
    wrong: tuple[str, str] | None = None
    clock: bool = False


def _no_counts(_: int) -> None:
    return None


def _no_doubt(_: str) -> str:
    return ""


@dataclass
class Sheet:
    """Columns of a file by name, read where they are asked for.

    Args:
        path: of the file.
        names: of the columns, in the file's order.
        read: the columns at some places, given the words that mean "no reading"; with what was left out, as in a
            record's meta.
        counts: a column of whole numbers, as exact as the file has them; None if it holds others.
        stated: statements of the file about its columns, by name.
        rate: rows per second, where the file states it [1/s].
        speed: of the probe, likewise [m/s].
        spring: stiffness of the cantilever that is the force sensor, likewise [N/m].
        left_out: variables that are no columns, by name, with their kinds.
        doubts: likely reason for a missing column, by its name.
        shorter: places of columns by further names.
        tables: title of each column's table, where the file has several: the columns of a log are of one.
        clocks: columns read so far that hold dates and times.
        notes: findings while reading, as in a record's meta.
    """

    path: Path
    names: list[str]
    read: Callable[[Sequence[int], Sequence[str]], tuple[list[Cells], list[dict[str, Any]]]]
    counts: Callable[[int], Counts | None] = _no_counts
    stated: dict[str, Stated] = field(default_factory=dict)
    rate: float | None = None
    left_out: dict[str, str] = field(default_factory=dict)
    doubts: Callable[[str], str] = _no_doubt
    shorter: dict[str, int] = field(default_factory=dict)
    tables: tuple[str, ...] = ()
    clocks: set[str] = field(default_factory=set)
    notes: list[dict[str, Any]] = field(default_factory=list)
    speed: float | None = None
    spring: float | None = None

    def __post_init__(self) -> None:
        self.names = [shorten(name, LONGEST) for name in self.names]
        self.stated = {shorten(name, LONGEST): statement for name, statement in self.stated.items()}

    def resolve(self, name: str) -> int:
        """The place of a column given by its name, or else by its number from 0.

        Raises:
            InputError: there is no such column (those there are, are listed), or there are two.
        """
        owner = next((title for title in (name, name.partition(".")[0]) if title in self.left_out), None)
        if name not in self.names and owner is not None:
            raise InputError(f"{self.path}: {owner!r} is {self.left_out[owner]}")
        places = [i for i, title in enumerate(self.names) if title == name]
        if len(places) > 1:
            numbers = ", ".join(map(str, places))
            raise InputError(
                f"{self.path} has {len(places)} columns named {name!r}; name one by number: {numbers}"
            )
        if places or name in self.shorter:
            return places[0] if places else self.shorter[name]
        if not (name.isascii() and name.isdigit()):
            raise InputError(f"{self.path}: {unknown('column', name, self.names)}{self.doubts(name)}")
        if len(name) > len(str(len(self.names))) or int(name) >= len(self.names):
            raise InputError(f"{self.path} has no column {name}; its columns are 0 to {len(self.names) - 1}")
        return int(name)

    def numbers(self, places: Sequence[int], missing: Sequence[str] = ()) -> list[Array]:
        """The columns at these places as the file has them, of one length; NaN where there is no reading.

        Args:
            places: of the columns.
            missing: words that mean "no reading"; so do empty cells.

        Raises:
            InputError: a cell that is not a finite number; its row and its text are named.
        """
        titles = {self.tables[index] for index in places} if self.tables else set()
        if len(titles) > 1:
            listed = ", ".join(sorted(titles))
            raise InputError(f"{self.path}: the columns of a log must be on one sheet, got {listed}")
        cells, self.notes = self.read(places, missing)
        columns = {self.names[index]: own for index, own in zip(places, cells, strict=True)}
        for name, own in columns.items():
            if own.wrong:
                where = own.wrong[0]
                text = shorten(own.wrong[1], _MAX_QUOTED)
                raise InputError(
                    f"{self.path}: column {name!r}, {where} holds {text!r}, which is no finite number; mend it,"
                    f" or say --missing {shlex.quote(text)} if it means that there is no reading"
                )
        lengths = {name: len(own.numbers) for name, own in columns.items()}
        if len(set(lengths.values())) > 1:
            listed = ", ".join(f"{name} {length}" for name, length in lengths.items())
            raise InputError(f"{self.path}: the columns of a log must have one length, got {listed}")
        self._note_clocks(places, cells)
        none = [float(word) for word in missing if is_finite(word)]
        arrays = [own.numbers.copy() for own in cells]
        for column in arrays if none else []:
            column[np.isin(column, none)] = np.nan
        return arrays

    def glance(self, places: Sequence[int]) -> list[Array]:
        """The columns, whatever their length; NaN where a cell is no number and no date."""
        cells, self.notes = self.read(places, ())
        self._note_clocks(places, cells)
        return [column.numbers for column in cells]

    def _note_clocks(self, places: Sequence[int], cells: Sequence[Cells]) -> None:
        self.clocks |= {
            self.names[index] for index, column in zip(places, cells, strict=True) if column.clock
        }


def is_finite(word: str) -> bool:
    """True if a word is a finite number."""
    try:
        return bool(np.isfinite(float(word)))
    except ValueError:
        return False


def as_counts(column: AnyArray) -> Counts | None:
    """An array of integers as signed ones; None if it holds others, or too large ones."""
    if column.dtype.kind not in "iu" or (
        column.dtype.kind == "u" and (column > np.iinfo(np.int64).max).any()
    ):
        return None
    return column.astype(np.int64)


_NANOSECONDS = 1e9


def read_frame(table: Any) -> Sheet:
    """The columns of a table in memory, as those of a file.

    Args:
        table: with names of columns, each of which is one array when it is asked for by its name.

    Raises:
        InputError: it is no such table.
    """
    columns = list(_columns(table).items())
    return Sheet(
        Path(f"the {type(table).__name__}"),
        [str(name) for name, _ in columns],
        lambda places, _: ([_cells(columns[i][1]) for i in places], []),
        lambda index: as_counts(columns[index][1]),
        clocks={str(name) for name, cells in columns if cells.dtype.kind == "M"},
    )


def _cells(cells: AnyArray) -> Cells:
    if cells.dtype.kind == "M":
        return Cells(cells.astype("datetime64[ns]").astype(np.int64) / _NANOSECONDS, clock=True)
    try:
        numbers = np.array(cells, dtype=float)
    except (TypeError, ValueError):
        return Cells(np.full(len(cells), np.nan), ("row 1", str(cells[0])))
    numbers[~np.isfinite(numbers)] = np.nan
    return Cells(numbers)


def own_columns(frame: Sheet, rate: float | None) -> dict[str, str]:
    """The columns of a table that names them as a record does: time, position and force.

    Raises:
        InputError: it does not.
    """
    roles = ("time", "position", "force") if rate is None else ("position", "force")
    if not set(roles) <= set(frame.names):
        raise InputError(
            f"{frame.path} has the columns {', '.join(frame.names[:12])}; say which are which, as in "
            'read_log(table, time="t", position="depth_mm:mm", force="load:N")'
        )
    return {name: name for name in roles}


def _columns(table: Any) -> dict[Any, AnyArray]:
    names = getattr(table, "column_names", None) or (
        list(table) if isinstance(table, Mapping) else getattr(table, "columns", None)
    )
    if names is None and hasattr(table, "__arrow_c_stream__"):
        import polars

        table = polars.DataFrame(table)
        names = table.columns
    if names is None:
        raise InputError(
            f"a log is a path, a DataFrame, an Arrow table or a mapping of arrays, not a {type(table).__name__}"
        )
    columns = {name: np.asarray(table[name]) for name in names}
    if len({column.shape for column in columns.values()}) != 1 or any(
        column.ndim != 1 for column in columns.values()
    ):
        shapes = {str(name): column.shape for name, column in columns.items()}
        raise InputError(f"the columns of a table have one length, got {shapes}")
    return columns


_SENTINELS = (-1.0, -9.0, -99.0, -999.0, -9999.0, -32768.0, 999.0, 9999.0, 65535.0, 99999.0, -3.697314e28)
"""Values that drivers return for "no reading", as a scale's -1 between two readings. NDI's trackers write the last for
a marker that they do not see."""


def find_sentinel(values: Array) -> float | None:
    """The value in a column, shape (n,), that plainly means "no reading"; None where there is none.

    It must be one of those that drivers use, occur again and again, lie on one side of all other
    values, and be left and returned to in jumps: a force of -1 on its way from 0 to -2 is a force.
    """
    for value in _SENTINELS:
        here = values == value
        if not 2 <= np.count_nonzero(here) < len(values) - 2:
            continue
        remaining = values[~here & np.isfinite(values)]
        if len(remaining) > 1 and _is_outside(value, remaining) and _is_left_in_jumps(values, here, value):
            return value
    return None


def _is_outside(value: float, readings: Array) -> bool:
    """True if the value lies where no reading does; a small negative one needs readings that are never negative."""
    low = float(readings.min())
    high = float(readings.max())
    if value < 0:
        return low >= 0 if value > -10 else value < low - (high - low)
    return value > high + (high - low)


def _is_left_in_jumps(values: Array, here: Mask, value: float) -> bool:
    """True if the typical reading beside this value is far from it, measured by their steps where they change."""
    next_values = values[1:][here[:-1] & ~here[1:]]
    if not len(next_values):
        return False
    steps = np.abs(np.diff(values[~here]))
    typical = float(np.median(steps[steps > 0])) if (steps > 0).any() else 0.0
    return float(np.median(np.abs(next_values - value))) > 3 * typical
