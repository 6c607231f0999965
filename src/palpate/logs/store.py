"""Records on disk: Parquet, with units and metadata in the file's own metadata."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec
import numpy as np

from palpate.errors import InputError
from palpate.files import SIGNATURE, whole
from palpate.logs.limits import Budget, Limits
from palpate.records import Record

if TYPE_CHECKING:
    from polars import DataFrame


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
        about = polars.read_parquet_metadata(path).get(SIGNATURE)
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
