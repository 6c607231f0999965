"""Formats of log files, recognised by their first bytes, not by their names; the logs that paths name."""

import re
from collections.abc import Sequence
from enum import Enum
from pathlib import Path
from zipfile import BadZipFile, ZipFile

import numpy as np

from palpate.arrays import Array
from palpate.errors import InputError
from palpate.files import RECORD
from palpate.files.reading import ReadingBudget, ReadingLimits
from palpate.logs.tables.sheet import Sheet


class Kind(Enum):
    """The kinds of logs that palpate reads, by what to call them in a sentence."""

    TEXT = "text"
    PARQUET = "Parquet"
    MAT = "a MATLAB file"
    SHEETS = "a spreadsheet"
    HDF5 = "HDF5"
    NPZ = "a NumPy file"
    TDMS = "TDMS"
    AFM = "an AFM curve"
    BAG1 = "a ROS 1 bag"
    MCAP = "MCAP"
    SQLITE = "a ROS 2 bag (sqlite3)"
    FOLDER = "a ROS 2 bag"

    @property
    def is_bag(self) -> bool:
        """True if it holds messages by topic, each with times of its own."""
        return self in {Kind.BAG1, Kind.MCAP, Kind.SQLITE, Kind.FOLDER}


STORAGES = (".mcap", ".db3")
"""Suffixes of the files that a ROS 2 bag's folder holds its messages in."""
PACKED = ".zstd"
"""Suffix that follows it where the file was packed as a whole."""

_BEGINNINGS = {
    b"PAR1": Kind.PARQUET,
    b"#ROSBAG V": Kind.BAG1,
    b"\x89MCAP": Kind.MCAP,
    b"SQLite format 3\x00": Kind.SQLITE,
    b"MATLAB 5.0 MAT-file": Kind.MAT,
    b"MATLAB 7.3 MAT-file": Kind.HDF5,
    b"\x89HDF\r\n\x1a\n": Kind.HDF5,
    b"TDSm": Kind.TDMS,
    b"\x93NUMPY": Kind.NPZ,
}
_AFM = {".jpk-force", ".jpk-force-map", ".jpk-qi-data", ".jpk-qi-series", ".ibw"}
"""Endings of the files of atomic force microscopes that are no text."""


def kind_of(path: Path) -> Kind:
    """Look at a log.

    Raises:
        InputError: there is no such file; it is empty, a pipe, or a folder that is no bag.
    """
    if _is_sheet(path):
        return Kind.SHEETS
    if not path.exists():
        raise InputError(f"there is no file {path}; check the path")
    if path.is_dir():
        if any(
            (path / "metadata.yaml").is_file() or {file.suffix, file.with_suffix("").suffix} & {*STORAGES}
            for file in path.iterdir()
        ):
            return Kind.FOLDER
        raise InputError(
            f"{path} is a folder and no ROS 2 bag; give a log file, or a bag's own folder (identify pools logs)"
        )
    if not path.is_file():
        raise InputError(f"{path} is a pipe or a device; a log is read more than once, so save it as a file")
    with path.open("rb") as file:
        begin = file.read(32)
    if not begin:
        raise InputError(f"{path} is empty; give a log with a row of numbers for each sample")
    if path.suffix.lower() in _AFM:
        return Kind.AFM
    if begin.startswith(b"PK\x03\x04") and _is_spreadsheet(path):
        return Kind.SHEETS
    if begin.startswith(b"PK\x03\x04") and path.suffix.lower() == ".npz":
        return Kind.NPZ
    detected = next((kind for magic, kind in _BEGINNINGS.items() if begin.startswith(magic)), Kind.TEXT)
    return Kind.MAT if detected is Kind.TEXT and path.suffix.lower() == ".mat" else detected


def _is_sheet(path: Path) -> bool:
    """True if a path is `BOOK.xlsx/SHEET`, a sheet of a book."""
    return path.parent.is_file() and kind_of(path.parent) is Kind.SHEETS


def _is_spreadsheet(path: Path) -> bool:
    """True if a zip archive holds the parts of a spreadsheet."""
    try:
        with ZipFile(path) as packed:
            return bool({"xl/workbook.xml", "xl/workbook.bin", "content.xml"} & set(packed.namelist()))
    except (BadZipFile, OSError, ValueError, NotImplementedError):
        return path.suffix.lower() in {".xlsx", ".xlsm", ".xlsb", ".ods"}


def open_table(
    path: Path,
    kind: Kind,
    delimiter: str | None = None,
    limits: ReadingLimits | None = None,
    join: Path | None = None,
) -> Sheet:
    """A file of columns, read where they are asked for; with those of a second file that is joined by its time.

    Two branches of a press side by side have columns for both, too.

    Raises:
        InputError: it cannot be read, or is larger than the limits; the times of the two do not overlap.
    """
    budget = ReadingBudget(path, limits or ReadingLimits())
    if join is not None:
        from palpate.logs.joining import join_sheets

        second = kind_of(join)
        if second.is_bag:
            raise InputError(f"{join} is a bag; --join takes a file of columns")
        return join_sheets(
            open_table(path, kind, delimiter, limits), open_table(join, second, delimiter, limits)
        )
    sheet = _open(path, kind, budget, delimiter)
    if not _SECOND_BRANCH.search(" ".join(sheet.names)):
        return sheet
    from palpate.logs.joining import join_branches

    return join_branches(sheet)


_SECOND_BRANCH = re.compile(r"retract|withdraw|unload|retrace|(?:\b|_)rt(?:\b|_)", re.IGNORECASE)
"""Words of a column that may be of the second of two branches."""


def _open(path: Path, kind: Kind, budget: ReadingBudget, delimiter: str | None) -> Sheet:
    match kind:
        case Kind.MAT:
            from palpate.logs.tables.matlab import read_matlab

            return read_matlab(path, budget)
        case Kind.SHEETS:
            from palpate.logs.tables.spreadsheet import read_book

            return read_book(path, budget)
        case Kind.HDF5 | Kind.NPZ | Kind.TDMS | Kind.AFM:
            from palpate.logs.tables.arrays import read_arrays

            return read_arrays(path, kind.name, kind.value, budget)
        case Kind.PARQUET:
            from palpate.logs.tables.parquet import read_parquet

            return read_parquet(path, budget)
        case _:
            from palpate.logs.tables.text import read_text_sheet

            return read_text_sheet(path, budget, delimiter)


ENDINGS = {
    ".csv", ".tsv", ".txt", ".tab", ".dat", ".ddf", ".lvm", ".jsonl", ".xlsx", ".parquet", ".mat", ".h5", ".hdf5",
    ".npz", ".tdms", ".bag", *_AFM, *STORAGES,
}  # fmt: skip
"""File endings that count as logs in a folder."""


def log_of(path: Path) -> Path:
    """The record in the folder of a run or a press; of another path, the path itself."""
    record = path / RECORD
    companions = ("summary.json", "press.json")  # of a run or a simulated press; of a press over a wire
    return record if record.is_file() and any((path / name).is_file() for name in companions) else path


def is_folder_of_logs(path: Path) -> bool:
    """True if a path is a folder, and not itself one log, as a ROS 2 bag or the folder of a run is."""
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
    from palpate.logs.tables.spreadsheet import equal_sheets

    logs: list[Path] = []
    for path in paths:
        book = path.is_file() and kind_of(path) is Kind.SHEETS
        logs.extend((equal_sheets(path, limits, names) if book else []) or [path])
    return tuple(logs)


def gather_logs(paths: Sequence[Path]) -> tuple[Path, ...]:
    """The logs that paths name: a file as it is, a folder by its files, in the order of their names and numbers.

    Raises:
        InputError: a folder holds none, or a log is named twice: pooled, it would count twice.
    """
    logs: list[Path] = []
    for path in paths:
        logs.extend(_of_folder(path) if is_folder_of_logs(path) else [log_of(path)])
    resolved: dict[Path, Path] = {}
    for path in logs:
        if path.resolve() in resolved:
            raise InputError(f"{path} is named twice; a log counts once, leave one out")
        resolved[path.resolve()] = path
    return tuple(logs)


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
    logs: Sequence[Path], names: Sequence[str], missing: Sequence[str] = (), delimiter: str | None = None
) -> dict[str, Array]:
    """The mean of a column of each log, by the column's name, each of shape (logs,).

    Args:
        logs: paths.
        names: of the columns.
        missing: values that mean "no reading".
        delimiter: between two cells of a log; found when None.

    Raises:
        InputError: a log has no such column, or the column has no reading.
    """
    means = np.array([[_mean(log, name, missing, delimiter) for name in names] for log in logs], np.float64)
    return dict(zip(names, means.reshape(len(logs), len(names)).T, strict=True))


def _mean(log: Path, name: str, missing: Sequence[str], delimiter: str | None) -> float:
    kind = kind_of(log)
    if kind.is_bag:
        raise InputError(f"{log} is a bag, which has no column {name}; leave --covariate {name} out")
    sheet = open_table(log, kind, delimiter)
    (column,) = sheet.numbers([sheet.resolve(name)], missing)
    if not np.isfinite(column).any():
        raise InputError(f"{log}: column {name!r} has no reading; leave --covariate {name} out")
    return float(np.nanmean(column))
