"""A record in Python: its columns in a line each, drawn over time, and as a page."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from palpate.arrays import Array
from palpate.errors import InputError
from palpate.records import Record
from palpate.report.chart import Chart, Series, figure_of, panels
from palpate.report.page import PageAnswer, Table, answer_page, as_html, as_text
from palpate.report.style import with_peaks
from palpate.text import printable

if TYPE_CHECKING:
    from matplotlib.figure import Figure

HEAD = ("column", "unit", "least", "mean", "largest", "missing")
_TIMES = ("time", "t")
_DRAWN = 12
"""Columns of a figure; more are not legible."""
_POINTS = 4000
"""Points of a line, about: what is more is drawn by its extremes."""


def line(record: Record) -> str:
    """How many columns and rows, which time, from where."""
    count, clock = len(record), _clock(record)
    columns = (
        f"{len(record.columns)} column{'s' * (len(record.columns) != 1)} of {count} row{'s' * (count != 1)}"
    )
    source = record.meta.get("source")
    named = f", from {source}" if isinstance(source, str) else ""
    span = f", {record[clock][0]:.4g} to {record[clock][-1]:.4g} s" if clock is not None and count > 1 else ""
    return printable(f"{columns}{span}{named}")


def text(record: Record) -> str:
    """A line on the whole, and one a column."""
    return as_text(f"Record: {line(record)}", [HEAD, *rows(record)])


def html(record: Record) -> str:
    """The same as a table."""
    return as_html(f"Record: {line(record)}", [HEAD, *rows(record)])


def rows(record: Record) -> list[tuple[str, ...]]:
    """Name, unit, extremes and mean of each column, and how many of its values are missing."""
    return [
        (printable(name), printable(record.units[name]), *_numbers(np.asarray(column)))
        for name, column in record.columns.items()
    ]


def _numbers(column: Array) -> tuple[str, ...]:
    finite = column[np.isfinite(column)]
    figures = (finite.min(), finite.mean(), finite.max()) if len(finite) else ()
    told = [f"{float(number):.5g}" for number in figures] or ["-"] * 3
    return (*told, str(len(column) - len(finite)))


def _clock(record: Record) -> str | None:
    return next((name for name in _TIMES if name in record.columns), None)


def draw(record: Record) -> Figure:
    """Each column over time, or over its rows where there is no time.

    Raises:
        InputError: there is nothing to draw.
    """
    charts = charts_of(record)
    if not charts:
        raise InputError("this record has no numeric column besides its time; there is nothing to draw")
    return figure_of(charts)


def charts_of(record: Record) -> list[Chart]:
    """A chart a column, of the first twelve that have numbers."""
    clock = _clock(record)
    names = [name for name in record.columns if name != clock and np.isfinite(record[name]).any()][:_DRAWN]
    time = record[clock] if clock else np.arange(len(record), dtype=float)
    return [
        Chart(
            f"{name} [{record.units[name]}]", [Series(*with_peaks(time, record[name], _POINTS), "s0", width=0.9)],
            x="time [s]" if clock else "row", height=1.6,
        )
        for name in names
    ]  # fmt: skip


def page(record: Record) -> str:
    """The table and the figure as a page."""
    charts = charts_of(record)
    first = f"Its first {_DRAWN} columns" if len(record.columns) > _DRAWN else "Its columns"
    answer = PageAnswer(
        title="A record",
        sentence=line(record),
        tables=[Table("Columns", HEAD, rows(record))],
        figures=[{"panels": panels(charts), "caption": f"{first} over time."}] if charts else (),
    )
    return answer_page(answer, room="record", command="palpate.read_log(...).report(...)")
