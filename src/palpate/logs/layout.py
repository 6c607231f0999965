"""What a text log looks like: its delimiter, its header, the names of its columns."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

from palpate.errors import InputError

_DELIMITERS = (",", ";", "\t", "|", " ")
_NAMES = {",": "comma", ";": "semicolon", "\t": "tab", "|": "bar", " ": "space"}
_LOOK = 50
_NO_TEXT = {
    b"\x1f\x8b": "is compressed by gzip; unpack it first",
    b"PK\x03\x04": "is a zip archive or a spreadsheet; unpack it, or save the sheet as CSV",
    b"\x89HDF": "is HDF5; write its columns out as CSV or Parquet",
    b"\xff\xfe": "is UTF-16 text; save it as UTF-8",
    b"\xfe\xff": "is UTF-16 text; save it as UTF-8",
}
"""What other files begin with."""


@dataclass(frozen=True)
class Layout:
    """How to read a text log.

    Args:
        delimiter: one character.
        names: the columns' names; numbers from 0 where the file has no header.
        header: whether the first row holds the names.
        skip: lines before the header or the first row: comments and empty lines.
        decimal_comma: whether numbers are written 1,5.
    """

    delimiter: str
    names: tuple[str, ...]
    header: bool
    skip: int
    decimal_comma: bool

    @property
    def delimiter_name(self) -> str:
        """What to call the delimiter in a sentence."""
        return _NAMES.get(self.delimiter, repr(self.delimiter))

    @property
    def first_row(self) -> int:
        """The line of the file, counted from 1, that holds the first row of numbers."""
        return self.skip + int(self.header) + 1


def find_layout(path: Path, delimiter: str | None = None) -> Layout:
    """Look at the first lines of a text log.

    Raises:
        InputError: the file is empty, is not text, or holds a header and nothing else.
    """
    if delimiter is not None and len(delimiter) != 1:
        raise InputError(f"the delimiter must be one character, got {delimiter!r}")
    skip, lines = _first_lines(path)
    if not lines:
        raise InputError(f"{path} is empty; give a log with a row of numbers for each sample")
    delimiter = delimiter or _guess(lines)
    decimal_comma = delimiter != "," and _decimal_commas(lines, delimiter)
    rows = [_split(line, delimiter) for line in lines]
    header = not all(_is_number(cell, decimal_comma) for cell in rows[0])
    if header and len(rows) == 1:
        raise InputError(f"{path} holds a header and no rows; give a log with a row for each sample")
    names = tuple(rows[0]) if header else tuple(str(i) for i in range(len(rows[0])))
    return Layout(delimiter, names, header, skip, decimal_comma)


def _first_lines(path: Path) -> tuple[int, list[str]]:
    with path.open("rb") as file:
        begin = file.read(65536)
        for magic, what in _NO_TEXT.items():
            if begin.startswith(magic):
                raise InputError(f"{path} {what}")
        if b"\x00" in begin:
            raise InputError(f"{path} is not text (it holds zero bytes); give a CSV or a Parquet file")
    try:
        with path.open(encoding="utf-8-sig") as file:
            skip, first = 0, ""
            for first in file:
                if first.strip() and not first.startswith("#"):
                    break
                skip += 1
            else:
                return skip, []
            rest = (line.rstrip("\r\n") for line in file)
            return skip, [first.rstrip("\r\n"), *(line for line in islice(rest, _LOOK) if line.strip())]
    except UnicodeDecodeError as error:
        raise InputError(
            f"{path} is not UTF-8 text ({error.reason} at byte {error.start}); convert it"
        ) from None


def _guess(lines: list[str]) -> str:
    """The delimiter that cuts every line into the same number of cells, at least two; most cells win."""
    best, most = ",", 1
    for delimiter in _DELIMITERS:
        counts = [len(_split(line, delimiter)) for line in lines]
        if min(counts) == max(counts) > most and not (delimiter == "," and _decimal_semicolons(lines)):
            best, most = delimiter, counts[0]
    return best


def _decimal_semicolons(lines: list[str]) -> bool:
    """Whether semicolons part the cells evenly, so that commas can only be decimal."""
    counts = {line.count(";") for line in lines}
    return len(counts) == 1 and min(counts) > 0


def _split(line: str, delimiter: str) -> list[str]:
    if delimiter == " ":
        return line.split()
    return [cell.strip() for cell in next(csv.reader([line], delimiter=delimiter), [])]


def _decimal_commas(lines: list[str], delimiter: str) -> bool:
    cells = [cell for line in lines[1:] or lines for cell in _split(line, delimiter) if "," in cell]
    return bool(cells) and all(_is_number(cell, True) for cell in cells)


def _is_number(cell: str, decimal_comma: bool) -> bool:
    try:
        float(cell.replace(",", ".") if decimal_comma else cell)
    except ValueError:
        return cell == ""
    return True
