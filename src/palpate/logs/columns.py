"""Statistics of a column before its role is known."""

import re
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from palpate.arrays import Array
from palpate.errors import InputError
from palpate.logs.naming import ColumnName, read_name
from palpate.logs.tables.sheet import Sheet, Stated, find_sentinel
from palpate.signals.samples import coherent_share, ranks
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
_MAX_REPEATED_STAMPS = 20
"""Rows that may share a stamp on average: drivers that poll their sensor repeat three or four."""
_MIN_TIMED = 0.2
"""Smallest fraction of rows with a time, up to its last: of tests side by side, the shorter ones end in empty cells."""
_BLOCKS = 16
"""Blocks of a log over which a coherence is averaged, half overlapping: two columns of noise have about one over their
number."""

MIN_MOVING_FRACTION = 0.1
"""Fraction of the largest speed below which a motion has no direction: a sine is below it in 6 % of its time."""
_MIN_RATE_CORRELATION = 0.5**0.5
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
        """The readings' differences from row to row, likewise of unit length."""
        return _of_unit_length(np.gradient(self.unit_readings))

    @cached_property
    def named(self) -> ColumnName:
        """Quantity, axis and device by the name and the stated unit."""
        reading = read_name(self.name, self.unit or "")
        return replace(reading, kind="time") if self.clock else reading

    @cached_property
    def finite(self) -> Array:
        """The numbers of the column, without rows that hold none."""
        return self.values[np.isfinite(self.values)]

    @cached_property
    def step(self) -> float:
        """Typical difference from row to row, likewise where stamps repeat."""
        step = np.diff(self.finite)
        middle = float(np.median(step)) if len(step) else 0.0
        return middle or (float(np.mean(step)) if len(step) else 0.0)

    @cached_property
    def is_time(self) -> bool:
        """True if the column grows as a time does: in even steps, or, if it is called a time, never falling.

        A driver that reads faster than its clock repeats stamps; one that counts whole seconds repeats most of them.
        """
        step = np.diff(self.finite)
        filled = np.flatnonzero(np.isfinite(self.values))
        if len(step) < 3 or len(filled) < _MIN_TIMED * filled[-1]:
            return False
        forward = int(np.count_nonzero(step > 0))
        if self.named.kind == "time":
            return bool((step >= 0).all()) and forward * _MAX_REPEATED_STAMPS >= len(step)
        return bool((step > 0).all() and np.median(step) > 0.5 * np.mean(step))

    @cached_property
    def counts_rows(self) -> bool:
        """True if the column counts 0, 1, 2, ... or 1, 2, 3, ..."""
        return len(self.values) > 2 and self.values[0] in {0, 1} and bool((np.diff(self.values) == 1).all())

    @property
    def named_time(self) -> bool:
        """True if the column's name, unit or kind is that of a time."""
        return self.clock or self.score("time", "time") > 0

    @cached_property
    def changes(self) -> bool:
        """True if the column holds more than two different numbers."""
        return self.counts > 1

    @cached_property
    def counts(self) -> float:
        """The column's range in steps of its resolution."""
        finite = self.values[np.isfinite(self.values)][:100_000]
        return float(np.ptp(finite) / self.resolution) if self.resolution else 0.0

    @cached_property
    def resolution(self) -> float:
        """The smallest difference of two of its numbers; 0 where it holds one only."""
        steps = np.diff(np.unique(self.values[np.isfinite(self.values)][:100_000]))
        return float(steps.min()) if len(steps) else 0.0

    @cached_property
    def span(self) -> float:
        """Range from the 1st to the 99th percentile."""
        low, high = np.nanpercentile(self.values, [1, 99])
        return float(high - low)

    def score(self, role: str, quantity: str) -> int:
        """Evidence for a role: its unit, then its name; 0 where name or unit say another quantity."""
        if self.named.kind != role:
            return 0
        symbol = self.unit or unit_in_name(self.name, quantity)
        fits = symbol is not None and known_unit(symbol) and unit(symbol).quantity == quantity
        worded = bool(re.search(NAMES[role], self.name, re.IGNORECASE))
        return 2 * fits + (1 if worded or not fits else 0)

    def may_be(self, role: str) -> bool:
        """True if neither name nor unit say another quantity than a role's."""
        return self.named.kind in {None, role}


def _of_unit_length(values: Array) -> Array:
    if not (np.isfinite(values).all() and np.ptp(values) > 0):
        return np.full(len(values), np.nan)
    centred, _ = _scaled(values)
    return centred / float(np.linalg.norm(centred))


def rank_correlation(first: ColumnStatistics, second: ColumnStatistics) -> float:
    """Rank correlation of two columns (Spearman), without its sign, 0 to 1."""
    a = first.readings
    b = second.readings
    finite = np.isfinite(a) & np.isfinite(b)
    rows = np.flatnonzero(finite)[:: max(1, int(finite.sum()) // 5000)]
    if len(rows) < 4 or np.ptp(a[rows]) == 0 or np.ptp(b[rows]) == 0:
        return 0.0
    return abs(float(np.corrcoef(ranks(a[rows]), ranks(b[rows]))[0, 1]))


def explained_power(position: ColumnStatistics, force: ColumnStatistics) -> float:
    """Share of the force's power that a filter or a curve of the position accounts for, 0 to 1.

    In taps most rows are noise in free motion: the means by place (correlation ratio) tell more than any filter.
    """
    a = position.readings
    b = force.readings
    finite = np.isfinite(a) & np.isfinite(b)
    if finite.sum() < 16 or np.ptp(a[finite]) == 0 or np.ptp(b[finite]) == 0:
        return 0.0
    positions = _scale_to_one(a[finite])
    forces = _scale_to_one(b[finite])
    forces -= forces.mean()
    block = np.floor(_BLOCKS * (positions - positions.min()) / np.ptp(positions)).astype(np.intp)
    sums = np.bincount(block, forces)
    count = np.bincount(block)
    by_place = np.sum(sums**2 / np.maximum(count, 1)) / (forces @ forces)
    return max(filtered_power(position, force), float(by_place))


def _scale_to_one(values: Array) -> Array:
    """Values over the power of two above the largest magnitude: the same digits, and no square or range overflows."""
    return np.ldexp(values, -np.frexp(np.abs(values).max())[1])


def filtered_power(position: ColumnStatistics, force: ColumnStatistics) -> float:
    """Share of the force's power that a filter of the position accounts for, by their coherence (Welch), 0 to 1.

    At a resonance the force is a quarter of a period ahead, and beyond it on the other side: its ranks follow nothing.
    """
    a = position.readings
    b = force.readings
    finite = np.isfinite(a) & np.isfinite(b)
    rows = max(int(finite.sum()) // _BLOCKS, 4)
    if finite.sum() < 4 * rows or np.ptp(a[finite]) == 0 or np.ptp(b[finite]) == 0:
        return 0.0
    return coherent_share(a[finite], b[finite], rows)


def is_one_reading(position: ColumnStatistics, force: ColumnStatistics) -> bool:
    """True if two columns are one reading in two units, as a sensor beside its own volts: exactly a line.

    A position and a force by their units are none, as a simulated spring is a line too.
    """
    if position.score("position", "length") > 1 and force.score("force", "force") > 1:
        return False
    a = position.readings
    b = force.readings
    finite = np.flatnonzero(np.isfinite(a) & np.isfinite(b))[:100_000]
    (position_readings, position_size), (load, load_size) = (_scaled(column[finite]) for column in (a, b))
    if not (position_size > 0 and load_size > 0):  # one of them is constant
        return False
    slope = float(position_readings @ load) / float(position_readings @ position_readings)
    apart = np.abs(load - slope * position_readings)
    return bool(
        np.max(apart) <= force.resolution / load_size + abs(slope) * (position.resolution / position_size)
    )


def _scaled(values: Array) -> tuple[Array, float]:
    """Values about their mean, over the power of two below the largest, and that power, 0 where all are equal.

    The squares of the result neither overflow nor underflow, and a power of two changes no digit.
    """
    centred = values - values.mean()
    largest = float(np.max(np.abs(centred), initial=0.0))
    if not largest > 0.0:
        return centred, 0.0
    size = float(np.ldexp(1.0, np.frexp(largest)[1] - 1))
    return centred / size, size


def is_rate(column: ColumnStatistics, position: ColumnStatistics) -> bool:
    """True if a column is the velocity of a position: it follows the rate, and that more closely than the position."""
    if len(column.values) != len(position.values):
        return False
    readings = column.unit_readings
    return float(readings @ position.unit_rate) > max(
        _MIN_RATE_CORRELATION, abs(float(readings @ position.unit_readings))
    )


def moves_as(first: ColumnStatistics, second: ColumnStatistics) -> bool:
    """True if two speeds are one by more than half of their power, as those of coupled axes."""
    return abs(float(first.unit_readings @ second.unit_readings)) > _MIN_RATE_CORRELATION


def direction_correlation(motion: ColumnStatistics, load: ColumnStatistics, *, speed: bool) -> float:
    """Correlation of a load with the direction of a motion, without its sign, 0 to 1.

    Args:
        motion: a speed, or a position whose differences over a few rows are one.
        load: a force or a torque.
        speed: the motion is a speed.
    """
    a, b = motion.readings, load.readings
    finite = np.isfinite(a) & np.isfinite(b)
    a, b = a[finite], b[finite]
    if not speed and len(a) > 4:
        moves = int(np.count_nonzero(np.diff(a)))
        rows = min(max(2 * len(a) // max(moves, 1), len(a) // 500, 2), len(a) // 4)
        a, b = a[2 * rows :] - a[: -2 * rows], b[rows:-rows]
    moves = np.abs(a) > MIN_MOVING_FRACTION * np.max(np.abs(a), initial=0.0)
    signs, loads = np.sign(a[moves]), b[moves]
    if len(loads) < 16 or np.ptp(signs) == 0 or np.ptp(loads) == 0:
        return 0.0
    return abs(float(_of_unit_length(signs) @ _of_unit_length(loads)))


def roughness(column: ColumnStatistics) -> float:
    """The typical bend from row to row, as a share of the span."""
    values = column.values[np.isfinite(column.values)]
    return (
        float(np.mean(np.abs(np.diff(values, 2)))) / column.span
        if column.span > 0 and len(values) > 2
        else np.inf
    )


def read_columns(table: Sheet) -> tuple[list[ColumnStatistics], list[str]]:
    """Every column's values and unit; and why there are no values, where they cannot be read."""
    places = list(range(len(table.names)))
    unread = []
    try:
        columns = table.glance(places)
    except InputError as error:
        columns = [np.empty(0) for _ in places]
        unread = [str(error)]
    statistics = []
    for index, values in zip(places, columns, strict=True):
        name = table.names[index]
        stated = table.stated.get(name, Stated(None))
        scaled = (values + stated.offset) * stated.scale
        statistics.append(ColumnStatistics(index, name, scaled, stated.unit, name in table.clocks))
    return statistics, unread
