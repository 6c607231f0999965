"""Logs of columns: text, Parquet, MATLAB, spreadsheets."""

from __future__ import annotations

from pathlib import Path

from palpate.logs.kinds import Kind
from palpate.logs.limits import Budget, Limits
from palpate.logs.tables.columns import Columns, Stated
from palpate.logs.tables.matlab import Matlab
from palpate.logs.tables.parquet import Parquet
from palpate.logs.tables.spreadsheet import Spreadsheet
from palpate.logs.tables.text import Text

__all__ = ["Columns", "Stated", "open_table"]


def open_table(path: Path, kind: Kind, delimiter: str | None = None, limits: Limits | None = None) -> Columns:
    """A file of columns, read where they are asked for.

    Raises:
        InputError: it cannot be read, or is larger than the limits.
    """
    budget = Budget(path, limits or Limits())
    match kind:
        case Kind.MAT:
            return Matlab(path, budget)
        case Kind.SHEETS:
            return Spreadsheet(path, budget)
        case Kind.PARQUET:
            return Parquet(path, budget)
        case _:
            return Text(path, budget, delimiter)
