"""Records on disk: Parquet, with units and metadata in the file's own metadata."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from palpate.errors import InputError
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


def read_record(path: str | Path) -> Record:
    """Read back what `write_record` wrote.

    Raises:
        InputError: the file is missing, is no Parquet file, or was not written by palpate.
    """
    import polars

    path = Path(path)
    about = stored_about(path)
    if about is None:
        raise InputError(f"{path} carries no units of palpate; read it with read_log and name its columns")
    frame = polars.read_parquet(path)
    columns = {name: frame[name].to_numpy().astype(float, copy=False) for name in frame.columns}
    return Record(columns, dict(about["units"]), about["meta"])


def stored_about(path: Path) -> dict[str, dict[str, Any]] | None:
    """Units and metadata that palpate left in a Parquet file; None where there are none.

    Raises:
        InputError: the file cannot be read as Parquet.
    """
    import polars

    try:
        about = polars.read_parquet_metadata(path).get(KEY)
    except FileNotFoundError:
        raise InputError(f"there is no file {path}; check the path") from None
    except (polars.exceptions.PolarsError, OSError) as error:
        raise InputError(f"{path} cannot be read as Parquet ({_first_line(error)}); is it whole?") from None
    return json.loads(about) if about else None


def _first_line(error: Exception) -> str:
    return (str(error).splitlines() or [type(error).__name__])[0]
