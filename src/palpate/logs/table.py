"""Columns of a file as arrays of numbers, read with polars and only where they are asked for."""

from __future__ import annotations

import io
import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from palpate.errors import InputError
from palpate.logs.clock import seconds_of_cells, seconds_of_text
from palpate.logs.columns import place_of
from palpate.logs.layout import Layout, find_layout
from palpate.logs.store import stored_about

if TYPE_CHECKING:
    import polars


class Table:
    """A file of columns: CSV in any of its dialects, or Parquet.

    Args:
        path: the file.
        delimiter: of a CSV file; found when None.
        parquet: whether it is Parquet.

    Raises:
        InputError: the file is of a kind that palpate does not read.
    """

    def __init__(self, path: Path, delimiter: str | None = None, *, parquet: bool = False) -> None:
        self.path, self.parquet = path, parquet
        self.units: dict[str, str] = {}
        self.clocks: set[str] = set()
        self.meta: dict[str, Any] = {}
        self.layout: Layout | None = None
        if self.parquet:
            self.names = self._open_parquet()
        else:
            self.layout = find_layout(path, delimiter)
            self.names = list(self.layout.names)

    def _open_parquet(self) -> list[str]:
        import polars

        about = stored_about(self.path) or {"units": {}, "meta": {}}
        self.units, self.meta = dict(about["units"]), dict(about["meta"])
        return list(polars.read_parquet_schema(self.path))

    def resolve(self, name: str) -> int:
        """The place of a column given by its name, or else by its number from 0.

        Raises:
            InputError: there is no such column (those there are, are listed), or there are two.
        """
        try:
            return place_of(name, self.names, self.path)
        except InputError as error:
            raise InputError(f"{error}{self._doubts(name)}") from None

    def _doubts(self, name: str) -> str:
        """What may be behind a column that is not there."""
        if name in self.names or name.isdigit():
            return ""
        text = ""
        if self.layout and len(self.names) == 1:
            text = (
                f" (only one column was found, parted by {self.layout.delimiter_name}; is the"
                " delimiter right, and does the table begin in the first line?)"
            )
        whole = next((own for own in self.names if own.startswith(f"{name}:")), None)
        return f"{text} (a name that holds a colon is given with its unit: {whole}:UNIT)" if whole else text

    def numbers(self, places: Sequence[int], missing: Sequence[str] = ()) -> list[NDArray[np.float64]]:
        """The columns at these places; an empty cell, or one that holds a word of `missing`, is NaN.

        Raises:
            InputError: a cell that is not a finite number; its row and its text are named.
        """
        frame = self._frame(places)
        columns = []
        for place in places:
            clock = self._clock(place)
            if clock is not None:
                self.clocks.add(self.names[place])
                columns.append(clock)
                continue
            values = frame[str(place)].to_numpy().astype(float, copy=True)
            values[np.isin(values, [float(word) for word in missing if _is_finite(word)])] = np.nan
            if not np.isfinite(values).all():
                self._check_cells(place, missing)
                values[~np.isfinite(values)] = np.nan
            columns.append(values)
        return columns

    def _clock(self, place: int) -> NDArray[np.float64] | None:
        """A column of dates and times in seconds; None if it is no such column."""
        if self.parquet:
            import polars

            if not polars.read_parquet_schema(self.path)[self.names[place]].is_temporal():
                return None
            return seconds_of_cells(polars.read_parquet(self.path, columns=[place]).to_series())
        cell = self._cell(place).alias("cell")
        first = self._text().select(cell).head(1).collect().to_series().to_list()
        if not first or not first[0] or _is_finite(first[0]) or seconds_of_text(first[0]) is None:
            return None
        cells = self._text().select(cell).collect().to_series().to_list()
        seconds = [seconds_of_text(text) for text in cells]
        if None in seconds:
            row = seconds.index(None)
            raise InputError(self._bad_cell(place, row, cells[row]))
        return np.array(seconds, float)

    def _frame(self, places: Sequence[int]) -> polars.DataFrame:
        import polars

        number = polars.Float64
        try:
            if self.parquet:
                lazy = polars.scan_parquet(self.path)
                picks = [
                    polars.col(self.names[i]).cast(number, strict=False).alias(str(i)) for i in set(places)
                ]
            else:
                lazy = self._text()
                picks = [self._cell(i).cast(number, strict=False).alias(str(i)) for i in set(places)]
            return lazy.select(picks).collect(engine="streaming")
        except polars.exceptions.PolarsError as error:
            line = (str(error).splitlines() or ["unreadable"])[0]
            if "n_extra" in line and self.layout:
                line = (
                    f"its rows hold more cells than its header's {len(self.names)};"
                    f" name every column, or part the cells by something that no number holds"
                )
            raise InputError(f"{self.path} cannot be read as a table: {line}") from None

    def _cell(self, place: int) -> polars.Expr:
        import polars

        cell = polars.col(f"column_{place + 1}").str.strip_chars()
        if self.layout and self.layout.decimal_comma:
            cell = cell.str.replace(",", ".", literal=True)
        return cell

    def _text(self) -> polars.LazyFrame:
        import polars

        layout = self.layout
        assert layout is not None
        schema = {f"column_{i + 1}": polars.String for i in range(len(layout.names))}
        source: Any = self.path
        delimiter = layout.delimiter
        if delimiter == " ":  # runs of spaces are one delimiter, which a CSV reader does not know
            source, delimiter = io.BytesIO("\n".join(_words(self.path)).encode()), ","
        return polars.scan_csv(
            source,
            separator=delimiter,
            has_header=False,
            skip_lines=layout.first_row - 1 if delimiter == layout.delimiter else int(layout.header),
            schema=schema,
            comment_prefix="#",
            truncate_ragged_lines=True,
        )

    def _check_cells(self, place: int, missing: Sequence[str]) -> None:
        """Find the first cell that holds something, and yet no finite number."""
        import polars

        lazy = polars.scan_parquet(self.path) if self.parquet else self._text()
        cell = polars.col(self.names[place]).cast(polars.String) if self.parquet else self._cell(place)
        value = cell.cast(polars.Float64, strict=False)
        words = [word.lower() for word in ("", *missing)]
        wrong = (
            cell.is_not_null() & ~cell.str.to_lowercase().is_in(words) & ~value.is_finite().fill_null(False)
        )
        found = (
            lazy.select(cell.alias("cell"), wrong.alias("wrong"))
            .with_row_index("row")
            .filter("wrong")
            .head(1)
        )
        for row, text, _ in found.collect().rows():
            raise InputError(self._bad_cell(place, int(row), text))

    def _bad_cell(self, place: int, row: int, text: Any) -> str:
        where = f"row {row + 1}"
        if self.layout and not self.layout.skip and self.layout.delimiter != " ":
            where += f" (line {self.layout.first_row + row})"
        name = self.names[place]
        return (
            f"{self.path}: column {name!r}, {where} holds {str(text)!r}, which is no finite number;"
            f" mend it, or say --missing {shlex.quote(str(text))} if it means that there is no reading"
        )


def _is_finite(word: str) -> bool:
    try:
        return bool(np.isfinite(float(word)))
    except ValueError:
        return False


def _words(path: Path) -> list[str]:
    with path.open(encoding="utf-8-sig") as file:
        lines = (line.split() for line in file if not line.startswith("#"))
        return [",".join(words) for words in lines if words]
