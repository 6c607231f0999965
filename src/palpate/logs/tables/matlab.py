"""MATLAB files, v4 to v7: variables as columns of numbers."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from io import SEEK_CUR
from itertools import product
from pathlib import Path
from struct import unpack_from
from typing import Any
from zlib import decompressobj

import numpy as np
from numpy.typing import NDArray

from palpate.arrays import Array
from palpate.errors import InputError
from palpate.logs.limits import Budget
from palpate.logs.tables.columns import Stated, as_counts, finite_words, place_of
from palpate.logs.tables.confined import read_confined

_HEADER, _COMPRESSED, _PIECE = 128, 15, 1 << 20
_MOST = 64
"""Columns of one variable; what has more is an image, say."""
_EXPORTS = {
    "table": "s = table2struct({0}, 'ToScalar', true); save('log.mat', '-struct', 's', '-v7')",
    "timetable": "s = table2struct(timetable2table({0}), 'ToScalar', true); save('log.mat', '-struct', 's', '-v7')",
    "timeseries": "time = {0}.Time; data = {0}.Data; save('log.mat', 'time', 'data', '-v7')",
    "datetime": "{0} = posixtime({0}); save('log.mat', '{0}', '-v7')",
    "duration": "{0} = seconds({0}); save('log.mat', '{0}', '-v7')",
}
"""How MATLAB itself turns an object of a class into plain arrays."""


class Matlab:
    """The numeric variables of a MATLAB file as columns; fields of a struct are `struct.field`.

    An array gives a column for each place beside its longest side: `wrench.0` to `wrench.5` for one of 5000 x 6 or
    6 x 5000, `T.0.3` for one of 4 x 4 x 5000. Scalars are none.

    Args:
        path: the file.
        budget: of the log.

    Raises:
        InputError: the file is no MATLAB file of v4 to v7, is damaged, or holds no numbers in columns.
    """

    def __init__(self, path: Path, budget: Budget) -> None:
        self.path = path
        self.stated: dict[str, Stated] = {}
        self.rate: float | None = None
        self.clocks: set[str] = set()
        self.notes: list[dict[str, Any]] = []
        self._arrays, also = read_confined("matlab", path, "a MATLAB file", budget)
        objects = {name: f"a MATLAB {kind}, which {_export(name, kind)}" for name, kind in also["objects"]}
        self.left_out = also["images"] | objects
        self.names = list(self._arrays)
        if not self.names:
            told = next((f": {name} is {what}" for name, what in self.left_out.items()), "")
            raise InputError(f"{path} holds no array of numbers with a value for each sample{told}")

    def resolve(self, name: str) -> int:
        """The place of a variable given by its name, or else by its number from 0."""
        owner = name.partition(".")[0]
        if name not in self.names and owner in self.left_out:
            raise InputError(f"{self.path}: {owner!r} is {self.left_out[owner]}")
        return place_of(name, self.names, self.path)

    def numbers(self, places: Sequence[int], missing: Sequence[str] = ()) -> list[Array]:
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

    def glance(self, places: Sequence[int]) -> list[Array]:
        """The same, whatever their length; NaN where a number is complex."""
        found = [self._arrays[self.names[place]] for place in places]
        return [np.full(len(a), np.nan) if np.iscomplexobj(a) else a.astype(float) for a in found]

    def counts(self, place: int) -> NDArray[np.int64] | None:
        """A column of whole numbers, exact; None if it holds others."""
        return as_counts(self._arrays[self.names[place]])

    def _real(self, name: str, missing: Sequence[str]) -> Array:
        values = self._arrays[name]
        if np.iscomplexobj(values):
            raise InputError(f"{self.path}: {name!r} is complex; give real numbers")
        column = values.astype(float)
        if np.isinf(column).any():
            row = int(np.flatnonzero(np.isinf(column))[0]) + 1
            raise InputError(
                f"{self.path}: {name!r}, row {row} is infinite; mend it, or make it NaN if missing"
            )
        column[np.isin(column, finite_words(missing))] = np.nan
        return column


def _export(name: str, kind: str) -> str:
    way = _EXPORTS.get(kind, "s = struct({0}); save('log.mat', '-struct', 's', '-v7')")
    return f"only MATLAB itself reads; export it there with: {way.format(name)}"


def unpack(path: Path, size: int, question: None = None) -> tuple[dict[str, NDArray[Any]], dict[str, Any]]:
    """All columns of a file, the names and classes of its objects, and what is too wide for columns.

    Runs in a process of its own.
    """
    from scipy.io import loadmat, matlab

    if any(unpacked > size for unpacked in _unpacked(path)):
        raise MemoryError
    try:
        variables = loadmat(path, simplify_cells=True)
    except NotImplementedError:
        raise InputError(
            f"{path} is a MATLAB file of version 7.3 (HDF5); save it in MATLAB with: save -v7"
        ) from None
    objects = [_class(value) for value in variables.values() if isinstance(value, matlab.MatlabOpaque)]
    if objects:  # SciPy keeps one of them only, as none of them has its name where other variables have it
        with path.open("rb") as file:
            parts = [loadmat(part) for _, part in matlab.varmats_from_mat(file)]
        found = (value for part in parts for value in part.values() if isinstance(value, matlab.MatlabOpaque))
        objects = [_class(value) for value in found]
    arrays = dict(_arrays(variables))
    images = {name: _size(value) for name, value in arrays.items() if _width(value) > _MOST}
    columns = {
        own: column
        for name, value in arrays.items()
        if 0 < _width(value) <= _MOST
        for own, column in _columns(name, value)
    }
    return columns, {"objects": objects, "images": images}


def _unpacked(path: Path) -> Iterator[int]:
    """How much the compressed variables of a file of v7 unpack to, as it grows [bytes]."""
    total = 0
    with path.open("rb") as file:
        order = {b"IM": "<", b"MI": ">"}.get(file.read(_HEADER)[-2:])
        while order and len(tag := file.read(8)) == 8:
            kind, size = unpack_from(f"{order}II", tag)
            if kind != _COMPRESSED:
                file.seek(size, SEEK_CUR)
                continue
            inflate = decompressobj()
            for start in range(0, size, _PIECE):
                packed = file.read(min(_PIECE, size - start))
                while packed:
                    total += len(inflate.decompress(packed, _PIECE))
                    packed = inflate.unconsumed_tail
                    yield total


def _class(value: NDArray[Any]) -> tuple[str, str]:
    """Name and class of an object, which its own header holds."""
    words = [
        field.decode(errors="replace") if isinstance(field, bytes) else str(field) for field in value.flat[0]
    ]
    return words[0], words[2]


def _arrays(variables: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, NDArray[Any]]]:
    for own, value in variables.items():
        name = f"{prefix}{own}"
        if own.startswith("__"):
            continue
        if isinstance(value, Mapping):
            yield from _arrays(value, f"{name}.")
        elif isinstance(value, np.ndarray) and value.dtype.kind in "biufc":
            yield name, value.squeeze()


def _width(value: NDArray[Any]) -> int:
    """How many columns an array makes: none if it holds less than two values."""
    return value.size // max(value.shape) if value.size > 1 else 0


def _size(value: NDArray[Any]) -> str:
    return f"an array of {' x '.join(map(str, value.shape))}, which has too many columns for a log"


def _columns(name: str, value: NDArray[Any]) -> Iterator[tuple[str, NDArray[Any]]]:
    """The columns along the longest side; the first of those that are equally long."""
    rows = np.moveaxis(value, int(np.argmax(value.shape)), -1)
    for place in product(*map(range, rows.shape[:-1])):
        yield ".".join(map(str, (name, *place))), rows[place]
