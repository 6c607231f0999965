"""MATLAB files, v4 to v7: variables as columns of numbers."""

from collections.abc import Iterator, Mapping, Sequence
from io import SEEK_CUR
from itertools import product
from pathlib import Path
from struct import unpack_from
from typing import Any
from zlib import decompressobj

import numpy as np

from palpate.arrays import AnyArray
from palpate.errors import InputError
from palpate.files.confined import read_confined
from palpate.files.reading import ReadingBudget
from palpate.logs.tables.sheet import Cells, Sheet, as_counts

_HEADER = 128
_COMPRESSED = 15
_PIECE = 1 << 20
_MAX_COLUMNS = 64
"""Columns of one variable; what has more is an image, say."""
_EXPORTS = {
    "table": "s = table2struct({0}, 'ToScalar', true); save('log.mat', '-struct', 's', '-v7')",
    "timetable": "s = table2struct(timetable2table({0}), 'ToScalar', true); save('log.mat', '-struct', 's', '-v7')",
    "timeseries": "time = {0}.Time; data = {0}.Data; save('log.mat', 'time', 'data', '-v7')",
    "datetime": "{0} = posixtime({0}); save('log.mat', '{0}', '-v7')",
    "duration": "{0} = seconds({0}); save('log.mat', '{0}', '-v7')",
}
"""Commands by which MATLAB turns an object of a class into plain arrays."""


def read_matlab(path: Path, budget: ReadingBudget) -> Sheet:
    """The numeric variables of a MATLAB file as columns; fields of a struct are `struct.field`.

    An array gives a column for each place beside its longest side: `wrench.0` to `wrench.5` for one of 5000 x 6 or
    6 x 5000, `T.0.3` for one of 4 x 4 x 5000. Scalars are none.

    Args:
        path: the file.
        budget: of the log.

    Raises:
        InputError: the file is no MATLAB file of v4 to v7, is damaged, or holds no numbers in columns.
    """
    arrays, also = read_confined(__name__, path, "a MATLAB file", budget)
    objects = {name: f"a MATLAB {kind}, which {_export(name, kind)}" for name, kind in also["objects"]}
    left_out = also["images"] | objects
    names = list(arrays)
    if not names:
        example = next((f": {name} is {what}" for name, what in left_out.items()), "")
        raise InputError(f"{path} holds no array of numbers with a value for each sample{example}")
    return Sheet(
        path, names, lambda places, missing: ([finite_cells(arrays[names[i]], missing) for i in places], []),
        lambda index: as_counts(arrays[names[index]]), left_out=left_out,
    )  # fmt: skip


def finite_cells(values: AnyArray, missing: Sequence[str]) -> Cells:
    """An array as a column; infinite and complex values are no numbers."""
    if np.iscomplexobj(values):
        return Cells(np.full(len(values), np.nan), ("row 1", str(values[0])))
    column = values.astype(float)
    infinite = np.flatnonzero(np.isinf(column))
    texts = ((row, str(values[row])) for row in infinite)
    wrong = next(((f"row {row + 1}", text) for row, text in texts if text not in missing), None)
    column[infinite] = np.nan
    return Cells(column, wrong)


def _export(name: str, kind: str) -> str:
    command = _EXPORTS.get(kind, "s = struct({0}); save('log.mat', '-struct', 's', '-v7')")
    return f"only MATLAB itself reads; export it there with: {command.format(name)}"


def unpack(path: Path, size: int, question: None = None) -> tuple[dict[str, AnyArray], dict[str, Any]]:
    """All columns of a file, the names and classes of its objects, and what is too wide for columns.

    Runs in a process of its own.
    """
    from scipy.io import loadmat, matlab

    if any(unpacked > size for unpacked in _unpacked_sizes(path)):
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
        opaque = (
            value for part in parts for value in part.values() if isinstance(value, matlab.MatlabOpaque)
        )
        objects = [_class(value) for value in opaque]
    columns, images = columns_of_arrays(dict(_arrays(variables)))
    return columns, {"objects": objects, "images": images}


def columns_of_arrays(arrays: Mapping[str, AnyArray]) -> tuple[dict[str, AnyArray], dict[str, str]]:
    """The columns of arrays without sides of one place, by name; and what is too wide for columns."""
    images = {name: _size(value) for name, value in arrays.items() if _width(value) > _MAX_COLUMNS}
    columns = {
        title: column
        for name, value in arrays.items()
        if 0 < _width(value) <= _MAX_COLUMNS
        for title, column in _columns(name, value)
    }
    return columns, images


def _unpacked_sizes(path: Path) -> Iterator[int]:
    """Unpacked size so far of the compressed variables of a file of v7 [bytes]."""
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


def _class(value: AnyArray) -> tuple[str, str]:
    """Name and class of an object, which its own header holds."""
    words = [
        field.decode(errors="replace") if isinstance(field, bytes) else str(field) for field in value.flat[0]
    ]
    return words[0], words[2]


def _arrays(variables: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, AnyArray]]:
    for key, value in variables.items():
        name = f"{prefix}{key}"
        if key.startswith("__"):
            continue
        if isinstance(value, Mapping):
            yield from _arrays(value, f"{name}.")
        elif isinstance(value, np.ndarray) and value.dtype.kind in "biufc":
            yield name, value.squeeze()


def _width(value: AnyArray) -> int:
    """Number of columns of an array: 0 if it holds less than two values."""
    return value.size // max(value.shape) if value.size > 1 else 0


def _size(value: AnyArray) -> str:
    return f"an array of {' x '.join(map(str, value.shape))}, which has too many columns for a log"


def _columns(name: str, value: AnyArray) -> Iterator[tuple[str, AnyArray]]:
    """The columns along the longest side; the first of those that are equally long."""
    rows = np.moveaxis(value, int(np.argmax(value.shape)), -1)
    for index in product(*map(range, rows.shape[:-1])):
        yield ".".join(map(str, (name, *index))), rows[index]
