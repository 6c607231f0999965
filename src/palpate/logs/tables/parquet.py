"""Columns of a Parquet file, fields of structs included."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from palpate.errors import InputError
from palpate.logs.limits import Budget
from palpate.logs.store import polars_says, stored_about
from palpate.logs.tables.clock import seconds_of_cells
from palpate.logs.tables.columns import Array, Stated, as_counts, finite_words, place_of
from palpate.logs.tables.lines import NO_READING

if TYPE_CHECKING:
    import polars

_BYTES = 8


class Parquet:
    """The columns of a Parquet file; a field of a struct is `struct.field`.

    Args:
        path: the file.
        budget: of the log.

    Raises:
        InputError: it cannot be read.
    """

    def __init__(self, path: Path, budget: Budget) -> None:
        import polars

        self.path, self._budget = path, budget
        about = stored_about(path)
        with polars_says(path):
            schema = polars.read_parquet_schema(path)
            self._rows = polars.scan_parquet(path, glob=False).select(polars.len()).collect().item()
        self._columns = dict(_leaves(schema))
        self.names = list(self._columns)
        self.stated = {name: Stated(symbol) for name, symbol in about.units.items()} if about else {}
        self.left_out = {
            name: "a list" for name, dtype in schema.items() if isinstance(dtype, polars.List | polars.Array)
        }
        self.rate: float | None = None
        self.clocks: set[str] = set()
        self.notes: list[dict[str, Any]] = []

    def resolve(self, name: str) -> int:
        """The place of a column given by its name, or else by its number from 0."""
        if name in self.left_out:
            raise InputError(
                f"{self.path}: {name!r} holds {self.left_out[name]} a row; give a column of numbers"
            )
        return place_of(name, self.names, self.path)

    def numbers(self, places: Sequence[int], missing: Sequence[str] = ()) -> list[Array]:
        """The columns at these places; null, NaN and a word of `missing` are no reading.

        Raises:
            InputError: a cell that is not a finite number; its row and its text are named.
        """
        frame = self._frame(places)
        return [self._numbers(place, frame[str(place)], missing) for place in places]

    def glance(self, places: Sequence[int]) -> list[Array]:
        """The same; NaN too where something else than a number stands."""
        frame = self._frame(places)
        return [self._numbers(place, frame[str(place)], (), strict=False) for place in places]

    def counts(self, place: int) -> NDArray[np.int64] | None:
        """A column of whole numbers, exact; None if it holds others."""
        column = self._frame([place])[str(place)]
        return as_counts(column.to_numpy()) if column.dtype.is_integer() and not column.null_count() else None

    def _frame(self, places: Sequence[int]) -> polars.DataFrame:
        import polars

        self._budget.take(_BYTES * self._rows * len(set(places)))
        picks = [self._columns[self.names[i]].alias(str(i)) for i in set(places)]
        with polars_says(self.path):
            return polars.scan_parquet(self.path, glob=False).select(picks).collect(engine="streaming")

    def _numbers(
        self, place: int, cells: polars.Series, missing: Sequence[str], *, strict: bool = True
    ) -> Array:
        import polars

        if cells.dtype.is_temporal():
            self.clocks.add(self.names[place])
            return seconds_of_cells(cells)
        with polars_says(self.path):
            values = cells.cast(polars.Float64, strict=False).to_numpy().astype(float, copy=True)
        values[np.isin(values, finite_words(missing))] = np.nan
        wrong = ~np.isfinite(values) & cells.is_not_null().to_numpy()
        for row in np.flatnonzero(wrong) if strict else ():
            text = str(cells[int(row)])
            if text.strip().lower() not in NO_READING | {word.lower() for word in missing}:
                raise InputError(
                    f"{self.path}: column {self.names[place]!r}, row {row + 1} holds {text!r}, which is no finite"
                    f" number; mend it, or say --missing {text} if it means that there is no reading"
                )
        values[wrong] = np.nan
        return values


def _leaves(schema: Mapping[str, Any]) -> Iterator[tuple[str, polars.Expr]]:
    """Every column of a schema that is no list, and every field of its structs."""
    import polars

    for name, dtype in schema.items():
        if isinstance(dtype, polars.Struct):
            yield from _fields(name, polars.col(name), dtype)
        elif not isinstance(dtype, polars.List | polars.Array):
            yield name, polars.col(name)


def _fields(prefix: str, own: polars.Expr, struct: polars.Struct) -> Iterator[tuple[str, polars.Expr]]:
    import polars

    for field in struct.fields:
        name, value = f"{prefix}.{field.name}", own.struct.field(field.name)
        if isinstance(field.dtype, polars.Struct):
            yield from _fields(name, value, field.dtype)
        elif not isinstance(field.dtype, polars.List | polars.Array):
            yield name, value
