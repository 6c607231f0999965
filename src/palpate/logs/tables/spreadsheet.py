"""Spreadsheets: each sheet is a table with the lines above its rows."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import date, datetime, time, timedelta
from pathlib import Path
from typing import Any
from zipfile import ZipFile

import numpy as np
from numpy.typing import NDArray

from palpate.arrays import Array
from palpate.errors import InputError
from palpate.logs.limits import Budget
from palpate.logs.tables.columns import Stated, place_of
from palpate.logs.tables.confined import read_confined
from palpate.logs.tables.text import Text


class Spreadsheet:
    """The sheets of an .xlsx, .xlsm or .ods file; a column is `SHEET.NAME`, or `NAME` where only one sheet has it.

    Args:
        path: the file.
        budget: of the log.

    Raises:
        InputError: it cannot be read, no sheet of it holds rows of numbers, or its library is not installed.
    """

    def __init__(self, path: Path, budget: Budget) -> None:
        self.path = path
        contents, _ = read_confined("spreadsheet", path, "a spreadsheet", budget)
        sheets: dict[str, Text] = {}
        self.left_out: dict[str, str] = {}
        for name, content in contents.items():
            try:
                sheets[name] = Text(path, budget, "\t", content.tobytes().decode())
            except InputError:
                self.left_out[name] = "a sheet without rows of numbers"
        if not sheets:
            raise InputError(
                f"no sheet of {path} holds rows of numbers; give a log with a row for each sample"
            )
        self._places = [
            (sheet, place, name if len(sheets) == 1 else f"{title}.{name}")
            for title, sheet in sheets.items()
            for place, name in enumerate(sheet.names)
        ]
        self._titles = {id(sheet): title for title, sheet in sheets.items()}
        self.names = [name for _, _, name in self._places]
        self.stated: dict[str, Stated] = {
            name: sheet.stated[sheet.names[place]]
            for sheet, place, name in self._places
            if sheet.names[place] in sheet.stated
        }
        rates = {sheet.rate for sheet in sheets.values()}
        self.rate = rates.pop() if len(rates) == 1 else None
        self.clocks: set[str] = set()
        self.notes: list[dict[str, Any]] = []

    def resolve(self, name: str) -> int:
        """The place of a column given by its name, with its sheet's if several sheets have it; or by its number."""
        plain = [i for i, (sheet, place, _) in enumerate(self._places) if sheet.names[place] == name]
        if name not in self.names and len(plain) == 1:
            return plain[0]
        return place_of(name, self.names, self.path)

    def numbers(self, places: Sequence[int], missing: Sequence[str] = ()) -> list[Array]:
        """The columns at these places, all of one sheet.

        Raises:
            InputError: they are of several sheets, or a cell is not a finite number.
        """
        titles = {self._titles[id(self._places[i][0])] for i in places}
        if len(titles) > 1:
            raise InputError(
                f"{self.path}: the columns of a log must be on one sheet, got {', '.join(sorted(titles))}"
            )
        sheet = self._places[places[0]][0]
        columns = sheet.numbers([self._places[i][1] for i in places], missing)
        self.notes = sheet.notes
        self._share_clocks(sheet)
        return columns

    def _share_clocks(self, sheet: Text) -> None:
        self.clocks |= {
            name for own, place, name in self._places if own is sheet and own.names[place] in own.clocks
        }

    def glance(self, places: Sequence[int]) -> list[Array]:
        """The same, of any sheets; NaN too where something else than a number or a date stands."""
        columns: dict[int, Array] = {}
        for sheet in dict.fromkeys(self._places[i][0] for i in places):
            own = [i for i in places if self._places[i][0] is sheet]
            columns |= dict(zip(own, sheet.glance([self._places[i][1] for i in own]), strict=True))
            self._share_clocks(sheet)
        return [columns[i] for i in places]

    def counts(self, place: int) -> NDArray[np.int64] | None:
        """A column of whole numbers, exact; None if it holds others."""
        sheet, own, _ = self._places[place]
        return sheet.counts(own)


def unpack(path: Path, size: int, question: None = None) -> tuple[dict[str, NDArray[Any]], None]:
    """Each sheet as lines of text, its cells parted by tabs. Runs in a process of its own."""
    try:
        from python_calamine import CalamineWorkbook
    except ImportError:
        raise InputError(
            "spreadsheets need the library python-calamine; install it with: pip install 'palpate[spreadsheets]'"
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
