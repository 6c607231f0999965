"""Statistics of a column before its role is known, and the value in it that stands for "no reading"."""

import re
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from palpate.arrays import Array, Mask
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
_BLOCKS = 16
"""Blocks of a log over which a coherence is averaged, half overlapping: two columns of noise have about one over their
number."""
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

    At a resonance the force is a quarter of a period ahead, and beyond it on the other side: its ranks follow nothing,
    and its coherence (Welch) tells. In taps most rows are noise in free motion: the means by place (correlation ratio)
    tell.
    """
    from scipy.signal import coherence, welch

    a, b = position.readings, force.readings
    there = np.isfinite(a) & np.isfinite(b)
    rows = max(int(there.sum()) // _BLOCKS, 4)
    if there.sum() < 4 * rows or np.ptp(a[there]) == 0 or np.ptp(b[there]) == 0:
        return 0.0
    power = welch(b[there], nperseg=rows)[1]
    by_filter = coherence(a[there], b[there], nperseg=rows)[1] @ power / power.sum()
    place = np.floor(_BLOCKS * (a[there] - a[there].min()) / np.ptp(a[there])).astype(np.intp)
    count = np.maximum(np.bincount(place), 1)
    by_place = count @ (np.bincount(place, b[there] - b[there].mean()) / count) ** 2 / b[there].var() / count.sum()
    return float(max(by_filter, by_place))


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


def roughness(column: ColumnStatistics) -> float:
    """The typical bend from row to row, as a share of the span."""
    values = column.values[np.isfinite(column.values)]
    return (
        float(np.mean(np.abs(np.diff(values, 2)))) / column.span
        if column.span > 0 and len(values) > 2
        else np.inf
    )
