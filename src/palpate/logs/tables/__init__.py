"""Logs of columns: text, Parquet, MATLAB, spreadsheets."""

from pathlib import Path

from palpate.files.limits import ReadingBudget, ReadingLimits
from palpate.logs.kinds import Kind
from palpate.logs.tables.matlab import read_matlab
from palpate.logs.tables.parquet import read_parquet
from palpate.logs.tables.sheet import Sheet, Stated
from palpate.logs.tables.spreadsheet import equal_sheets, read_book
from palpate.logs.tables.text import read_text_sheet

__all__ = ["Sheet", "Stated", "equal_sheets", "open_table"]


def open_table(
    path: Path, kind: Kind, delimiter: str | None = None, limits: ReadingLimits | None = None
) -> Sheet:
    """A file of columns, read where they are asked for.

    Raises:
        InputError: it cannot be read, or is larger than the limits.
    """
    budget = ReadingBudget(path, limits or ReadingLimits())
    match kind:
        case Kind.MAT:
            return read_matlab(path, budget)
        case Kind.SHEETS:
            return read_book(path, budget)
        case Kind.PARQUET:
            return read_parquet(path, budget)
        case _:
            return read_text_sheet(path, budget, delimiter)
