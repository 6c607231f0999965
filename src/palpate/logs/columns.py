"""Statistics of a column before its role is known, and the value in it that stands for "no reading"."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from palpate.arrays import Array, Mask
from palpate.errors import InputError
from palpate.files import RECORD
from palpate.files.limits import ReadingLimits
from palpate.logs.kinds import STORAGES, Kind, kind_of
from palpate.logs.tables import equal_sheets
from palpate.units import known_unit, unit, unit_in_name

NAMES = {
    "time": r"^t$|time|stamp|zeit|temps|tiempo|tout|^x_value|^sec|clock",
    "position": (
        r"pos|disp|dist|depth|indent|height|travel|stroke|exten|length|weg|hub|path|probe|tip|lvdt"
        r"|^[xyz]$|^x_|_[xyz]$"
    ),
    "force": r"forc|^f$|^f[nxyz]$|[_.]f[nxyz]?$|^f_|load|kraft|fuerza|weight|scale|effort|torque|newton|press",
}
"""Usual names of columns in laboratories."""
_USUAL = (-1.0, -9.0, -99.0, -999.0, -9999.0, -32768.0, 999.0, 9999.0, 65535.0, 99999.0, -3.697314e28)
"""Values that drivers return for "no reading", as a scale's -1 between two readings. NDI's trackers write the last for
a marker that they do not see."""
_LEAST_SHARE = 0.002
"""Of the rows: a reading that is right by accident is rarer, one in the number of steps of its converter."""
_APART = 0.5
"""Least distance of such a value from the readings beside it, in the column's unit: half of the step between whole
numbers, which these values are."""


@dataclass(frozen=True)
class ColumnStatistics:
    """Properties of a column before its role is known.

    Args:
        place: from 0.
        name: as the file has it.
        values: in its own unit, shape (n,); NaN where there is none.
        unit: that the file states.
        clock: it holds dates and times.
    """

    place: int
    name: str
    values: Array
    unit: str | None
    clock: bool

    @cached_property
    def readings(self) -> Array:
        """The values, shape (n,); NaN too where a number stands for no reading."""
        mark = find_sentinel(self.values)
        return self.values if mark is None else np.where(self.values == mark, np.nan, self.values)

    @cached_property
    def step(self) -> float:
        """From value to value, the typical one."""
        step = np.diff(self.values)
        return float(np.median(step)) if len(step) and np.isfinite(step).any() else 0.0

    @cached_property
    def is_time(self) -> bool:
        """Whether it grows in even steps, as a time does."""
        step = np.diff(self.values)
        return len(step) > 2 and bool((step > 0).all() and np.median(step) > 0.5 * np.mean(step))

    @cached_property
    def counts_rows(self) -> bool:
        """Whether it counts 0, 1, 2, ... or 1, 2, 3, ..."""
        return len(self.values) > 2 and self.values[0] in {0, 1} and bool((np.diff(self.values) == 1).all())

    @property
    def named_time(self) -> bool:
        """Whether its name, its unit or its kind is that of a time."""
        return self.clock or self.score("time", "time") > 0

    @cached_property
    def changes(self) -> bool:
        """Whether it holds more than two different numbers."""
        return self.counts > 1

    @cached_property
    def counts(self) -> float:
        """Its range in steps of its own resolution."""
        there = self.values[np.isfinite(self.values)][:100_000]
        return float(np.ptp(there) / self.resolution) if self.resolution else 0.0

    @cached_property
    def resolution(self) -> float:
        """The smallest difference of two of its numbers; 0 where it holds one only."""
        steps = np.diff(np.unique(self.values[np.isfinite(self.values)][:100_000]))
        return float(steps.min()) if len(steps) else 0.0

    @cached_property
    def span(self) -> float:
        """From its least to its largest, without a rare outlier on either side."""
        low, high = np.nanpercentile(self.values, [1, 99])
        return float(high - low)

    def score(self, role: str, quantity: str) -> int:
        """Evidence for a role: its unit, then its name."""
        symbol = self.unit or unit_in_name(self.name, quantity)
        fits = symbol is not None and known_unit(symbol) and unit(symbol).quantity == quantity
        contradicts = bool(self.unit) and not fits and self.unit != "1"
        return 2 * fits + bool(re.search(NAMES[role], self.name, re.I)) - 3 * contradicts


def find_sentinel(values: Array) -> float | None:
    """The value in a column, shape (n,), that plainly means "no reading"; None where there is none.

    It must be one of those that drivers use, occur again and again, lie on one side of all other
    values, and be left and returned to in jumps: a force of -1 on its way from 0 to -2 is a force.
    """
    for value in _USUAL:
        here = values == value
        share = float(np.mean(here))
        if not max(_LEAST_SHARE, 2 / len(values)) <= share < 1 - 2 / len(values):
            continue
        others = values[~here & np.isfinite(values)]
        if len(others) > 1 and _outside(value, others) and _jumps(values, here, value):
            return value
    return None


def _outside(value: float, others: Array) -> bool:
    """Whether the value lies where no reading does; a small negative one needs readings that are never negative."""
    low, high = float(others.min()), float(others.max())
    if value < 0:
        return low >= 0 if value > -10 else value < low - (high - low)
    return value > high + (high - low)


def _jumps(values: Array, here: Mask, value: float) -> bool:
    """Whether the typical reading beside this value is far from it, measured by how far readings step otherwise."""
    beside = values[1:][here[:-1] & ~here[1:]]
    if not len(beside):
        return False
    steps = np.abs(np.diff(values[~here]))
    return float(np.median(np.abs(beside - value))) > _APART + 3 * float(np.median(steps))


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
