"""Columns of a text log in any of its dialects, read with polars and only where they are asked for."""

from __future__ import annotations

import csv
import io
import shlex
from collections.abc import Iterator, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from palpate.arrays import Array
from palpate.errors import InputError
from palpate.logs.limits import Budget
from palpate.logs.tables.clock import seconds_of_text
from palpate.logs.tables.columns import Stated, finite_words, is_finite, place_of
from palpate.logs.tables.layout import Layout, find_layout
from palpate.logs.tables.lines import COMMENTS, NO_READING, Parting, first_lines, lines_of
from palpate.logs.tables.preamble import read_preamble

if TYPE_CHECKING:
    import polars

_NEVER = "\x1f"
"""Stands in no log of text, so that polars takes each line for one cell."""
_CELL = "\x1e"
"""Likewise; parts cells whose quotes were taken off."""
_MANY = 32
"""Columns from which on a line is parted as a whole."""


class Text:
    """A log of lines of text: CSV in any of its dialects, .lvm, .ddf, a sheet of a spreadsheet.

    Args:
        path: the file, for messages too.
        budget: of the log.
        delimiter: between two cells; found when None.
        content: the text itself, where it does not come from the file.

    Raises:
        InputError: the file is no text, or has no rows of numbers.
    """

    def __init__(
        self, path: Path, budget: Budget, delimiter: str | None = None, content: str | None = None
    ) -> None:
        self.path = path
        self._content = content
        if content is None:
            budget.take(path.stat().st_size)
            lines, self._bare_returns = first_lines(path)
        else:
            lines, self._bare_returns = lines_of(content), False
        self.layout: Layout = find_layout(path, lines, delimiter)
        self.names = list(self.layout.names)
        preamble = read_preamble(self.layout.above, self.names)
        rows = {name: Stated(symbol, "the row of units") for name, symbol in self.layout.units.items()}
        self.stated: dict[str, Stated] = rows | preamble.columns
        self.rate = preamble.rate
        self.clocks: set[str] = set()
        self.left_out: dict[str, str] = {}
        self.notes: list[dict[str, Any]] = []

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
        """Likely reason for a missing column."""
        if name in self.names or name.isdigit():
            return ""
        text = ""
        if len(self.names) == 1:
            text = (
                f" (only one column was found, separated by {self.layout.delimiter_name}; is the"
                " delimiter right, and does the table begin in the first line?)"
            )
        whole = next((own for own in self.names if own.startswith(f"{name}:")), None)
        return f"{text} (a name that holds a colon is given with its unit: {whole}:UNIT)" if whole else text

    def numbers(self, places: Sequence[int], missing: Sequence[str] = ()) -> list[Array]:
        """The columns at these places; an empty cell, or one that holds a word of `missing`, is NaN.

        Lines that are no rows are left out, and said once.

        Raises:
            InputError: a cell that is not a finite number; its row and its text are named.
        """
        frame = self._frame(places)
        self._say_skipped(frame)
        return [self._column(column, place, missing) for place, column in self._found(frame, places)]

    def glance(self, places: Sequence[int]) -> list[Array]:
        """The same; NaN too where something else than a number or a date stands."""
        found = self._found(self._frame(places), places)
        return [
            column if isinstance(column, np.ndarray) else self._clock(place, strict=False)
            for place, column in found
        ]

    def _found(self, frame: polars.DataFrame, places: Sequence[int]) -> Iterator[tuple[int, Array | None]]:
        """Numbers of the whole rows, NaN where there are others; None for dates and times."""
        whole = frame.filter("whole")
        top = self._collected(self._rows().filter("whole").head(1)).get_column("text").first()
        cells = str(top or "").split(self._delimiter)
        for place in places:
            first = cells[place].strip() if place < len(cells) else ""
            if first and not is_finite(first) and seconds_of_text(first) is not None:
                yield place, None
            else:
                yield place, whole.get_column(str(place)).to_numpy().astype(float, copy=True)

    def counts(self, place: int) -> NDArray[np.int64] | None:
        """A column of whole numbers, exact; None if it holds others."""
        import polars

        cells = self._cells(place).filter("whole").get_column(str(place))
        counts = cells.cast(polars.Int64, strict=False)
        return None if counts.null_count() else counts.to_numpy()

    def _column(self, values: Array | None, place: int, missing: Sequence[str]) -> Array:
        if values is None:
            return self._clock(place)
        values[np.isin(values, finite_words(missing))] = np.nan
        if not np.isfinite(values).all():
            self._check_cells(place, missing)
            values[~np.isfinite(values)] = np.nan
        return values

    def _clock(self, place: int, *, strict: bool = True) -> Array:
        """A column of dates and times in seconds."""
        self.clocks.add(self.names[place])
        frame = self._cells(place).filter("whole")
        cells = frame.get_column(str(place)).to_list()
        seconds = [seconds_of_text(text) for text in cells]
        if strict and None in seconds:
            row = seconds.index(None)
            raise InputError(self._bad_cell(place, row, int(frame["line"][row]), cells[row]))
        return np.array(seconds, float)

    def _frame(self, places: Sequence[int]) -> polars.DataFrame:
        """Line, whether it is whole, and the numbers at some places, by place."""
        if len(places) > _MANY:
            return self._wide_frame(places)
        numbers = [self._number(self._cell(i)).alias(str(i)) for i in set(places)]
        return self._collected(
            self._rows().with_columns(self._parted(max(places))).select("line", "whole", *numbers)
        )

    def _wide_frame(self, places: Sequence[int]) -> polars.DataFrame:
        """The same for many places, which polars would else look for one after the other in every line."""
        import polars

        lists = self._collected(self._rows().with_columns(polars.col("text").str.split(self._delimiter)))
        cells = lists.get_column("text").list
        names = dict.fromkeys(map(str, places))
        frame = polars.DataFrame(
            [cells.get(int(i), null_on_oob=True).str.strip_chars().alias(i) for i in names]
        )
        return lists.select("line", "whole").hstack(frame.select(self._number(polars.col(i)) for i in names))

    def _cells(self, place: int) -> polars.DataFrame:
        """One column's cells as text."""
        rows = self._rows().with_columns(self._parted(place))
        return self._collected(rows.select("line", "whole", self._cell(place).alias(str(place))))

    def _collected(self, rows: polars.LazyFrame) -> polars.DataFrame:
        import polars

        try:
            return rows.collect(engine="streaming")
        except polars.exceptions.PolarsError as error:
            line = (str(error).splitlines() or ["unreadable"])[0]
            raise InputError(f"{self.path} cannot be read as a table: {line}") from None

    def _rows(self) -> polars.LazyFrame:
        """The lines from the first row on that are no comments, and whether they are whole."""
        import polars

        line, cell = polars.col("text"), self._delimiter
        text = line.str.strip_chars()
        marks = [mark for mark in COMMENTS if mark != self.layout.parting.delimiter]
        comment = polars.any_horizontal(text.str.starts_with(mark) for mark in marks)
        if cell == " ":
            line = text.str.replace_all(r"\s+", " ")
        count = line.str.count_matches(cell, literal=True) + 1
        bare = line.str.strip_chars_end(cell + " \t").str.count_matches(cell, literal=True) + 1
        cells = len(self.names)
        whole = (count >= cells) & (bare <= cells) & ~line.str.contains("\x00", literal=True)
        if self.layout.header:
            whole &= text != self.layout.header.strip()
        if self._labview:  # each block of rows has a header of its own
            whole &= text.str.contains(r"^[+\-.,]?\d") | line.str.starts_with(cell)
        return (
            self._lines()
            .filter(
                (polars.col("line") >= self.layout.first_row)
                & (text.str.strip_chars(cell + " \t") != "")
                & ~comment
            )
            .select("line", whole.alias("whole"), line.alias("text"))
        )

    def _parted(self, last: int) -> polars.Expr:
        """The cells of a line up to a last one."""
        import polars

        return polars.col("text").str.split_exact(self._delimiter, max(last, 1)).alias("cells")

    def _cell(self, place: int) -> polars.Expr:
        import polars

        return polars.col("cells").struct.field(f"field_{place}").str.strip_chars()

    def _number(self, cell: polars.Expr) -> polars.Expr:
        import polars

        if self.layout.parting.decimal_comma:
            cell = cell.str.replace(",", ".", literal=True)
        return cell.cast(polars.Float64, strict=False)

    @property
    def _delimiter(self) -> str:
        return _CELL if self.layout.quoted else self.layout.parting.delimiter

    @property
    def _labview(self) -> bool:
        return any(line.strip() == "***End_of_Header***" for line in self.layout.above)

    def _lines(self) -> polars.LazyFrame:
        """The log's lines by number, each as one text."""
        import polars

        return polars.scan_csv(
            self._source(),
            separator=_NEVER,
            quote_char=None,
            has_header=False,
            schema={"text": polars.String},
            row_index_name="line",
            row_index_offset=1,
            eol_char="\r" if self._bare_returns else "\n",
            encoding="utf8-lossy",
            truncate_ragged_lines=True,
            glob=False,
        ).with_columns(polars.col("text").fill_null(""))

    def _source(self) -> Any:
        if self.layout.quoted:
            return io.BytesIO(self._unquoted)
        return self.path if self._content is None else io.BytesIO(self._content.encode())

    @cached_property
    def _unquoted(self) -> bytes:
        """The text without the quotes around its cells."""
        content = self._content
        if content is None:
            content = self.path.read_text(encoding="utf-8-sig", errors="replace")
        parting = self.layout.parting
        return "\n".join(_CELL.join(_cells(line, parting)) for line in content.splitlines()).encode()

    def _say_skipped(self, frame: polars.DataFrame) -> None:
        lost = frame.filter(~frame["whole"]).get_column("line")
        self.notes = []
        if len(lost) == len(frame):
            raise InputError(f"{self.path} holds a header and no rows; give a log with a row for each sample")
        if not len(lost):
            return
        first, cells = lost[0], len(self.names)
        text = f"{len(lost)} lines are no rows of {cells} cells and are left out (the first is line {first})"
        if len(lost) == 1 and first == frame["line"][-1]:
            text = f"the last line ({first}) is cut short and is left out"
        self.notes = [{"code": "lines-skipped", "text": text}]

    def _check_cells(self, place: int, missing: Sequence[str]) -> None:
        """Find the first cell that holds something, and yet no finite number."""
        import polars

        frame = self._cells(place).filter("whole")
        cell = polars.col(str(place))
        words = [*NO_READING, *(word.lower() for word in missing)]
        finite = self._number(cell).is_finite().fill_null(False)
        wrong = frame.with_row_index("row").filter(
            cell.is_not_null() & ~cell.str.to_lowercase().is_in(words) & ~finite
        )
        for row, line, text in wrong.head(1).select("row", "line", str(place)).rows():
            if is_finite(text) and text in missing:
                continue
            raise InputError(self._bad_cell(place, int(row), int(line), text))

    def _bad_cell(self, place: int, row: int, line: int, text: Any) -> str:
        return (
            f"{self.path}: column {self.names[place]!r}, row {row + 1} (line {line}) holds {str(text)!r},"
            f" which is no finite number; mend it, or say --missing {shlex.quote(str(text))} if it means that there"
            " is no reading"
        )


def _cells(line: str, parting: Parting) -> list[str]:
    try:
        return next(csv.reader([line], delimiter=parting.delimiter), [])
    except csv.Error:
        return [line]
