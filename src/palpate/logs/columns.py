"""A log of columns, whatever file it is in: what the readers of CSV, Parquet and MATLAB files have in common."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from palpate.errors import InputError, unknown


class Columns(Protocol):
    """Columns of numbers by name, all of one length.

    Attributes:
        path: the file.
        names: of the columns, in the file's order.
        units: the SI units that the file itself states, by name.
        clocks: the columns that hold dates and times.
    """

    path: Path
    names: list[str]
    units: dict[str, str]
    clocks: set[str]

    def resolve(self, name: str) -> int:
        """The place of a column given by its name, or else by its number from 0."""
        ...

    def numbers(self, places: Sequence[int], missing: Sequence[str] = ()) -> list[NDArray[np.float64]]:
        """The columns at these places; NaN where there is no reading."""
        ...


def place_of(name: str, names: Sequence[str], path: Path) -> int:
    """The place of a column given by its name, or else by its number from 0.

    Raises:
        InputError: there is no such column (those there are, are listed), or there are two.
    """
    places = [i for i, own in enumerate(names) if own == name]
    if len(places) > 1:
        numbers = ", ".join(map(str, places))
        raise InputError(f"{path} has {len(places)} columns named {name!r}; name one by number: {numbers}")
    if places:
        return places[0]
    if not name.isdigit():
        raise InputError(f"{path}: {unknown('column', name, names)}")
    if int(name) >= len(names):
        raise InputError(f"{path} has no column {name}; its columns are 0 to {len(names) - 1}")
    return int(name)
