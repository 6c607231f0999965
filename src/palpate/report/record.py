"""A record in Python: a line for each column, and a chart over time."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from palpate.arrays import Array
from palpate.errors import InputError
from palpate.records import Record
from palpate.report.chart import Chart, Series, build_figure, panels
from palpate.report.page import Answer, Table, answer_page
from palpate.report.style import with_peaks
from palpate.text import printable

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_TIMES = ("time", "t")
_MAX_COLUMNS = 12
"""Columns of a figure; more are not legible."""
_POINTS = 4000
"""Points of a line, about; longer columns are drawn by their extremes."""


def line(record: Record) -> str:
    """Number of columns and rows, range of the time, source."""
    count, clock = len(record), _clock(record)
    columns = (
        f"{len(record.columns)} column{'s' * (len(record.columns) != 1)} of {count} row{'s' * (count != 1)}"
    )
    source = record.meta.get("source")
    named = f", from {source}" if isinstance(source, str) else ""
    span = f", {record[clock][0]:.4g} to {record[clock][-1]:.4g} s" if clock is not None and count > 1 else ""
    return printable(f"{columns}{span}{named}")


def build_answer(record: Record) -> Answer:
    """Name, unit, extremes and mean of each column, and how many of its values are missing."""
    rows = [
        (printable(name), printable(record.units[name]), *_numbers(np.asarray(column)))
        for name, column in record.columns.items()
    ]
    head = ("column", "unit", "least", "mean", "largest", "missing")
    return Answer(title="Record", sentence=line(record), tables=[Table("", head, rows)])


def _numbers(column: Array) -> tuple[str, ...]:
    finite = column[np.isfinite(column)]
    figures = (finite.min(), finite.mean(), finite.max()) if len(finite) else ()
    texts = [f"{float(number):.5g}" for number in figures] or ["-"] * 3
    return (*texts, str(len(column) - len(finite)))


def _clock(record: Record) -> str | None:
    return next((name for name in _TIMES if name in record.columns), None)


def draw(record: Record) -> Figure:
    """Each column over time, or over its rows where there is no time.

    Raises:
        InputError: there is nothing to draw.
    """
    charts = build_charts(record)
    if not charts:
        raise InputError("this record has no numeric column besides its time; there is nothing to draw")
    return build_figure(charts)


def build_charts(record: Record) -> list[Chart]:
    """A chart for each of the first twelve columns that have numbers."""
    clock = _clock(record)
    names = [name for name in record.columns if name != clock and np.isfinite(record[name]).any()]
    time = record[clock] if clock else np.arange(len(record), dtype=float)
    return [
        Chart(
            f"{name} [{record.units[name]}]",
            [Series(*with_peaks(time, record[name], _POINTS), "s0", width=0.9)],
            x="time [s]" if clock else "row",
            height=1.6,
        )
        for name in names[:_MAX_COLUMNS]
    ]


def page(record: Record) -> str:
    """The table and the charts as a page."""
    charts = build_charts(record)
    figures = [{"panels": panels(charts), "caption": "Columns over time."}] if charts else []
    answer = replace(build_answer(record), figures=figures)
    return answer_page(answer, room="record", command="palpate.read_log(...).report(...)")
