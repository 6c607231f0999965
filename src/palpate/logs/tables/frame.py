"""A table in memory: a DataFrame of polars or pandas, an Arrow table or stream, a mapping of arrays."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.errors import InputError
from palpate.logs.tables.sheet import Cells, Sheet, as_counts

_NANOSECONDS = 1e9


def read_frame(table: Any) -> Sheet:
    """The columns of a table in memory, as those of a file.

    Args:
        table: with names of columns, each of which is one array when it is asked for by its name.

    Raises:
        InputError: it is no such table.
    """
    columns = list(_columns(table).items())
    return Sheet(
        Path(f"the {type(table).__name__}"),
        [str(name) for name, _ in columns],
        lambda places, _: ([_cells(columns[i][1]) for i in places], []),
        lambda place: as_counts(columns[place][1]),
        clocks={str(name) for name, cells in columns if cells.dtype.kind == "M"},
    )


def _cells(cells: NDArray[Any]) -> Cells:
    if cells.dtype.kind == "M":
        return Cells(cells.astype("datetime64[ns]").astype(np.int64) / _NANOSECONDS, clock=True)
    try:
        numbers = np.array(cells, dtype=float)
    except (TypeError, ValueError):
        return Cells(np.full(len(cells), np.nan), ("row 1", str(cells[0])))
    numbers[~np.isfinite(numbers)] = np.nan
    return Cells(numbers)


def own_columns(frame: Sheet, rate: float | None) -> dict[str, str]:
    """The columns of a table that names them as a record does: time, position and force.

    Raises:
        InputError: it does not.
    """
    wanted = ("time", "position", "force") if rate is None else ("position", "force")
    if not set(wanted) <= set(frame.names):
        raise InputError(
            f"{frame.path} has the columns {', '.join(frame.names[:12])}; say which are which, as in "
            'read_log(table, time="t", position="depth_mm:mm", force="load:N")'
        )
    return {name: name for name in wanted}


def _columns(table: Any) -> dict[Any, NDArray[Any]]:
    names = getattr(table, "column_names", None) or (
        list(table) if isinstance(table, Mapping) else getattr(table, "columns", None)
    )
    if names is None and hasattr(table, "__arrow_c_stream__"):
        import polars

        table = polars.DataFrame(table)
        names = table.columns
    if names is None:
        raise InputError(
            f"a log is a path, a DataFrame, an Arrow table or a mapping of arrays, not a {type(table).__name__}"
        )
    columns = {name: np.asarray(table[name]) for name in names}
    if len({column.shape for column in columns.values()}) != 1 or any(
        column.ndim != 1 for column in columns.values()
    ):
        shapes = {str(name): column.shape for name, column in columns.items()}
        raise InputError(f"the columns of a table have one length, got {shapes}")
    return columns
