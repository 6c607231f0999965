"""Many logs as a page and in Python: their forest plot, a card for each parameter, a row for each log."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING, Any

from palpate.errors import InputError
from palpate.identification.pooling import Pooled, PooledParameter
from palpate.report import style
from palpate.report.identification.figure import LETTERS, WIDE
from palpate.report.identification.page import HALF, TONES, split
from palpate.report.identification.words import CALLED, Source, full_number, interval
from palpate.report.many import table
from palpate.report.page import Card, PageAnswer, answer_page, as_html, as_text, data_address, warning_alerts
from palpate.report.style import svg
from palpate.text import printable
from palpate.units import NONE, quantity

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


COLOURS = {table.POINT: style.K, "K": style.K, "B": style.B, "M": style.M}
_ROW, _BESIDE = 0.31, 1.25
"""Height of a log's row, and of what is above and below all of them [in]."""
_LONGEST = 26
"""Letters of a log's name that stand beside its row."""
_TICKS = 5
"""Numbers under a panel at most: more run into each other where it is narrow."""


def write_figure(rows: Sequence[table.LogRow], pooled: Pooled, path: Path, dpi: int | None = None) -> Path:
    """Draw the forest plots and write them, whole or not at all."""
    figure = draw_logs(rows, pooled)
    return style.save(figure, path, dpi)


def draw_logs(rows: Sequence[table.LogRow], pooled: Pooled) -> Figure:
    """The sentence, and a forest plot of each quantity that is pooled, two beside each other."""
    names = table.quantities_with_number(rows, pooled) or [table.POINT]
    high = height(rows) * -(-len(names) // 2)
    with style.ink():
        figure = style.empty(WIDE, high + 1.0)
        parts: Any = figure.subfigures(2, 1, height_ratios=(1.0, high))
        head, body = parts
        text = fill(f"{table.sentence(rows, pooled)} {table.failures(rows)}".strip(), 125)
        head.text(0.01, 0.95, text, fontsize=13, va="top", parse_math=False)
        grid = body.subplots(-(-len(names) // 2), 2, squeeze=False).ravel()
        for axis in grid[len(names) :]:
            axis.set_axis_off()
        for axis, name in zip(grid, names, strict=False):
            forest(axis, rows, name, table.quantities(pooled).get(name))
    return figure


def one(rows: Sequence[table.LogRow], pooled: Pooled, name: str, width: int) -> Figure:
    """One forest plot, so many pixels wide on a page."""
    with style.ink(LETTERS):
        figure = style.empty(width / 72, height(rows))
        forest(figure.subplots(), rows, name, table.quantities(pooled).get(name))
    return figure


def height(rows: Sequence[table.LogRow]) -> float:
    """Of a forest plot [in]."""
    return _ROW * (len(rows) + 1) + _BESIDE


def forest(axis: Axes, rows: Sequence[table.LogRow], name: str, pooled: PooledParameter | None) -> None:
    """A row a log, the first at the top; what is pooled at the bottom."""
    unit = pooled.parameter.unit if pooled else "1"
    colour = COLOURS.get(name, style.F)
    called = "stiffness at the working point" if name == table.POINT else f"{name}, {CALLED.get(name, name)}"
    style.panel(axis, called if unit == "1" else f"{called} [{unit}]")
    axis.grid(visible=False, axis="y")
    axis.locator_params(axis="x", nbins=_TICKS)
    for i, row in enumerate(rows):
        p, y = row.value_of(name), len(rows) - i
        if p is None or p.value is None or p.ci95 is None:
            axis.text(
                0.01, y, "no number", transform=axis.get_yaxis_transform(), va="center", color=style.QUIET
            )
            continue
        used = pooled is not None and i in pooled.logs
        axis.plot(p.ci95, (y, y), color=colour, lw=2.2, alpha=1 if used else 0.35, solid_capstyle="butt")
        axis.plot([p.value], [y], "o", ms=6, color=colour, mfc=colour if used else "none")
    _together(axis, pooled)
    axis.set_ylim(-0.7, len(rows) + 0.7)
    axis.set_yticks(range(len(rows) + 1), ["pooled", *(_short(row) for row in reversed(rows))])
    for label in axis.get_yticklabels():
        label.set_parse_math(False)


def _together(axis: Axes, pooled: PooledParameter | None) -> None:
    """The mean as a diamond over its interval; the next press between brackets."""
    if pooled is None or pooled.parameter.value is None or pooled.parameter.ci95 is None:
        axis.text(0.01, 0, "no number", transform=axis.get_yaxis_transform(), va="center", color=style.QUIET)
        return
    low, high = pooled.parameter.ci95
    axis.axvspan(low, high, color=style.INK, alpha=0.07, lw=0)
    axis.fill(
        [low, pooled.parameter.value, high, pooled.parameter.value], [0, 0.28, 0, -0.28], color=style.INK
    )
    if pooled.prediction95:
        axis.plot(pooled.prediction95, (0, 0), color=style.INK, lw=1.1)
        axis.plot(pooled.prediction95, (0, 0), ls="", marker="|", ms=12, color=style.INK)


def _short(row: table.LogRow) -> str:
    name = printable(row.source.title)
    return name if len(name) <= _LONGEST else f"{name[: _LONGEST - 9]}…{name[-8:]}"


_COLOURED = {table.POINT: "K", "K": "K", "B": "B", "M": "M"}


def page_of_logs(rows: Sequence[table.LogRow], pooled: Pooled) -> str:
    """The page as HTML."""
    source = rows[0].source if rows else Source("")
    point = pooled.working_point
    options = ", ".join(f"{name} {value}" for name, value in source.options.items())
    digests = [(row.source.title, row.source.sha256 or NONE) for row in rows]
    logs = replace(table.tables(rows, pooled, places=True)[0], title="Log by log")
    answer = PageAnswer(
        title=f"{len(rows)} logs",
        sentence=table.sentence(rows, pooled),
        about=". ".join(
            filter(None, [f"Working points {table.place(rows, point)}" if point else "", options])
        ),
        alerts=warning_alerts(table.faults(rows)),
        cards={"Together": [_card(name, own, pooled) for name, own in table.quantities(pooled).items()]},
        tables=[logs],
        pairs=[_figure(rows, pooled, name) for name in table.quantities_with_number(rows, pooled)],
        folds=[("sha256 of each log", "", digests)],
        source=("The same as JSON", json.dumps(table.json_of(rows, pooled), indent=1)),
    )
    made = {"made": source.made} if source.made else {}
    return answer_page(answer, room="identify", command=source.command, **made)


def _card(name: str, own: PooledParameter, pooled: Pooled) -> Card:
    p, number = own.parameter, split(own.parameter)
    after = interval(own.prediction95, p.unit)
    between = "" if own.between is None else f"between logs {quantity(own.between, p.unit, digits=2)}"
    slopes = [f"by {covariate}: {interval(p.ci95, p.unit)}" for covariate, p in own.slopes.items()]
    facts = [
        f"next press {after}" if after else "",
        between,
        f"{len(own.logs)} of {pooled.count} logs",
        *slopes,
    ]
    return Card(
        "Stiffness at the working point" if name == table.POINT else ", ".join(filter(None, [name, CALLED.get(name)])),
        number["text"] if p.value is not None else "", number["unit"], number["half"],
        printable("; ".join(filter(None, [*facts, p.reason]))),
        TONES[p.verdict], str(p.verdict), _COLOURED.get(name, ""),
    )  # fmt: skip


def _figure(rows: Sequence[table.LogRow], pooled: Pooled, name: str) -> dict[str, str]:
    title = "Stiffness at the working point" if name == table.POINT else f"{name}, {CALLED.get(name, name)}"
    own = table.quantities(pooled)[name].parameter
    words = (
        f"Pooled: {full_number(own)}. Each log's value with its 95 % interval; the diamond is the mean of all with its"
        " own, the brackets hold where the next press falls. Pale: not pooled."
    )
    drawn = svg(one(rows, pooled, name, HALF))
    return {"source": data_address(drawn, "image/svg+xml"), "caption": f"{title}. {words}"}


def line(pooled: Pooled) -> str:
    """Each quantity with its verdict."""
    values = [f"{row[0]} {row[1]} {row[-1]}" for row in table.together(pooled).rows]
    return printable(f"{pooled.count} logs; {', '.join(values) or 'nothing in common'}")


def text(pooled: Pooled) -> str:
    """The output of `palpate identify` for many logs."""
    rows = _rows(pooled)
    shown = [as_text(part.title, [part.head, *part.rows]) for part in table.tables(rows, pooled)]
    return printable("\n".join([table.sentence(rows, pooled), *shown, *table.notes(rows, pooled)]))


def html(pooled: Pooled) -> str:
    """The sentence, and a row a quantity."""
    rows, total = _rows(pooled), table.together(pooled)
    return as_html(table.sentence(rows, pooled), [total.head, *total.rows], table.notes(rows, pooled))


def draw(pooled: Pooled) -> Figure:
    """The forest plots of `palpate identify --figure`.

    Raises:
        InputError: no log gives anything a number.
    """
    rows = _rows(pooled)
    if not table.quantities_with_number(rows, pooled):
        raise InputError("none of these logs gives a number; there is nothing to draw")
    return draw_logs(rows, pooled)


def page(pooled: Pooled) -> str:
    """The page of `palpate identify --report`."""
    return page_of_logs(_rows(pooled), pooled)


def _rows(pooled: Pooled) -> list[table.LogRow]:
    """A row a log, by its name, or by its place."""
    names = pooled.names or [f"log {i + 1}" for i in range(pooled.count)]
    options = next((dict(found.options) for found in pooled.logs if found is not None), {})
    made = "palpate.identification.pool(...).report(...)"
    return [
        table.LogRow(Source(name, options, command=made), found, "" if found else "it was not identified")
        for name, found in zip(names, pooled.logs, strict=True)
    ]
