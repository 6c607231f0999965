"""Spreadsheets: each sheet is a table with the lines above its rows."""

from collections import Counter
from collections.abc import Sequence
from datetime import date, datetime, time, timedelta
from functools import lru_cache
from pathlib import Path
from typing import Any
from zipfile import ZipFile

import numpy as np

from palpate.arrays import AnyArray
from palpate.errors import InputError, how_to_install, unknown
from palpate.files.confined import read_confined
from palpate.files.reading import LimitError, ReadingBudget, ReadingLimits
from palpate.logs.tables.sheet import Cells, Sheet
from palpate.logs.tables.text import read_text_sheet

_CACHED_BOOKS = 2
"""Books whose cells are kept: several questions are asked about one."""


def read_book(path: Path, budget: ReadingBudget) -> Sheet:
    """The sheets of an .xlsx, .xlsm or .ods file; a column is `SHEET.NAME`, or `NAME` where only one sheet has it.

    Args:
        path: the file; or `BOOK.xlsx/SHEET`, one of its sheets.
        budget: of the log.

    Raises:
        InputError: it cannot be read, no sheet of it holds rows of numbers, or its library is not installed.
    """
    sheets, left_out = sheets_of(path.parent if path.parent.is_file() else path, budget)
    if path.parent.is_file():
        if path.name not in sheets:
            raise InputError(f"{path.parent}: {unknown('sheet with rows of numbers', path.name, sheets)}")
        return sheets[path.name]
    return _join_sheets(path, sheets, left_out)


def _join_sheets(path: Path, sheets: dict[str, Sheet], left_out: dict[str, str]) -> Sheet:
    """The columns of all sheets as one table; a name that only one sheet has is enough."""
    owners = [(title, index) for title, sheet in sheets.items() for index in range(len(sheet.names))]
    plain = [sheets[title].names[index] for title, index in owners]
    names = [
        name if len(sheets) == 1 else f"{owner[0]}.{name}" for name, owner in zip(plain, owners, strict=True)
    ]

    def read(places: Sequence[int], missing: Sequence[str]) -> tuple[list[Cells], list[dict[str, Any]]]:
        cells: dict[int, Cells] = {}
        notes: list[dict[str, Any]] = []
        for title in dict.fromkeys(owners[i][0] for i in places):
            columns = [i for i in places if owners[i][0] == title]
            sheet_cells, sheet_notes = sheets[title].read([owners[i][1] for i in columns], missing)
            cells |= dict(zip(columns, sheet_cells, strict=True))
            notes += sheet_notes
        return [cells[i] for i in places], notes

    rates = {sheet.rate for sheet in sheets.values()}
    return Sheet(
        path,
        names,
        read,
        lambda index: sheets[owners[index][0]].counts(owners[index][1]),
        {name: sheets[o].stated[plain_name] for name, plain_name, (o, _) in zip(names, plain, owners, strict=True)
         if plain_name in sheets[o].stated},
        rates.pop() if len(rates) == 1 else None,
        left_out,
        shorter={name: i for i, name in enumerate(plain) if plain.count(name) == 1},
        tables=tuple(title for title, _ in owners),
    )  # fmt: skip


def sheets_of(path: Path, budget: ReadingBudget) -> tuple[dict[str, Sheet], dict[str, str]]:
    """The sheets of a book that hold rows of numbers, by title; and the others, with the reason.

    Raises:
        InputError: it cannot be read, or no sheet of it holds rows of numbers.
    """
    state = path.stat()
    contents = _contents(path, (state.st_dev, state.st_ino, state.st_size, state.st_mtime_ns), budget.limits)
    sheets: dict[str, Sheet] = {}
    left_out: dict[str, str] = {}
    for title, content in contents.items():
        try:
            sheets[title] = read_text_sheet(path, budget, "\t", content)
        except LimitError:
            raise
        except InputError:
            left_out[title] = "a sheet without rows of numbers"
    if not sheets:
        raise InputError(f"no sheet of {path} holds rows of numbers; give a log with a row for each sample")
    return sheets, left_out


def equal_sheets(path: Path, limits: ReadingLimits, names: Sequence[str] = ()) -> list[Path]:
    """The sheets with the columns that most sheets of a book have, as `BOOK.xlsx/SHEET`: repeats of one test.

    Args:
        path: of the book.
        limits: of it.
        names: columns that they have; none of the book's where one is missing.

    Returns:
        Paths that are read as logs; none if fewer than two sheets are equal.
    """
    sheets, _ = sheets_of(path, ReadingBudget(path, limits))
    usual, count = Counter(tuple(sheet.names) for sheet in sheets.values()).most_common(1)[0]
    if count < 2 or not set(names) <= set(usual):
        return []
    return [path / title for title, sheet in sheets.items() if tuple(sheet.names) == usual]


@lru_cache(maxsize=_CACHED_BOOKS)
def _contents(path: Path, state: tuple[int, ...], limits: ReadingLimits) -> dict[str, str]:
    """The sheets' text by title; `state` tells a changed file from the one that is kept."""
    arrays, _ = read_confined(__name__, path, "a spreadsheet", ReadingBudget(path, limits))
    return {title: content.tobytes().decode() for title, content in arrays.items()}


def unpack(path: Path, size: int, question: None = None) -> tuple[dict[str, AnyArray], None]:
    """Each sheet as lines of text, its cells parted by tabs. Runs in a process of its own."""
    try:
        from python_calamine import CalamineWorkbook
    except ImportError:
        raise InputError(
            f"spreadsheets need the library python-calamine: {how_to_install('palpate[spreadsheets]')}"
        ) from None
    with ZipFile(path) as packed:
        if sum(part.file_size for part in packed.infolist()) > size:
            raise MemoryError
    book = CalamineWorkbook.from_path(str(path))
    sheets = {
        name: "\n".join("\t".join(map(_word, row)) for row in book.get_sheet_by_name(name).iter_rows())
        for name in book.sheet_names
    }
    return {name: np.frombuffer(text.encode(), np.uint8) for name, text in sheets.items()}, None


def _word(cell: object) -> str:
    """One cell as a text log would have it."""
    match cell:
        case datetime() | date() | time():
            return cell.isoformat()
        case timedelta():
            return repr(cell.total_seconds())
        case bool():
            return str(int(cell))
        case float():
            return str(int(cell)) if cell.is_integer() and abs(cell) < 1e15 else repr(cell)
        case _:
            return " ".join(str(cell).split())
