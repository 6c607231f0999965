"""Many logs at once: files, and folders of files."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from palpate.errors import InputError
from palpate.files import RECORD
from palpate.files.limits import Limits
from palpate.logs.kinds import STORAGES, Kind, kind_of
from palpate.logs.tables import equal_sheets

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


def sheets_as_logs(paths: Sequence[Path], names: Sequence[str], limits: Limits) -> tuple[Path, ...]:
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
