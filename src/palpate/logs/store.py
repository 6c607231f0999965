"""Records on disk: Parquet, with units and metadata in the file's own metadata."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from palpate.errors import InputError
from palpate.logs.limits import Budget, Limits
from palpate.logs.whole import whole
from palpate.records import Record

KEY = "palpate"


def write_record(record: Record, path: str | Path) -> Path:
    """Write a record so that the file is either whole or not there.

    It is written beside its place under another name and then moved there in one step.

    Returns:
        The path written.

    Raises:
        InputError: the folder does not exist, or the path is a folder.
    """
    import polars

    path = Path(path)
    if path.is_dir():
        raise InputError(f"{path} is a folder; name a file in it, such as {path / 'record.parquet'}")
    if not path.parent.is_dir():
        raise InputError(f"cannot write {path}: there is no folder {path.parent}; make it first")
    about = {KEY: json.dumps({"units": dict(record.units), "meta": dict(record.meta)}, allow_nan=False)}
    frame = polars.DataFrame({name: np.asarray(column, float) for name, column in record.columns.items()})
    with whole(path) as draft:
        frame.write_parquet(draft, metadata=about)
    return path


def read_record(path: str | Path, limits: Limits | None = None) -> Record:
    """Read back what `write_record` wrote.

    Raises:
        InputError: the file is missing, is no Parquet file, or was not written by palpate.
    """
    import polars

    path = Path(path)
    about = stored_about(path)
    if about is None:
        raise InputError(f"{path} carries no units of palpate; read it with read_log and name its columns")
    with polars_says(path):
        lazy = polars.scan_parquet(path, glob=False)
        rows = lazy.select(polars.len()).collect().item()
        Budget(path, limits or Limits()).check(8.0 * rows * len(about.units))
        frame = lazy.collect().cast(polars.Float64)
    columns = {name: frame[name].to_numpy() for name in frame.columns}
    return Record(columns, about.units, about.meta)


class About(msgspec.Struct, frozen=True):
    """What palpate leaves in a Parquet file beside the columns.

    Args:
        units: the SI unit of each column.
        meta: whatever else is known.
    """

    units: dict[str, str]
    meta: dict[str, Any]


def stored_about(path: Path) -> About | None:
    """Units and metadata that palpate left in a Parquet file; None where there are none.

    Raises:
        InputError: the file cannot be read as Parquet, or what palpate left in it was changed.
    """
    import polars

    with polars_says(path):
        about = polars.read_parquet_metadata(path).get(KEY)
    try:
        return msgspec.json.decode(about, type=About) if about else None
    except (msgspec.DecodeError, RecursionError) as error:
        raise InputError(
            f"{path} carries metadata of palpate that is spoiled ({error}); write the record again"
        ) from None


@contextmanager
def polars_says(path: Path) -> Iterator[None]:
    """Say in one line what polars finds wrong with a file."""
    import polars

    try:
        yield
    except FileNotFoundError:
        raise InputError(f"there is no file {path}; check the path") from None
    except (polars.exceptions.PolarsError, polars.exceptions.PanicException, OSError) as error:
        line = (str(error).splitlines() or [type(error).__name__])[0]
        raise InputError(f"{path} cannot be read as Parquet ({line}); is it whole?") from None
