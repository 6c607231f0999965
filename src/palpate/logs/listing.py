"""What a log holds: topics, variables or columns, and how each is named on the command line."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.errors import InputError
from palpate.logs.arm_logs import is_pose, is_wrench
from palpate.logs.bags import Bag
from palpate.logs.bags.fields import leaves
from palpate.logs.columns import Columns
from palpate.logs.from_table import open_table
from palpate.logs.kinds import kind_of
from palpate.units import unit, unit_in_name

_SHOWN = 6


@dataclass(frozen=True)
class Entry:
    """One topic, variable or column.

    Args:
        name: as the file has it.
        kind: the type of a topic's messages; number, date or text of a column.
        count: of messages, or of rows that hold something.
        rate: a second [1/s]; None where it is not known.
        first, last: time of the first and the last [s], on the log's own clock; None likewise.
        about: how to name it in `palpate identify`, or what its values are.
    """

    name: str
    kind: str
    count: int
    rate: float | None
    first: float | None
    last: float | None
    about: str

    def to_json(self) -> dict[str, Any]:
        """As plain values."""
        return asdict(self)


def entries_of(path: str | Path, delimiter: str | None = None) -> tuple[list[Entry], list[str]]:
    """What a log holds, and what is wrong with it.

    Args:
        path: of the log.
        delimiter: of a CSV file; found when None.

    Raises:
        InputError: the file is missing, or is none that can be read.
    """
    path = Path(path)
    kind = kind_of(path)
    if not kind.is_bag:
        return _of_table(open_table(path, kind, delimiter)), []
    with Bag(path, kind) as bag:
        times = bag.times()
        return [_of_topic(bag, name, times.get(name)) for name in bag.topics], bag.troubles


def _of_topic(bag: Bag, name: str, times: tuple[float, float] | None) -> Entry:
    topic = bag.topics[name]
    first, last = times if times else (None, None)
    rate = (
        (topic.count - 1) / (last - first)
        if first is not None and last is not None and last > first
        else None
    )
    return Entry(name, topic.kind, topic.count, rate, first, last, _use(bag, name))


def _use(bag: Bag, name: str) -> str:
    """How a topic is named on the command line, by its type."""
    topic = bag.topics[name]
    if not topic.known:
        return "unknown type: the bag does not define it"
    if is_wrench(topic.kind):
        return f"--wrench {name}"
    if is_pose(topic.kind):
        return f"--pose {name}"
    if not topic.count:
        return ""
    fields = [path for path, _ in leaves(bag.first(name))]
    more = ", ..." if len(fields) > _SHOWN else ""
    return f"{name}.FIELD: {', '.join(fields[:_SHOWN])}{more}" if fields else "no numbers"


def _of_table(table: Columns) -> list[Entry]:
    columns = [_column(table, place) for place in range(len(table.names))]
    clock = next((i for i, own in enumerate(columns) if own is not None and _counts_time(own)), None)
    time = None if clock is None else columns[clock]
    symbol = None if clock is None else unit_in_name(table.names[clock], "time")
    if time is not None and symbol:
        time *= unit(symbol).factor
    return [_of_column(table, i, own, time, is_time=i == clock) for i, own in enumerate(columns)]


def _column(table: Columns, place: int) -> NDArray[np.float64] | None:
    """The numbers of a column; None if it holds something else."""
    try:
        return table.numbers([place], ["nan"])[0]
    except InputError:
        return None


def _counts_time(column: NDArray[np.float64]) -> bool:
    """Whether a column goes on and on in even steps, as a time does."""
    step = np.diff(column)
    return len(step) > 2 and bool((step > 0).all() and np.median(step) > 0.5 * np.mean(step))


def _of_column(
    table: Columns,
    place: int,
    column: NDArray[np.float64] | None,
    time: NDArray[np.float64] | None,
    *,
    is_time: bool,
) -> Entry:
    name = table.names[place]
    if column is None:
        return Entry(name, "text", 0, None, None, None, "not numbers")
    there = np.isfinite(column)
    count = int(there.sum())
    kind = "date" if name in table.clocks else "number"
    about = f"{column[there].min():.6g} to {column[there].max():.6g}" if count else "no reading"
    about += f" {table.units[name]}" if table.units.get(name, "1") != "1" else ""
    if time is None or count < 2 or len(time) != len(column):
        return Entry(name, kind, count, None, None, None, about)
    own = time[there]
    rate = (count - 1) / float(own[-1] - own[0])
    return Entry(
        name, kind, count, rate, float(own[0]), float(own[-1]), f"{about}{' (time?)' if is_time else ''}"
    )
