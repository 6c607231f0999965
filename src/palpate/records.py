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
from palpate.text import in_python

if TYPE_CHECKING:
    from polars import DataFrame


def same(one: object, other: object) -> bool:
    """Whether two values are equal, arrays by their elements, and no number equal to no number."""
    if isinstance(one, np.ndarray) or isinstance(other, np.ndarray):
        return _same_arrays(one, other)
    if type(one) is not type(other):
        return bool(one == other)
    if is_dataclass(one):
        return all(
            same(getattr(one, own.name), getattr(other, own.name)) for own in fields(one) if own.compare
        )
    if isinstance(one, Mapping) and isinstance(other, Mapping):
        return one.keys() == other.keys() and all(same(one[key], other[key]) for key in one)
    if isinstance(one, Sequence) and isinstance(other, Sequence) and not isinstance(one, str | bytes):
        return len(one) == len(other) and all(map(same, one, other))
    if isinstance(one, float) and one != one:  # noqa: PLR0124 - not a number
        return bool(other != other)  # noqa: PLR0124
    return bool(one == other)


def _same_arrays(one: object, other: object) -> bool:
    if not (isinstance(one, np.ndarray) and isinstance(other, np.ndarray)):
        return False
    return np.array_equal(one, other, equal_nan=one.dtype.kind in "fc" and other.dtype.kind in "fc")


class Readable:
    """A value with a `repr` of one line and a view for notebooks; the report has the facts of each (`lazy.report`)."""

    def __init_subclass__(cls, **others: Any) -> None:
        super().__init_subclass__(**others)
        for name in ("__repr__", "_repr_html_"):  # a dataclass writes a repr where its own class has none
            setattr(cls, name, getattr(cls, name))

    def __repr__(self) -> str:
        return str(lazy.report().line(self))

    def _repr_html_(self) -> str:
        """HTML for a notebook; nothing in it runs, whatever the names in a log are."""
        return str(lazy.report().html(self))


class Compared(Readable):
    """A frozen dataclass whose fields may hold arrays: `==` compares these by their elements."""

    def __eq__(self, other: object) -> bool:
        return same(self, other) if type(self) is type(other) else NotImplemented

    __hash__ = None  # type: ignore[assignment]


class Result(Compared):
    """A result that can be read, drawn and written.

    The report has a view of each class: a module with `line`, `text`, `html`, `draw` and `page`, each of one result.
    """

    def _view(self) -> Any:
        return lazy.report().view_of(self)

    def __str__(self) -> str:
        return in_python(str(self._view().text(self)))

    def __repr__(self) -> str:
        return in_python(f"<{type(self).__name__}: {self._view().line(self)}>")

    def _repr_html_(self) -> str:
        """HTML for a notebook; nothing in it runs, whatever the names in a log are."""
        return in_python(str(self._view().html(self)))

    def plot(self, path: str | Path | None = None) -> Any:
        """Draw it.

        Args:
            path: where to write the figure too, a PNG, SVG or PDF by its ending.

        Returns:
            A `matplotlib.figure.Figure`, which a notebook shows.

        Raises:
            InputError: it holds nothing that can be drawn; palpate may not write there.
        """
        if path is None:
            return self._view().draw(self)
        return lazy.report().write_figure(self, self._view().draw, Path(path))

    def report(self, path: str | Path) -> Path:
        """Write a page with everything, an HTML file that opens without a network.

        Raises:
            InputError: palpate may not write there, or the name has another ending.
        """
        return Path(lazy.report().write_page(self, self._view().page, Path(path)))


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
