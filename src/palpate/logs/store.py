"""Records on disk: Parquet, with units and metadata in the file's own metadata."""

from __future__ import annotations

import json
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from palpate.errors import InputError
from palpate.files import SIGNATURE, whole
from palpate.files.limits import Limits, ReadingBudget
from palpate.logs.tables.parquet import read_columns, stored_about
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
    path, limits = Path(path), limits or Limits()
    about = stored_about(path, limits)
    if about is None:
        raise InputError(f"{path} carries no units of palpate; read it with read_log and name its columns")
    return Record(read_columns(path, ReadingBudget(path, limits)), about.units, about.meta)
