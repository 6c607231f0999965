"""Columns of a text log in any of its dialects, read with polars and only where they are asked for."""

import csv
import io
import zlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any
from zipfile import BadZipFile, ZipFile

import numpy as np
import polars

from palpate.arrays import Counts
from palpate.errors import InputError
from palpate.files.reading import ReadingBudget
from palpate.logs.tables import lines
from palpate.logs.tables.layout import LABVIEW_HEADER_END, Layout, find_layout, read_preamble
from palpate.logs.tables.sheet import Cells, Sheet, Stated, is_finite

_NO_DELIMITER = "\x1f"
"""Delimiter that no text holds, so that polars takes each line for one cell."""
_CELL_MARK = "\x1e"
"""Delimiter, likewise, of cells without their quotes."""
_MIN_WIDE_COLUMNS = 32
"""Columns from which on each line is split as a whole."""
_BYTES, _PIECE_BYTES = 8, 1 << 20
_FIRST_BYTES = 4096


def read_text_sheet(
    path: Path,
    budget: ReadingBudget,
    delimiter: str | None = None,
    content: str | None = None,
    above: int = 0,
) -> Sheet:
    """A log of lines of text: CSV in any of its dialects, .lvm, .ddf, JSON, a sheet of a spreadsheet.

    Args:
        path: the file, for messages too.
        budget: of the log.
        delimiter: between two cells; found when None.
        content: the text itself, where it does not come from the file.
        above: lines of it that the file does not have.

    Raises:
        InputError: the file is no text, or has no rows of numbers.
    """
    content = _unzip(path, budget) if content is None else content
    if content is None:
        budget.take(path.stat().st_size)
        with path.open("rb") as file:
            json = lines.is_json(file.read(_FIRST_BYTES))
        head, bare_returns = ([], False) if json else lines.first_lines(path)
        if json or (not bare_returns and any(mark in line.text for line in head for mark in ":=[(")):
            from palpate.logs.tables.rewriting import rewrite_json, rewriter

            if json:
                return read_text_sheet(path, budget, ",", rewrite_json(path, budget), above=1)
            rewrite = rewriter(head)
            if rewrite is not None:
                return read_text_sheet(path, budget, delimiter, *rewrite(path, budget))
    else:
        head = lines.lines_of(path, content)
        bare_returns = False
    layout = find_layout(path, head, budget, delimiter)
    names = list(layout.names)
    first = next((line.text for line in head if line.number == layout.first_row), "")
    preamble = read_preamble(layout.above, names, layout.dialect.split(first))
    units = {name: Stated(symbol, "the row of units") for name, symbol in layout.units.items()}
    if content is None and not layout.quoted and layout.dialect.delimiter != " ":
        layout = replace(layout, quoted=_holds_quotes(path, layout.first_row))
    rows = _TextRows(path, layout, budget, bare_returns, content, above)
    return Sheet(
        path, names, rows.read, rows.counts, units | preamble.columns, preamble.rate,
        doubts=lambda name: _doubts(name, layout), speed=preamble.speed, spring=preamble.spring,
    )  # fmt: skip


def _unzip(path: Path, budget: ReadingBudget) -> str | None:
    """The text of the only file in a zip archive; None of anything else."""
    try:
        with ZipFile(path) as packed:
            (part,) = packed.infolist()
            budget.take(part.file_size)
            with packed.open(part) as file:
                return file.read(part.file_size).decode(errors="replace")
    except (BadZipFile, ValueError):
        return None
    except (OSError, RuntimeError, EOFError, zlib.error) as error:
        raise InputError(f"{path} cannot be unpacked ({error}); is it whole?") from None


def _holds_quotes(path: Path, first_row: int) -> bool:
    """True if a quote stands below the header: the rows that are looked at need not have one."""
    with path.open("rb") as file:
        for _ in range(first_row - 1):
            file.readline()
        return any(b'"' in piece for piece in iter(lambda: file.read(_PIECE_BYTES), b""))


def _doubts(name: str, layout: Layout) -> str:
    """Likely reason for a missing column."""
    text = ""
    if len(layout.names) == 1:
        text = (
            f" (only one column was found, separated by {layout.delimiter_name}; is the"
            " delimiter right, and does the table begin in the first line?)"
        )
    candidate = next((column for column in layout.names if column.startswith(f"{name}:")), None)
    return (
        f"{text} (a name that holds a colon is given with its unit: {candidate}:UNIT)" if candidate else text
    )


@dataclass
class _TextRows:
    """The rows of a text log."""

    path: Path
    layout: Layout
    budget: ReadingBudget
    bare_returns: bool
    content: str | None
    above: int = 0

    def read(self, places: Sequence[int], missing: Sequence[str]) -> tuple[list[Cells], list[dict[str, Any]]]:
        """Columns of the whole rows; a note says once which lines are none."""
        frame = self._frame(places)
        notes = self._note_skipped(frame)
        rows = frame.filter("whole")
        return [self._column(rows, index, missing) for index in places], notes

    def _place(self, row: int, line: int) -> str:
        return f"row {row + 1} (line {line - self.above})"

    def _column(self, rows: polars.DataFrame, index: int, missing: Sequence[str]) -> Cells:
        first = self._first[index].strip() if index < len(self._first) else ""
        if first and not is_finite(first) and lines.seconds_of_text(first) is not None:
            return self._clock(index)
        numbers = rows.get_column(str(index)).to_numpy().astype(float, copy=True)
        absent = ~np.isfinite(numbers)
        wrong = self._wrong(index, missing) if absent.any() else None
        numbers[absent] = np.nan
        return Cells(numbers, wrong)

    def _clock(self, index: int) -> Cells:
        """A column of dates and times."""
        frame = self._cells(index)
        cells = frame.get_column(str(index)).to_list()
        seconds = [lines.seconds_of_text(text) for text in cells]
        self.budget.take(0)
        row = seconds.index(None) if None in seconds else None
        wrong = None if row is None else (self._place(row, frame["line"][row]), str(cells[row]))
        return Cells(np.array(seconds, float), wrong, clock=True)

    def _wrong(self, index: int, missing: Sequence[str]) -> tuple[str, str] | None:
        """The first cell that holds something, and yet no finite number."""
        cell = polars.col(str(index))
        words = [*lines.NO_READING, *(word.lower() for word in missing)]
        finite = self._number(cell).is_finite().fill_null(False)
        wrong = cell.is_not_null() & ~cell.str.to_lowercase().is_in(words) & ~finite
        rows = self._cells(index).with_row_index("row").filter(wrong).head(1)
        return next(((self._place(row, line), str(text)) for row, line, text in rows.rows()), None)

    def counts(self, index: int) -> Counts | None:
        """A column of whole numbers, exact; None if it holds others."""
        counts = self._cells(index).get_column(str(index)).cast(polars.Int64, strict=False)
        return None if counts.null_count() else counts.to_numpy()

    def _note_skipped(self, frame: polars.DataFrame) -> list[dict[str, Any]]:
        lost = frame.filter(~frame["whole"]).get_column("line")
        if len(lost) == len(frame):
            raise InputError(f"{self.path} holds a header and no rows; give a log with a row for each sample")
        glued = f"the first row hangs on the names in line {self.layout.glued} and is left out"
        notes = [{"code": "lines-skipped", "text": glued}] if self.layout.glued else []
        if not len(lost):
            return notes
        first = lost[0] - self.above
        cells = len(self.layout.names)
        text = f"{len(lost)} lines are no rows of {cells} cells and are left out (the first is line {first})"
        if len(lost) == 1 and lost[0] == frame["line"][-1]:
            text = f"the last line ({first}) is cut short and is left out"
        return [*notes, {"code": "lines-skipped", "text": text}]

    def _frame(self, places: Sequence[int]) -> polars.DataFrame:
        """Line, whether it is whole, and the numbers at some places, by place."""
        count = int(self._collect(self._rows.select(polars.len())).item())
        self.budget.check(_BYTES * count * len(places))
        if len(places) > _MIN_WIDE_COLUMNS:
            return self._wide_frame(places)
        numbers = [self._number(_cell(i)).alias(str(i)) for i in set(places)]
        return self._collect(
            self._rows.with_columns(self._cells_up_to(max(places))).select("line", "whole", *numbers)
        )

    def _wide_frame(self, places: Sequence[int]) -> polars.DataFrame:
        """Read many columns, splitting each line once and not once for each column."""
        lists = self._collect(self._rows.with_columns(polars.col("text").str.split(self._delimiter)))
        cells = lists.get_column("text").list
        names = dict.fromkeys(map(str, places))
        frame = polars.DataFrame(
            [cells.get(int(i), null_on_oob=True).str.strip_chars().alias(i) for i in names]
        )
        return lists.select("line", "whole").hstack(frame.select(self._number(polars.col(i)) for i in names))

    def _cells(self, index: int) -> polars.DataFrame:
        """One column's cells as text, of the whole rows, and their lines."""
        rows = self._rows.with_columns(self._cells_up_to(index)).filter("whole")
        return self._collect(rows.select("line", _cell(index).alias(str(index))))

    @cached_property
    def _first(self) -> list[str]:
        """The cells of the first whole row."""
        top = self._collect(self._rows.filter("whole").head(1)).get_column("text").first()
        return str(top or "").split(self._delimiter)

    def _collect(self, rows: polars.LazyFrame) -> polars.DataFrame:
        self.budget.take(0)
        try:
            return rows.collect(engine="streaming")
        except polars.exceptions.PolarsError as error:
            line = (str(error).splitlines() or ["unreadable"])[0]
            raise InputError(f"{self.path} cannot be read as a table: {line}") from None

    @cached_property
    def _rows(self) -> polars.LazyFrame:
        """The lines from the first row on that are no comments, and whether they are whole."""
        line = polars.col("text")
        cell = self._delimiter
        text = line.str.strip_chars()
        marks = [mark for mark in lines.COMMENTS if mark != self.layout.dialect.delimiter]
        comment = polars.any_horizontal(text.str.starts_with(mark) for mark in marks)
        if cell == " ":
            line = text.str.replace_all(r"\s+", " ")
        count = line.str.count_matches(cell, literal=True) + 1
        bare = line.str.strip_chars_end(cell + " \t").str.count_matches(cell, literal=True) + 1
        cells = len(self.layout.names)
        complete = (count >= cells) & (bare <= cells) & ~line.str.contains("\x00", literal=True)
        if self.layout.header:
            complete &= text != self.layout.header.strip()
        if any(
            above.strip() == LABVIEW_HEADER_END for above in self.layout.above
        ):  # each block has a header of its own
            complete &= text.str.contains(r"^[+\-.,]?\d") | line.str.starts_with(cell)
        return (
            self._lines()
            .filter(
                (polars.col("line") >= self.layout.first_row)
                & (text.str.strip_chars(cell + " \t") != "")
                & ~comment
            )
            .select("line", complete.alias("whole"), line.alias("text"))
        )

    def _cells_up_to(self, last: int) -> polars.Expr:
        """The cells of a line up to a last one."""
        return polars.col("text").str.split_exact(self._delimiter, max(last, 1)).alias("cells")

    def _number(self, cell: polars.Expr) -> polars.Expr:
        """Numbers of cells; points or commas that part thousands are left out."""
        comma = self.layout.dialect.decimal_comma
        if self._delimiter != ",":
            pattern, mark = (lines.POINTED_THOUSANDS, ".") if comma else (lines.THOUSANDS, ",")
            parted = cell.str.contains(f"^(?:{pattern})$")
            cell = polars.when(parted).then(cell.str.replace_all(mark, "", literal=True)).otherwise(cell)
        if comma:
            cell = cell.str.replace(",", ".", literal=True)
        return cell.cast(polars.Float64, strict=False)

    @property
    def _delimiter(self) -> str:
        return _CELL_MARK if self.layout.quoted else self.layout.dialect.delimiter

    def _lines(self) -> polars.LazyFrame:
        """The log's lines by number, each as one text."""
        return polars.scan_csv(
            self._source,
            separator=_NO_DELIMITER,
            quote_char=None,
            has_header=False,
            schema={"text": polars.String},
            row_index_name="line",
            row_index_offset=1,
            eol_char="\r" if self.bare_returns else "\n",
            encoding="utf8-lossy",
            truncate_ragged_lines=True,
            glob=False,
        ).with_columns(polars.col("text").fill_null(""))

    @cached_property
    def _source(self) -> Any:
        """The file where polars can open it: by a name in UTF-8, and cells without quotes; else its content."""
        if self.layout.quoted:
            return io.BytesIO(self._remove_quotes())
        if self.content is not None:
            return io.BytesIO(self.content.encode())
        try:
            str(self.path).encode()
        except UnicodeEncodeError:
            return io.BytesIO(self.path.read_bytes())
        return self.path

    def _remove_quotes(self) -> bytes:
        """The text without the quotes around its cells."""
        if self.content is not None:
            return self._join_unquoted(self.content.splitlines())
        with self.path.open(encoding="utf-8-sig", errors="replace") as file:
            return self._join_unquoted(file)

    def _join_unquoted(self, texts: Iterable[str]) -> bytes:
        out = io.BytesIO()
        for line in lines.join_quoted(text.rstrip("\r\n") for text in texts):
            out.write(_CELL_MARK.join(_cells(line, self.layout.dialect)).encode(errors="replace") + b"\n")
            self.budget.take(0)
        return out.getvalue()


def _cell(index: int) -> polars.Expr:
    return polars.col("cells").struct.field(f"field_{index}").str.strip_chars()


def _cells(line: str, dialect: lines.Dialect) -> list[str]:
    try:
        return next(csv.reader([line], delimiter=dialect.delimiter), [])
    except csv.Error:
        return [line]
