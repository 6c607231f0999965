"""Parquet: columns of any file, structs included, read by polars in a process of its own; records, in and out."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from functools import lru_cache
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec
import numpy as np

from palpate.arrays import AnyArray, Array, Counts
from palpate.errors import InputError
from palpate.files import SIGNATURE, whole
from palpate.files.confined import read_confined
from palpate.files.reading import ReadingBudget, ReadingLimits
from palpate.logs.tables.lines import NO_READING, seconds_of_cells
from palpate.logs.tables.sheet import Cells, Sheet, Stated, as_counts
from palpate.records import Record

if TYPE_CHECKING:
    import polars
    from polars import DataFrame


_BYTES = 8
_CACHED_HEADS = 8
"""Heads that are kept: several questions are asked about one log."""
_MAX_SMALL_RECORD = 16 * 10**6
"""A record of palpate's own up to this size [bytes] is read with its head: a second process would take longer."""


class About(msgspec.Struct, frozen=True):
    """Metadata of palpate in a Parquet file.

    Args:
        units: the SI unit of each column.
        meta: whatever else is known.
    """

    units: dict[str, str]
    meta: dict[str, Any]


class ParquetHead(msgspec.Struct, frozen=True, array_like=True):
    """Statements of a Parquet file about itself.

    Args:
        rows: how many.
        names: of the columns, in the file's order.
        lists: columns that hold a list a row.
        about: the text that palpate left in it; None where there is none.
    """

    rows: int
    names: list[str]
    lists: list[str]
    about: str | None


def read_parquet(path: Path, budget: ReadingBudget) -> Sheet:
    """The columns of a Parquet file; a field of a struct is `struct.field`.

    Args:
        path: the file.
        budget: of the log.

    Raises:
        InputError: it cannot be read.
    """
    about = stored_about(path, budget.limits)
    stated = {name: Stated(symbol) for name, symbol in about.units.items()} if about else {}
    schema = head(path, budget.limits)
    lists = dict.fromkeys(schema.lists, "a column of lists; give a column of numbers")
    return Sheet(
        path, schema.names, lambda places, missing: (_read(path, budget, places, missing), []),
        lambda index: _read_counts(path, budget, index), stated, left_out=lists,
    )  # fmt: skip


def _read(path: Path, budget: ReadingBudget, places: Sequence[int], missing: Sequence[str]) -> list[Cells]:
    matrix = _open(path, budget.limits)[1]
    if matrix is not None and np.isfinite(matrix[list(places)]).all():
        return [Cells(matrix[i]) for i in places]
    columns, also = _query(path, budget, places, missing)
    wrong = {i: (f"row {row + 1}", text) for i, row, text in also["wrong"]}
    cells = []
    for i, column in enumerate(columns["numbers"]):
        column[~np.isfinite(column)] = np.nan
        cells.append(Cells(column, wrong.get(i), i in also["clocks"]))
    return cells


def _read_counts(path: Path, budget: ReadingBudget, index: int) -> Counts | None:
    answer = _query(path, budget, [index], exact=True)[0]
    return as_counts(answer["counts"]) if answer else None


def read_columns(path: Path, budget: ReadingBudget) -> dict[str, Array]:
    """All columns of a record of palpate's own, what is infinite included.

    Raises:
        InputError: it cannot be read.
    """
    schema, matrix = _open(path, budget.limits)
    numbers = matrix if matrix is not None else _query(path, budget, range(len(schema.names)))[0]["numbers"]
    return {name: np.array(column) for name, column in zip(schema.names, numbers, strict=True)}


def _query(
    path: Path,
    budget: ReadingBudget,
    places: Sequence[int],
    missing: Sequence[str] = (),
    *,
    exact: bool = False,
) -> tuple[dict[str, AnyArray], Any]:
    budget.check(_BYTES * head(path, budget.limits).rows * len(places))
    question = {"places": list(places), "missing": list(missing), "exact": exact}
    return read_confined(__name__, path, "Parquet", budget, question)


def stored_about(path: Path, limits: ReadingLimits | None = None) -> About | None:
    """Units and metadata that palpate left in a Parquet file; None where there are none.

    Raises:
        InputError: the file cannot be read as Parquet, or what palpate left in it was changed.
    """
    about = head(path, limits).about
    try:
        return msgspec.json.decode(about, type=About) if about else None
    except (msgspec.DecodeError, RecursionError) as error:
        raise InputError(
            f"{path} carries metadata of palpate that is spoiled ({error}); write the record again"
        ) from None


def head(path: Path, limits: ReadingLimits | None = None) -> ParquetHead:
    """Read the statements of a Parquet file about itself.

    Raises:
        InputError: there is no such file, or it cannot be read as Parquet.
    """
    return _open(path, limits)[0]


def _open(path: Path, limits: ReadingLimits | None) -> tuple[ParquetHead, Array | None]:
    """The head; and all columns, shape (columns, rows), of a small record of palpate's own."""
    try:
        state = path.stat()
    except FileNotFoundError:
        raise InputError(f"there is no file {path}; check the path") from None
    return _head(
        path, (state.st_dev, state.st_ino, state.st_size, state.st_mtime_ns), limits or ReadingLimits()
    )


@lru_cache(maxsize=_CACHED_HEADS)
def _head(path: Path, state: tuple[int, ...], limits: ReadingLimits) -> tuple[ParquetHead, Array | None]:
    arrays, also = read_confined(__name__, path, "Parquet", ReadingBudget(path, limits))
    return msgspec.convert(also, ParquetHead), arrays.get("numbers")


def unpack(path: Path, size: int, question: Any) -> tuple[dict[str, AnyArray], Any]:
    """A file's head, some of its columns as numbers, or one as counts. Runs in a process of its own."""
    import polars

    rows = polars.scan_parquet(path, glob=False)
    schema = rows.collect_schema()
    leaves = list(_leaves(schema))
    if question is None:
        lists = [name for name, dtype in schema.items() if isinstance(dtype, polars.List | polars.Array)]
        about = polars.read_parquet_metadata(path).get(SIGNATURE)
        count = rows.select(polars.len()).collect().item()
        matrix = {}
        if about is not None and set(schema.dtypes()) == {polars.Float64}:
            few = _BYTES * count * len(leaves) <= min(_MAX_SMALL_RECORD, size)
            matrix = {"numbers": rows.collect().to_numpy().T} if few else {}
        return matrix, (count, [name for name, _ in leaves], lists, about)
    places = question["places"]
    frame = rows.select(leaves[i][1].alias(str(i)) for i in sorted(set(places))).collect(engine="streaming")
    if question["exact"]:
        return _counts(frame[str(places[0])]), None
    cells = [frame[str(i)] for i in places]
    numbers = np.array([_numbers(cell) for cell in cells], float).reshape(len(cells), len(frame))
    words = NO_READING | {word.lower() for word in question["missing"]}
    wrong = [(i, *fault) for i, cell in enumerate(cells) if (fault := _wrong(cell, numbers[i], words))]
    clocks = [i for i, cell in enumerate(cells) if cell.dtype.is_temporal()]
    return {"numbers": numbers}, {"wrong": wrong, "clocks": clocks}


def _numbers(cells: polars.Series) -> Array:
    import polars

    if cells.dtype.is_temporal():
        return seconds_of_cells(cells)
    numbers: Array = cells.cast(polars.Float64, strict=False).to_numpy()
    return numbers


def _wrong(cells: polars.Series, numbers: Array, words: set[str]) -> tuple[int, str] | None:
    """The first cell that holds something and yet no finite number: its row, and its text."""
    if cells.dtype.is_temporal():
        return None
    for row in np.flatnonzero(~np.isfinite(numbers) & cells.is_not_null().to_numpy()):
        text = str(cells[int(row)])
        if text.strip().lower() not in words:
            return int(row), text
    return None


def _counts(cells: polars.Series) -> dict[str, AnyArray]:
    if not cells.dtype.is_integer() or cells.null_count():
        return {}
    return {"counts": cells.to_numpy()}


def _leaves(schema: Mapping[str, Any]) -> Iterator[tuple[str, polars.Expr]]:
    """Every column of a schema that is no list, and every field of its structs."""
    import polars

    for name, dtype in schema.items():
        if isinstance(dtype, polars.Struct):
            yield from _fields(name, polars.col(name), dtype)
        elif not isinstance(dtype, polars.List | polars.Array):
            yield name, polars.col(name)


def _fields(prefix: str, expression: polars.Expr, struct: polars.Struct) -> Iterator[tuple[str, polars.Expr]]:
    import polars

    for field in struct.fields:
        name = f"{prefix}.{field.name}"
        value = expression.struct.field(field.name)
        if isinstance(field.dtype, polars.Struct):
            yield from _fields(name, value, field.dtype)
        elif not isinstance(field.dtype, polars.List | polars.Array):
            yield name, value


def write_record(record: Record, path: str | Path) -> Path:
    """Write a record so that the file is either whole or not there.

    Returns:
        The path written.

    Raises:
        InputError: the folder does not exist, or palpate may not write over what stands there.
    """
    import polars

    path = Path(path)
    about = json.dumps({"units": dict(record.units), "meta": dict(record.meta)}, allow_nan=False)
    write_parquet(
        polars.DataFrame({name: np.asarray(column, float) for name, column in record.columns.items()}),
        about,
        path,
    )
    return path


def write_parquet(frame: DataFrame, about: str, path: Path) -> None:
    """Write a table as Parquet, whole or not at all, with a text about it in the file's own metadata.

    Raises:
        InputError: palpate may not write there.
        OSError: the disk is full.
    """
    packed = BytesIO()  # what a library raises when the disk is full is its own affair
    frame.write_parquet(packed, metadata={SIGNATURE: about})
    with whole(path) as draft:
        draft.write_bytes(packed.getbuffer())


def read_record(path: str | Path, limits: ReadingLimits | None = None) -> Record:
    """Read back what `write_record` wrote.

    Raises:
        InputError: the file is missing, is no Parquet file, or was not written by palpate.
    """
    path = Path(path)
    limits = limits or ReadingLimits()
    about = stored_about(path, limits)
    if about is None:
        raise InputError(f"{path} carries no units of palpate; read it with read_log and name its columns")
    return Record(read_columns(path, ReadingBudget(path, limits)), about.units, about.meta)
