"""A record of named columns, and what every result is: printed, compared, drawn, written as a page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, is_dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate import lazy
from palpate.arrays import Array
from palpate.errors import InputError, unknown

if TYPE_CHECKING:
    from polars import DataFrame


def same(first: object, second: object) -> bool:
    """True if two values are equal, arrays by their elements, and NaN equal to NaN."""
    if isinstance(first, np.ndarray) or isinstance(second, np.ndarray):
        return _same_arrays(first, second)
    if type(first) is not type(second):
        return bool(first == second)
    if is_dataclass(first):
        return all(
            same(getattr(first, item.name), getattr(second, item.name))
            for item in fields(first)
            if item.compare
        )
    if isinstance(first, Mapping) and isinstance(second, Mapping):
        return first.keys() == second.keys() and all(same(first[key], second[key]) for key in first)
    if isinstance(first, Sequence) and isinstance(second, Sequence) and not isinstance(first, str | bytes):
        return len(first) == len(second) and all(map(same, first, second))
    if isinstance(first, float) and first != first:  # noqa: PLR0124 - not a number
        return bool(second != second)  # noqa: PLR0124
    return bool(first == second)


def _same_arrays(first: object, second: object) -> bool:
    if not (isinstance(first, np.ndarray) and isinstance(second, np.ndarray)):
        return False
    return np.array_equal(first, second, equal_nan=first.dtype.kind in "fc" and second.dtype.kind in "fc")


class Readable:
    """A value with a `repr` of one line, which the report writes (`lazy.report`)."""

    def __init_subclass__(cls, **others: Any) -> None:
        super().__init_subclass__(**others)
        cls.__repr__ = cls.__repr__  # type: ignore[method-assign]  # a dataclass writes one where its class has none

    def __repr__(self) -> str:
        return str(lazy.report().line(self))


class Compared(Readable):
    """A frozen dataclass whose fields may hold arrays: `==` compares these by their elements."""

    def __eq__(self, other: object) -> bool:
        return same(self, other) if type(self) is type(other) else NotImplemented

    __hash__ = None  # type: ignore[assignment]


class Result(Compared):
    """A result that can be printed, drawn and written as a page."""

    def __str__(self) -> str:
        return str(lazy.report().text(self))

    def __dir__(self) -> list[str]:
        """Attributes, the identified parameters (`K`, `B`, ...) among them, for completion."""
        return [*super().__dir__(), *getattr(self, "parameters", ())]

    def _repr_html_(self) -> str:
        """HTML for a notebook, with the picture; nothing in it runs, whatever the names in a log are."""
        return str(lazy.report().html(self))

    def plot(self, path: str | Path | None = None) -> Any:
        """Draw it.

        Args:
            path: where to write the figure too, a PNG, SVG or PDF by its ending.

        Returns:
            A `matplotlib.figure.Figure`, which a notebook shows.

        Raises:
            InputError: it holds nothing that can be drawn; palpate may not write there.
        """
        return lazy.report().plot(self, None if path is None else Path(path))

    def report(self, path: str | Path) -> Path:
        """Write a page with everything, an HTML file that opens without a network.

        Raises:
            InputError: palpate may not write there, or the name has another ending.
        """
        return Path(lazy.report().write_page(self, Path(path)))


@dataclass(frozen=True, eq=False, repr=False)
class Record(Result):
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
