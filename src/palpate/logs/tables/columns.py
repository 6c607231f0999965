"""A log of columns in any file: common parts of the readers of tables."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from palpate.arrays import Array
from palpate.errors import InputError, unknown


@dataclass(frozen=True)
class Stated:
    """Statements of the file about one of its columns.

    Args:
        unit: its symbol; None if the file gives none that palpate knows.
        where: the words for it: "the row of units"; empty where it goes without saying.
        scale, offset: a value in that unit is (number + offset) x scale.
    """

    unit: str | None
    where: str = ""
    scale: float = 1.0
    offset: float = 0.0


class Columns(Protocol):
    """Columns of numbers by name, all of one length.

    Attributes:
        path: the file.
        names: of the columns, in the file's order.
        stated: statements of the file about them, by name.
        rate: rows per second, where the file states it [1/s].
        clocks: the columns that hold dates and times.
        notes: findings and corrections while reading, as in a record's meta.
        left_out: variables that are no columns, by name, with their kinds.
    """

    path: Path
    names: list[str]
    stated: dict[str, Stated]
    rate: float | None
    clocks: set[str]
    notes: list[dict[str, Any]]
    left_out: dict[str, str]

    def resolve(self, name: str) -> int:
        """The place of a column given by its name, or else by its number from 0."""
        ...

    def numbers(self, places: Sequence[int], missing: Sequence[str] = ()) -> list[Array]:
        """The columns at these places as the file has them; NaN where there is no reading."""
        ...

    def glance(self, places: Sequence[int]) -> list[Array]:
        """The same, whatever their length; NaN too where something else than a number stands."""
        ...

    def counts(self, place: int) -> NDArray[np.int64] | None:
        """A column of whole numbers, as exact as the file has them; None if it holds others."""
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
    if not (name.isascii() and name.isdigit()):
        raise InputError(f"{path}: {unknown('column', name, names)}")
    if int(name) >= len(names):
        raise InputError(f"{path} has no column {name}; its columns are 0 to {len(names) - 1}")
    return int(name)


def finite_words(words: Sequence[str]) -> list[float]:
    """Those of some words that are finite numbers."""
    return [float(word) for word in words if is_finite(word)]


def is_finite(word: str) -> bool:
    """Whether a word is a finite number."""
    try:
        return bool(np.isfinite(float(word)))
    except ValueError:
        return False


def as_counts(column: NDArray[Any]) -> NDArray[np.int64] | None:
    """An array of integers as signed ones; None if it holds others, or too large ones."""
    if column.dtype.kind not in "iu" or (
        column.dtype.kind == "u" and (column > np.iinfo(np.int64).max).any()
    ):
        return None
    return column.astype(np.int64)
