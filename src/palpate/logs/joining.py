"""Two files of columns, joined by their times; two branches of a press side by side, joined one after the other."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from palpate.arrays import Array, Counts
from palpate.errors import InputError
from palpate.logs.columns import ColumnStatistics, read_columns
from palpate.logs.proposal import clock_of, side_by_side, time_factor
from palpate.logs.tables.sheet import Cells, Sheet, Stated


@dataclass(frozen=True)
class _Timed:
    """A file of columns with its own time.

    Args:
        sheet: the file.
        columns: of it, without that of the time.
        clock: that of the time.
        time: of each row [s], shape (n,).
        rows: at which there is a time, in its order, shape (n,).
    """

    sheet: Sheet
    columns: list[ColumnStatistics]
    clock: ColumnStatistics
    time: Array
    rows: Counts


def join_sheets(first: Sheet, second: Sheet) -> Sheet:
    """The columns of two files over their common time, in the rows of the file that has more of them.

    A reading of the other file stands in the nearest row, interpolated to that row's time, so that it counts once; the
    rows between hold none. A name that both have is that of the first; `FILE.NAME` is that of the second.

    Raises:
        InputError: a file has no column of the time, or the times do not overlap.
    """
    pair = (_timed(first), _timed(second))
    begin = max(float(log.time[0]) for log in pair)
    end = min(float(log.time[-1]) for log in pair)
    if not begin < end:
        spans = " and ".join(
            f"{log.time[0]:.10g} to {log.time[-1]:.10g} s ({log.sheet.path})" for log in pair
        )
        raise InputError(f"the times of the two logs do not overlap: {spans}; give logs of one clock")
    inside = [log.time[(log.time >= begin) & (log.time <= end)] for log in pair]
    time = max(inside, key=len)
    names = [pair[0].clock.name]
    arrays = [time / time_factor(pair[0].clock)]
    stated: dict[str, Stated] = {}
    if pair[0].clock.name in first.stated and not pair[0].clock.clock:
        stated[names[0]] = first.stated[names[0]]
    for log in pair:
        for column in log.columns:
            name = f"{log.sheet.path.stem}.{column.name}" if column.name in names else column.name
            names.append(name)
            arrays.append(_at(time, log, column.values))
            if column.unit:
                where = log.sheet.stated[column.name].where
                stated[name] = Stated(column.unit, where)

    def read(places: Sequence[int], _: Sequence[str]) -> tuple[list[Cells], list[dict[str, Any]]]:
        return [Cells(arrays[i].copy(), clock=i == 0 and pair[0].clock.clock) for i in places], []

    spring = first.spring or second.spring
    return Sheet(first.path, names, read, stated=stated, spring=spring)


def _timed(sheet: Sheet) -> _Timed:
    columns, _ = read_columns(sheet)
    length = max((len(column.values) for column in columns), default=0)
    rows = [column for column in columns if len(column.values) == length]
    clock = clock_of(sheet, rows)
    if clock is None:
        raise InputError(f"{sheet.path} has no column of the time, by which two logs are joined; add one")
    with_time = np.flatnonzero(np.isfinite(clock.values))
    time = clock.values[with_time] * time_factor(clock)
    fresh = np.flatnonzero(np.diff(time, prepend=-np.inf) > 0)
    others = [column for column in rows if column is not clock]
    return _Timed(sheet, others, clock, time[fresh], with_time[fresh])


def _at(time: Array, log: _Timed, column: Array) -> Array:
    """A column in the rows of a time; NaN in rows between its readings."""
    values = column[log.rows]
    finite = np.isfinite(values)
    at = np.full(len(time), np.nan)
    if not finite.any():
        return at
    instants = log.time[finite]
    near = np.clip(np.searchsorted(time, instants), 1, len(time) - 1)
    near -= (instants - time[near - 1]) < (time[near] - instants)
    near = np.unique(near[(instants >= time[0]) & (instants <= time[-1])])
    at[near] = np.interp(time[near], instants, values[finite])
    return at


BRANCHES = (
    ("extend", "retract"), ("extension", "retraction"), ("approach", "retract"), ("approach", "withdraw"),
    ("loading", "unloading"), ("load", "unload"), ("trace", "retrace"), ("advance", "retract"), ("ex", "rt"),
)  # fmt: skip
"""Words by which the names of the two branches of a press differ."""


def join_branches(sheet: Sheet) -> Sheet:
    """A table with further columns for both branches of a press, if its columns are those of two branches.

    The second branch follows the first. It is turned round if it ends where the first one does, and its time goes on
    where the first ends. The columns have the names of the branches without the words by which these differ.
    """
    columns = [
        ColumnStatistics(i, name, np.empty(0), sheet.stated.get(name, Stated(None)).unit, False)
        for i, name in enumerate(sheet.names)
    ]
    groups = side_by_side(columns)
    labels = next((pair for pair in BRANCHES if set(pair) == set(groups)), None)
    if labels is None or sheet.tables:
        return sheet
    pairs = {}
    for first, second in zip(groups[labels[0]], groups[labels[1]], strict=True):
        name = re.sub(
            rf"[\s_.\-]*{labels[0]}[\s_.\-]*", " ", first.name, count=1, flags=re.IGNORECASE
        ).strip()
        pairs[name if first is not second else f"{name} of both branches"] = first, second
    if not {*pairs}.isdisjoint(sheet.names):
        return sheet
    names = [*sheet.names, *pairs]
    joined = list(pairs.values())
    place = next(pair for pair in joined if pair[0].named.kind == "position")

    def read(places: Sequence[int], missing: Sequence[str]) -> tuple[list[Cells], list[dict[str, Any]]]:
        plain = [i for i in places if i < len(sheet.names)]
        further = [joined[i - len(sheet.names)] for i in places if i >= len(sheet.names)]
        needed = list(
            dict.fromkeys([*plain, *(column.place for pair in [*further, place] for column in pair)])
        )
        cells, notes = sheet.read(needed, missing)
        by_place = dict(zip(needed, cells, strict=True))
        shared = [by_place[column.place].numbers for column in place]
        ends = [
            int(np.flatnonzero(np.isfinite(values))[-1]) + 1 if np.isfinite(values).any() else 0
            for values in shared
        ]
        turned = all(ends) and _ends_alike(shared[0][: ends[0]], shared[1][: ends[1]])

        def join(pair: tuple[ColumnStatistics, ColumnStatistics]) -> Cells:
            first, second = (by_place[column.place] for column in pair)
            a, b = first.numbers[: ends[0]], second.numbers[: ends[1]]
            if pair[0].named.kind == "time":
                if len(a) > 1 and len(b) and not b[0] > a[-1]:
                    b = b - b[0] + a[-1] + np.nanmedian(np.diff(a))
            elif turned:
                b = b[::-1]
            return Cells(np.concatenate([a, b]), first.wrong or second.wrong, first.clock)

        return [
            by_place[i] if i < len(sheet.names) else join(joined[i - len(sheet.names)]) for i in places
        ], notes

    stated = {
        name: sheet.stated[pair[0].name] for name, pair in pairs.items() if pair[0].name in sheet.stated
    }
    counts = lambda index: sheet.counts(index) if index < len(sheet.names) else None  # noqa: E731
    return replace(sheet, names=names, read=read, counts=counts, stated=sheet.stated | stated)


def _ends_alike(first: Array, second: Array) -> bool:
    """True if the second branch ends, and does not begin, where the first one ends."""
    return bool(abs(second[-1] - first[-1]) < abs(second[0] - first[-1]))
