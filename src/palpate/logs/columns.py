"""Statistics of a column before its role is known."""

import re
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from palpate.arrays import Array
from palpate.logs.tables.sheet import find_sentinel
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
_BLOCKS = 16
"""Blocks of a log over which a coherence is averaged, half overlapping: two columns of noise have about one over their
number."""

_HALF = 0.5**0.5
"""Correlation with the rate of a position above which that rate accounts for more than half of a column's power."""


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
    def unit_readings(self) -> Array:
        """The readings about their mean, of unit length, shape (n,); NaN where one is missing or all are equal."""
        return _of_unit_length(self.readings)

    @cached_property
    def unit_rate(self) -> Array:
        """Likewise of the readings' rate, from row to row."""
        return _of_unit_length(np.gradient(self.unit_readings))

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


def _of_unit_length(values: Array) -> Array:
    if not (np.isfinite(values).all() and np.ptp(values) > 0):
        return np.full(len(values), np.nan)
    away = values - values.mean()
    return away / float(np.linalg.norm(away))


def rank_correlation(first: ColumnStatistics, second: ColumnStatistics) -> float:
    """How closely the ranks of two columns agree, from 0 to 1."""
    from scipy.stats import spearmanr

    a, b = first.readings, second.readings
    there = np.isfinite(a) & np.isfinite(b)
    rows = np.flatnonzero(there)[:: max(1, int(there.sum()) // 5000)]
    if len(rows) < 4 or np.ptp(a[rows]) == 0 or np.ptp(b[rows]) == 0:
        return 0.0
    return abs(float(spearmanr(a[rows], b[rows]).statistic))


def explained_power(position: ColumnStatistics, force: ColumnStatistics) -> float:
    """Share of the force's power that a filter or a curve of the position accounts for, 0 to 1.

    In taps most rows are noise in free motion: the means by place (correlation ratio) tell more than any filter.
    """
    a, b = position.readings, force.readings
    there = np.isfinite(a) & np.isfinite(b)
    if there.sum() < 16 or np.ptp(a[there]) == 0 or np.ptp(b[there]) == 0:
        return 0.0
    force_there = b[there] - b[there].mean()
    place = np.floor(_BLOCKS * (a[there] - a[there].min()) / np.ptp(a[there])).astype(np.intp)
    sums, count = np.bincount(place, force_there), np.bincount(place)
    by_place = np.sum(sums**2 / np.maximum(count, 1)) / (force_there @ force_there)
    return max(filtered_power(position, force), float(by_place))


def filtered_power(position: ColumnStatistics, force: ColumnStatistics) -> float:
    """Share of the force's power that a filter of the position accounts for, by their coherence (Welch), 0 to 1.

    At a resonance the force is a quarter of a period ahead, and beyond it on the other side: its ranks follow nothing.
    """
    from scipy.signal import coherence, welch

    a, b = position.readings, force.readings
    there = np.isfinite(a) & np.isfinite(b)
    rows = max(int(there.sum()) // _BLOCKS, 4)
    if there.sum() < 4 * rows or np.ptp(a[there]) == 0 or np.ptp(b[there]) == 0:
        return 0.0
    power = welch(b[there], nperseg=rows)[1]
    return float(coherence(a[there], b[there], nperseg=rows)[1] @ power / power.sum())


def is_one_reading(position: ColumnStatistics, force: ColumnStatistics) -> bool:
    """Whether two columns are one reading in two units, as a sensor beside its own volts: exactly a line.

    A position and a force by their units are none, as a simulated spring is a line too.
    """
    if position.score("position", "length") > 1 and force.score("force", "force") > 1:
        return False
    a, b = position.readings, force.readings
    there = np.flatnonzero(np.isfinite(a) & np.isfinite(b))[:100_000]
    slope, offset = np.polyfit(a[there], b[there], 1)
    apart = np.abs(b[there] - slope * a[there] - offset)
    return bool(np.max(apart) <= force.resolution + abs(slope) * position.resolution)


def is_rate(column: ColumnStatistics, position: ColumnStatistics) -> bool:
    """Whether a column is the velocity of a position: it follows the rate, and that more closely than the position."""
    if len(column.values) != len(position.values):
        return False
    own = column.unit_readings
    return float(own @ position.unit_rate) > max(_HALF, abs(float(own @ position.unit_readings)))


def roughness(column: ColumnStatistics) -> float:
    """The typical bend from row to row, as a share of the span."""
    values = column.values[np.isfinite(column.values)]
    return (
        float(np.mean(np.abs(np.diff(values, 2)))) / column.span
        if column.span > 0 and len(values) > 2
        else np.inf
    )
