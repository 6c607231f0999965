"""The lines of a text log: its first lines, their delimiter, the kinds of cells, dates and times as seconds."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

from palpate.arrays import Array
from palpate.errors import InputError

if TYPE_CHECKING:
    import polars

HEAD_BYTES = 4_000_000
"""Bytes at the beginning of a file from which the layout is found."""
_MAX_HEAD_LINES = 1000
_MAX_HEAD_LETTERS = 500_000
_MIN_HEAD_LINES = 4
"""Maximum lines and letters that are split to find the layout, and minimum lines: a header, its units and two rows."""
COMMENTS = ("#", "%", "//", ";")
"""Beginnings of a comment line; a semicolon only if it is not the delimiter."""
NO_READING = {"", "nan", "na", "n/a", "null", "none", "missing", "-", "--", "#n/a"}
"""Words that stand for no reading, in lower case."""

_OTHER_FORMATS = {
    b"\x1f\x8b": "is compressed by gzip; unpack it first",
    b"BZh": "is compressed by bzip2; unpack it first",
    b"\x28\xb5\x2f\xfd": "is compressed by zstd; unpack it first",
    b"PK\x03\x04": "is a zip archive of several files; unpack it first",
    b"\xd0\xcf\x11\xe0": "is a spreadsheet of the old kind (.xls); save it as .xlsx or CSV",
    b"\xff\xfe": "is UTF-16 text; save it as UTF-8",
    b"\xfe\xff": "is UTF-16 text; save it as UTF-8",
}
"""First bytes of other file formats."""
THOUSANDS = r"[+-]?[1-9]\d{0,2}(?:,\d{3})+(?:\.\d*)?"
"""A number whose thousands are parted by commas, as testing machines print them: 1,000.12."""
POINTED_THOUSANDS = r"[+-]?[1-9]\d{0,2}(?:\.\d{3})+,\d*"
"""Likewise by points, where the comma is decimal: 1.000,12."""
# No pattern here looks twice at a letter: a hostile line takes as long as any other.
_NUMBER = re.compile(r"[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?")
_COMMA_NUMBER = re.compile(rf"[+-]?(?:\d+(?:[.,]\d*)?|[.,]\d+)(?:[eE][+-]?\d+)?|{POINTED_THOUSANDS}")
_THOUSANDS = re.compile(THOUSANDS)
_SPACED = re.compile(r"\[[^\[\]]*\]|\([^()]*\)|[^\s\[(]+(?:\s*(?:\[[^\[\]]*\]|\([^()]*\)))?")
"""A name in a header parted by spaces, with its unit in brackets: `Force [N]`."""


@dataclass(frozen=True)
class TextLine:
    """One line that holds something.

    Args:
        number: in the file, from 1.
        text: without the mark of a comment.
        comment: whether it had one.
    """

    number: int
    text: str
    comment: bool


@dataclass(frozen=True)
class Dialect:
    """Delimiter of the cells and format of the numbers of a text log.

    Args:
        delimiter: one character; a space stands for any run of white space.
        decimal_comma: numbers are written 1,5.
    """

    delimiter: str
    decimal_comma: bool = False

    def split(self, text: str) -> list[str]:
        """The cells of a line, without white space around them."""
        if self.delimiter == " ":
            return text.split()
        if '"' not in text:
            return [cell.strip() for cell in text.split(self.delimiter)]
        try:
            return [cell.strip() for cell in next(csv.reader([text], delimiter=self.delimiter), [])]
        except csv.Error:  # a cell longer than the library takes, or a quote that never ends
            return [cell.strip() for cell in text.split(self.delimiter)]

    def kinds(self, rows: Sequence[Sequence[str]]) -> list[list[int]]:
        """The kind of each cell, without doubt: a comma parts thousands if it does so in a cell with a point."""
        grid = [[self.kind(cell) for cell in row] for row in rows]
        if not any(2 in row for row in grid):
            return grid
        sure = any(_THOUSANDS.fullmatch(cell) and "." in cell for row in rows for cell in row)
        return [[(1 if sure else -1) if kind == 2 else kind for kind in row] for row in grid]

    def header(self, text: str) -> list[str]:
        """The cells of a line of names; a unit in brackets belongs to the name before it."""
        return _SPACED.findall(text) if self.delimiter == " " else self.split(text)

    def kind(self, cell: str) -> int:
        """1 for a number, a date or a time; 0 for no reading; -1 for other text.

        2 for one such as 1,234, a number with a part of a thousand or of one, as its neighbours tell.
        """
        if (_COMMA_NUMBER if self.decimal_comma else _NUMBER).fullmatch(cell):
            return 1
        if not self.decimal_comma and _THOUSANDS.fullmatch(cell):
            return 1 if "." in cell else 2
        if cell.lower() in NO_READING:
            return 0
        return 1 if seconds_of_text(cell) is not None else -1


def is_json(begin: bytes) -> bool:
    """True if a text begins as JSON does: an object, or a list of objects."""
    text = begin.removeprefix(b"\xef\xbb\xbf").lstrip()
    return text.startswith(b"{") or (text.startswith(b"[") and text[1:].lstrip().startswith(b"{"))


def first_lines(path: Path) -> tuple[list[TextLine], bool]:
    """The lines at a file's beginning that hold something, and whether they end with CR alone.

    Raises:
        InputError: the file is not text, or has a line so long that it is no table.
    """
    with path.open("rb") as file:
        begin = file.read(HEAD_BYTES)
        continues = bool(file.read(1))
    for magic, what in _OTHER_FORMATS.items():
        if begin.startswith(magic):
            raise InputError(f"{path} {what}")
    begin = begin if continues else begin.rstrip(b"\x00")  # a disk that lost power leaves zeros at the end
    if b"\x00" in begin:
        raise InputError(f"{path} is not text (it holds zero bytes); give a CSV or a Parquet file")
    if continues:
        begin, newline, _ = begin.rpartition(b"\n")
        if not newline:
            raise InputError(
                f"the first line of {path} has over {HEAD_BYTES:,} bytes; a table has a line a row"
            )
    return lines_of(path, _decode(begin)), b"\r" in begin and b"\n" not in begin


def lines_of(path: Path, text: str) -> list[TextLine]:
    """The first lines of a text that hold something, be it behind the mark of a comment.

    Raises:
        InputError: a line is so long that it is no row of a table.
    """
    lines: list[TextLine] = []
    letters = 0
    for number, raw in enumerate(join_quoted(re.split(r"\r\n|\n|\r", text)[:_MAX_HEAD_LINES]), 1):
        letters += len(raw)
        if letters > _MAX_HEAD_LETTERS and len(lines) >= _MIN_HEAD_LINES:
            break
        if len(raw) > _MAX_HEAD_LETTERS:
            raise InputError(
                f"line {number} of {path} has over {_MAX_HEAD_LETTERS:,} letters; a table has a line a row"
            )
        stripped = raw.strip("\r\n\ufeff")
        mark = next((mark for mark in COMMENTS if stripped.lstrip().startswith(mark)), None)
        body = stripped.lstrip().lstrip(mark).strip() if mark and mark != ";" else stripped
        if body.strip():
            lines.append(TextLine(number, body, mark is not None and mark != ";"))
    return lines


_MAX_CELL_LINES = 100
"""Lines that one quoted cell may hold; a quote that never ends is a mark of inches."""


def join_quoted(lines: Iterable[str]) -> Iterator[str]:
    """Lines in which a line break between the quotes of a cell (RFC 4180) is a space.

    Empty lines follow a joined one, so that lines keep their numbers.
    """
    pending: list[str] = []
    for line in lines:
        if not pending and '"' not in line:
            yield line
            continue
        inside = _ends_quoted(line, bool(pending))
        pending.append(line)
        if not inside:
            yield " ".join(pending)
            yield from [""] * (len(pending) - 1)
            pending = []
        elif len(pending) > _MAX_CELL_LINES:
            yield from pending
            pending = []
    yield from pending


def _ends_quoted(line: str, inside: bool) -> bool:
    """True if a line ends between the quotes of a cell: a quote opens at a cell's beginning, and two are a letter."""
    pieces = line.split('"')
    quote = 0
    while quote < len(pieces) - 1:
        before = pieces[quote].rstrip(" ")
        if not inside:
            inside = not before or before[-1] in {",", ";", "\t", "|"}
        elif quote + 2 < len(pieces) and not pieces[quote + 1]:
            quote += 1
        else:
            inside = False
        quote += 1
    return inside


def _decode(begin: bytes) -> str:
    """Text in UTF-8, or else in the code of an old Windows, where a micro or a degree is one byte."""
    try:
        return begin.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        if len(begin) - error.start < 4 and error.reason == "unexpected end of data":
            return begin[: error.start].decode("utf-8-sig")
        return begin.decode("cp1252", errors="replace")


def seconds_of_text(text: str | None) -> float | None:
    """A date and time of ISO 8601 in seconds since 1970, a time of day since midnight; None if it is neither.

    Without a zone it counts as UTC. No text at all is no reading: NaN.
    """
    if not text:
        return math.nan
    if len(text) < len("12:00:00") or not text[:2].isdigit():
        return None
    try:
        moment = datetime.fromisoformat(text if text[2] != ":" else f"1970-01-01T{text}")
    except ValueError:
        return None
    return (moment if moment.tzinfo else moment.replace(tzinfo=UTC)).timestamp()


def seconds_of_cells(cells: polars.Series) -> Array:
    """A column of dates, times or durations in seconds, NaN where there is none."""
    import polars

    if cells.dtype == polars.Date:
        cells = cells.cast(polars.Datetime("ns"))
    if cells.dtype != polars.Time:  # which counts nanoseconds as it stands
        cells = cells.dt.cast_time_unit("ns")
    seconds: Array = cells.to_physical().cast(polars.Float64).to_numpy() / 1e9
    return seconds
