"""The rows of a study as one table, in the order of the runs, not of their completion."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec

from palpate.bench.metrics import metric_of
from palpate.errors import InputError
from palpate.logs.store import write_parquet
from palpate.studies.definition.plan import Plan
from palpate.studies.running.run_one import Row

if TYPE_CHECKING:
    from polars import DataFrame

NAME = "results.parquet"
CHUNK = 20_000
"""Rows that are taken at a time from text to columns."""


def table(plan: Plan, rows: Iterable[Row]) -> DataFrame:
    """The rows as columns: run, parameters, seed, result, why, metrics; each run once, sorted by its number."""
    import polars

    schema = _schema(plan)
    frames = [polars.DataFrame(columns, schema=schema) for columns in _columns(plan, rows)]
    joined = polars.concat(frames) if frames else polars.DataFrame(schema=schema)
    return joined.unique("run", keep="first", maintain_order=True).sort("run").rechunk()


def write(frame: DataFrame, plan: Plan, path: Path) -> None:
    """Writes the table as Parquet, atomically; units and texts of the metrics in the file's own metadata.

    Raises:
        InputError: the disk is full.
    """
    metrics = {
        name: {"unit": metric_of(name).unit, "text": metric_of(name).text} for name in plan.study.metrics
    }
    about = msgspec.json.encode({"title": plan.study.title, "metrics": metrics}).decode()
    try:
        write_parquet(frame, about, path)
    except OSError as error:
        raise InputError(
            f"{path}: {error.strerror}; the runs are saved: free some space, and the same command writes the table"
        ) from error


def _columns(plan: Plan, rows: Iterable[Row]) -> Iterator[dict[str, list[Any]]]:
    left, texts = iter(rows), [name for name, kind in plan.columns.items() if kind is str]
    while chunk := list(islice(left, CHUNK)):
        columns: dict[str, list[Any]] = {"run": [r.run for r in chunk]}
        for name in plan.columns:
            values = [r.at.get(name) for r in chunk]
            columns[name] = [None if v is None else str(v) for v in values] if name in texts else values
        columns |= {"result": [r.result for r in chunk], "why": [r.why for r in chunk]}
        columns |= {name: [r.metrics[i] for r in chunk] for i, name in enumerate(plan.study.metrics)}
        yield columns


def _schema(plan: Plan) -> dict[str, Any]:
    import polars

    kinds = {int: polars.Int64, float: polars.Float64, bool: polars.Boolean, str: polars.String}
    told = {name: kinds[kind] for name, kind in plan.columns.items()}
    metrics = dict.fromkeys(plan.study.metrics, polars.Float64)
    return {"run": polars.Int64, **told, "result": polars.String, "why": polars.String, **metrics}
