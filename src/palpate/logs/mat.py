"""MATLAB files, v5 to v7: variables as columns of numbers."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.errors import InputError
from palpate.logs.columns import place_of

_WIDEST = 64


class MatFile:
    """The numeric variables of a MATLAB file as columns; fields of a struct are `struct.field`.

    A matrix gives a column for each of its shorter side: `wrench.0` to `wrench.5` for one of 5000 x 6 or 6 x 5000.
    Scalars are none.

    Args:
        path: the file.

    Raises:
        InputError: the file is no MATLAB file of v4 to v7, is damaged, or holds no numbers in columns.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.units: dict[str, str] = {}
        self.clocks: set[str] = set()
        self._arrays = dict(_columns(_load(path)))
        self.names = list(self._arrays)
        if not self.names:
            raise InputError(
                f"{path} holds no array of numbers; MATLAB's tables and timeseries are objects that only MATLAB reads:"
                " save their columns as plain arrays"
            )

    def resolve(self, name: str) -> int:
        """The place of a variable given by its name, or else by its number from 0."""
        return place_of(name, self.names, self.path)

    def numbers(self, places: Sequence[int], missing: Sequence[str] = ()) -> list[NDArray[np.float64]]:
        """The columns at these places; NaN, and a value of `missing`, is no reading.

        Raises:
            InputError: they have different lengths, or hold what is no real number.
        """
        columns = [self._real(self.names[place], missing) for place in places]
        lengths = {self.names[place]: len(column) for place, column in zip(places, columns, strict=True)}
        if len(set(lengths.values())) > 1:
            listed = ", ".join(f"{name} {length}" for name, length in lengths.items())
            raise InputError(f"{self.path}: variables of a log must have one length, got {listed}")
        return columns

    def _real(self, name: str, missing: Sequence[str]) -> NDArray[np.float64]:
        values = self._arrays[name]
        if np.iscomplexobj(values):
            raise InputError(f"{self.path}: {name!r} is complex; give real numbers")
        column = values.astype(float)
        if np.isinf(column).any():
            row = int(np.flatnonzero(np.isinf(column))[0]) + 1
            raise InputError(
                f"{self.path}: {name!r}, row {row} is infinite; mend it, or make it NaN if missing"
            )
        column[np.isin(column, _finite(missing))] = np.nan
        return column


def _load(path: Path) -> Mapping[str, Any]:
    from scipy.io import loadmat

    try:
        return dict(loadmat(path, simplify_cells=True))
    except NotImplementedError:
        raise InputError(
            f"{path} is a MATLAB file of version 7.3 (HDF5); save it in MATLAB with: save -v7"
        ) from None
    except Exception as error:  # noqa: BLE001 - a damaged file fails in as many ways as there are bytes
        what = (str(error).splitlines() or [""])[0] or type(error).__name__
        raise InputError(
            f"{path} cannot be read as a MATLAB file ({what}); is it whole, and saved with save -v7?"
        ) from None


def _columns(variables: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, NDArray[Any]]]:
    for own, value in variables.items():
        name = f"{prefix}{own}"
        if own.startswith("__"):
            continue
        if isinstance(value, Mapping):
            yield from _columns(value, f"{name}.")
        elif isinstance(value, np.ndarray) and value.dtype.kind in "biufc":
            yield from _columns_of_array(name, value)


def _columns_of_array(name: str, value: NDArray[Any]) -> Iterator[tuple[str, NDArray[Any]]]:
    if value.ndim == 1 and len(value) > 1:
        yield name, value
    elif value.ndim == 2 and 1 < min(value.shape) <= _WIDEST:
        rows = value if value.shape[0] >= value.shape[1] else value.T
        yield from ((f"{name}.{i}", rows[:, i]) for i in range(rows.shape[1]))


def _finite(words: Sequence[str]) -> list[float]:
    values = []
    for word in words:
        try:
            values.append(float(word))
        except ValueError:
            continue
    return values
