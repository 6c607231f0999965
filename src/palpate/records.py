"""A record: named columns of equal length, in SI units, with metadata."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.arrays import Array
from palpate.errors import InputError, unknown
from palpate.results import Result

if TYPE_CHECKING:
    from polars import DataFrame


@dataclass(frozen=True, eq=False, repr=False)
class Record(Result, shown_by="palpate.report.record"):
    """A table of signals, as a log or a run leaves it.

    Args:
        columns: signals by name, each of shape (n,), float64.
        units: the SI unit of each column; "1" for a plain number.
        meta: other metadata: source, seed, command, events. Plain JSON values only.

    Raises:
        InputError: columns of different lengths, or a column without a unit.
    """

    columns: Mapping[str, Array]
    units: Mapping[str, str]
    meta: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        lengths = {name: len(column) for name, column in self.columns.items()}
        if len(set(lengths.values())) > 1:
            raise InputError(f"columns of a record must have one length, got {lengths}")
        missing = sorted(set(self.columns) - set(self.units))
        if missing:
            raise InputError(f"columns without a unit: {', '.join(missing)}")

    def to_polars(self) -> DataFrame:
        """The columns as a polars `DataFrame`; units and metadata stay here."""
        import polars

        return polars.DataFrame({name: np.asarray(column, float) for name, column in self.columns.items()})

    def to_pandas(self) -> Any:
        """The columns as a pandas `DataFrame`; its `attrs` have the units.

        Raises:
            InputError: pandas is not installed.
        """
        try:
            import pandas as pd
        except ImportError:
            raise InputError("to_pandas needs pandas; install it, or use to_polars()") from None
        frame = pd.DataFrame({name: np.asarray(column, float) for name, column in self.columns.items()})
        frame.attrs["units"] = dict(self.units)
        return frame

    def __arrow_c_stream__(self, requested_schema: object | None = None) -> object:
        """The columns as a stream of Arrow's C interface, which data frames of all kinds read."""
        return self.to_polars().__arrow_c_stream__(requested_schema)

    def __len__(self) -> int:
        return len(next(iter(self.columns.values()), ()))

    def __getitem__(self, name: str) -> Array:
        if name not in self.columns:
            raise unknown("column", name, self.columns)
        return self.columns[name]
