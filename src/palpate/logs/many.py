"""Many logs: the files of folders and the sheets of books that paths name, and covariates, such as a temperature."""

import csv
import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from palpate.arrays import Array
from palpate.errors import InputError, unknown
from palpate.files import RECORD
from palpate.files.limits import ReadingLimits
from palpate.files.reading import read_text
from palpate.logs.kinds import STORAGES, Kind, kind_of
from palpate.logs.tables import equal_sheets, open_table

ENDINGS = {
    ".csv", ".tsv", ".txt", ".dat", ".ddf", ".lvm", ".xlsx", ".parquet", ".mat", ".bag", *STORAGES
}  # fmt: skip
"""Of the files that are taken for logs in a folder."""


def log_of(path: Path) -> Path:
    """The record in the folder of a run or a press; of another path, the path itself."""
    record = path / RECORD
    beside = ("summary.json", "press.json")  # of a run or a simulated press; of a press over a wire
    return record if record.is_file() and any((path / name).is_file() for name in beside) else path


def is_folder_of_logs(path: Path) -> bool:
    """Whether a path is a folder, and not itself one log, as a ROS 2 bag or the folder of a run is."""
    if not path.is_dir() or log_of(path) != path:
        return False
    return not any((path / "metadata.yaml").is_file() or file.suffix in STORAGES for file in path.iterdir())


def sheets_as_logs(paths: Sequence[Path], names: Sequence[str], limits: ReadingLimits) -> tuple[Path, ...]:
    """The paths, a book whose sheets repeat one test by those sheets.

    Args:
        paths: of logs.
        names: of the columns that are read; a book without one of them stays as it is, as `SHEET.NAME` does.
        limits: of a log.
    """
    found: list[Path] = []
    for path in paths:
        book = path.is_file() and kind_of(path) is Kind.SHEETS
        found.extend((equal_sheets(path, limits, names) if book else []) or [path])
    return tuple(found)


def gather_logs(paths: Sequence[Path]) -> tuple[Path, ...]:
    """The logs that paths name: a file as it is, a folder by its files, in the order of their names and numbers.

    Raises:
        InputError: a folder holds none, or a log is named twice: pooled, it would count twice.
    """
    found: list[Path] = []
    for path in paths:
        found.extend(_of_folder(path) if is_folder_of_logs(path) else [log_of(path)])
    seen: dict[Path, Path] = {}
    for path in found:
        if path.resolve() in seen:
            raise InputError(f"{path} is named twice; a log counts once, leave one out")
        seen[path.resolve()] = path
    return tuple(found)


def _of_folder(folder: Path) -> list[Path]:
    logs = [
        log_of(path)
        for path in sorted(folder.iterdir(), key=_by_number)
        if not path.name.startswith(".")
        and (
            path.suffix.lower() in ENDINGS
            if path.is_file()
            else path.is_dir() and not is_folder_of_logs(path)
        )
    ]
    if not logs:
        raise InputError(
            f"{folder} is a folder and no ROS 2 bag, no run, and holds no log; logs are recognised by their"
            f" endings: {', '.join(sorted(ENDINGS))}"
        )
    return logs


def _by_number(path: Path) -> list[tuple[int, str]]:
    """A key that sorts `press_40` before `press_250`."""
    parts = re.split(r"(\d+)", path.name)
    return [(int(part), "") if i % 2 else (0, part) for i, part in enumerate(parts)]


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
