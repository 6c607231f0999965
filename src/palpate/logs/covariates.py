"""Covariates of many logs, such as their temperature: a column of each log, or of a table with a row for each."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from palpate.arrays import Array
from palpate.errors import InputError, unknown
from palpate.files.reading import read_text
from palpate.logs.kinds import kind_of
from palpate.logs.tables import open_table


def read_covariates(
    logs: Sequence[Path],
    names: Sequence[str],
    table: Path | None = None,
    missing: Sequence[str] = (),
    delimiter: str | None = None,
) -> dict[str, Array]:
    """One number of each log by the covariate's name, each of shape (logs,): the mean of the log's column.

    Args:
        logs: paths of them.
        names: of the covariates.
        table: a CSV file with the column `log`, which holds the logs' file names, and a column for each covariate; the
            logs' own columns when None.
        missing: values in the logs that mean "no reading".
        delimiter: between two cells of a log; found when None.

    Raises:
        InputError: a log has no such column or no row, or a value is no number.
    """
    rows = None if table is None else _rows(table, names)
    found = [
        [_mean(log, name, missing, delimiter) for name in names] if rows is None else _row(log, rows, table)
        for log in logs
    ]
    return dict(zip(names, np.array(found, np.float64).reshape(len(logs), len(names)).T, strict=True))


def _mean(log: Path, name: str, missing: Sequence[str], delimiter: str | None) -> float:
    kind = kind_of(log)
    if kind.is_bag:
        raise InputError(f"{log} is a bag, which has no column {name}; give a table by --covariates")
    sheet = open_table(log, kind, delimiter)
    (column,) = sheet.numbers([sheet.resolve(name)], missing)
    if not np.isfinite(column).any():
        raise InputError(f"{log}: column {name!r} has no reading; give a table by --covariates")
    return float(np.nanmean(column))


def _rows(table: Path, names: Sequence[str]) -> dict[str, list[float]]:
    try:
        rows = list(csv.DictReader(read_text(table, "a table of covariates").splitlines(), strict=True))
    except (OSError, csv.Error) as error:
        raise InputError(f"{table}: no table of covariates ({error}); check the path") from None
    there = list(rows[0]) if rows else []
    for name in ("log", *names):
        if name not in there:
            raise InputError(f"{table}: {unknown('column', name, there)}")
    return {str(row["log"]): [_number(table, row, name) for name in names] for row in rows}


def _number(table: Path, row: dict[str, str], name: str) -> float:
    try:
        value = float(row[name])
    except (TypeError, ValueError):
        value = np.nan
    if not np.isfinite(value):
        raise InputError(f"{table}: {name} of {row['log']} is {row[name]!r}, which is no number; fill it in")
    return value


def _row(log: Path, rows: dict[str, list[float]], table: Path | None) -> list[float]:
    found = [rows[name] for name in (str(log), log.name, log.stem) if name in rows]
    if not found:
        raise InputError(f"{table}: {unknown('log', log.name, rows)}; add its row")
    return found[0]
