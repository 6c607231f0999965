"""Many logs as a page, as a figure, and in Python: a forest plot, a row for each log and each pooled quantity."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING

from palpate.errors import InputError
from palpate.identification.pooling import Pooled, PooledParameter
from palpate.report import style
from palpate.report.identification.words import CALLED, Source
from palpate.report.many import table
from palpate.report.page import Answer, answer_page, data_address
from palpate.report.style import svg
from palpate.text import printable
from palpate.units import NONE

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


_COLOURS = {table.POINT: style.K, "K": style.K, "B": style.B, "M": style.M}
_ROW, _PANEL, _HEAD = 0.31, 1.0, 0.5
"""Height of a log's row, of a panel without rows, and of the sentence [in]."""
_MAX_NAME = 26
"""Letters of a log's name beside its row."""
_MAX_TICKS = 5
"""Numbers under a panel; more overlap where it is narrow."""
_CAPTION = (
    "Each log's value with its 95 % interval. The diamond is the mean of all logs with its interval, the line beside"
    " it the range of the next press. Pale: not pooled."
)


def write_figure(rows: Sequence[table.LogRow], pooled: Pooled, path: Path, dpi: int | None = None) -> Path:
    """Draw the forest plots and write them, whole or not at all."""
    return style.save(draw_logs(rows, pooled), path, dpi)


def draw_logs(rows: Sequence[table.LogRow], pooled: Pooled) -> Figure:
    """The sentence, and a forest plot of each pooled quantity, two beside each other."""
    names = table.quantities_with_number(rows, pooled) or [table.POINT]
    lines = -(-len(names) // 2)
    with style.ink():
        size = (13.0, _HEAD + lines * (_ROW * (len(rows) + 1) + _PANEL))
        figure, axes = style.grid(size, lines, min(len(names), 2))
        head = wrap(f"{table.sentence(rows, pooled)} {table.failures(rows)}".strip(), 150)
        figure.suptitle("\n".join(map(style.literal, head)), x=0.01, ha="left", fontsize=10.5)
        for axis, name in zip(axes, names, strict=False):
            _forest(axis, rows, name, table.quantities(pooled).get(name))
        for axis in axes[len(names) :]:
            axis.remove()
    return figure


def _forest(axis: Axes, rows: Sequence[table.LogRow], name: str, pooled: PooledParameter | None) -> None:
    """A row for each log, the first at the top, and the pooled value at the bottom."""
    unit = pooled.parameter.unit if pooled else "1"
    colour = _COLOURS.get(name, style.F)
    called = "stiffness at the working point" if name == table.POINT else f"{name}, {CALLED.get(name, name)}"
    axis.set_title(called if unit == "1" else f"{called} [{unit}]", loc="left", fontsize=10)
    axis.grid(visible=False, axis="y")
    axis.locator_params(axis="x", nbins=_MAX_TICKS)
    for i, row in enumerate(rows):
        p, y = row.parameter(name), len(rows) - i
        if p is None or p.value is None or p.ci95 is None:
            _no_number(axis, y)
            continue
        used = pooled is not None and i in pooled.logs
        axis.plot(p.ci95, (y, y), color=colour, lw=2.2, alpha=1 if used else 0.35, solid_capstyle="butt")
        axis.plot([p.value], [y], "o", ms=6, color=colour, mfc=colour if used else "none")
    _pooled_row(axis, pooled)
    axis.set_ylim(-0.7, len(rows) + 0.7)
    axis.set_yticks(range(len(rows) + 1), ["pooled", *(_short_name(row) for row in reversed(rows))])
    for label in axis.get_yticklabels():
        label.set_parse_math(False)


def _no_number(axis: Axes, y: float) -> None:
    axis.text(0.01, y, "no number", transform=axis.get_yaxis_transform(), va="center", color=style.QUIET)


def _pooled_row(axis: Axes, pooled: PooledParameter | None) -> None:
    """The mean as a diamond over its interval, and the interval of the next press as a line."""
    if pooled is None or pooled.parameter.value is None or pooled.parameter.ci95 is None:
        _no_number(axis, 0)
        return
    (low, high), mean = pooled.parameter.ci95, pooled.parameter.value
    axis.axvspan(low, high, color=style.INK, alpha=0.07, lw=0)
    axis.fill([low, mean, high, mean], [0, 0.28, 0, -0.28], color=style.INK)
    if pooled.prediction95:
        axis.plot(pooled.prediction95, (0, 0), color=style.INK, lw=1.1, marker="|", ms=12)


def _short_name(row: table.LogRow) -> str:
    name = printable(row.source.title)
    return name if len(name) <= _MAX_NAME else f"{name[: _MAX_NAME - 9]}…{name[-8:]}"


def page_of_logs(rows: Sequence[table.LogRow], pooled: Pooled) -> str:
    """The page as HTML."""
    source = rows[0].source if rows else Source("")
    logs, *others = table.tables(rows, pooled, places=True)
    picture = svg(draw_logs(rows, pooled))
    answer = Answer(
        title=f"{len(rows)} logs",
        sentence=table.sentence(rows, pooled),
        about=", ".join(f"{name} {value}" for name, value in source.options.items()),
        notes=table.notes(rows, pooled),
        tables=[replace(others[0], title="Together"), *others[1:], replace(logs, title="Log by log")],
        figures=[{"source": data_address(picture, "image/svg+xml"), "caption": _CAPTION}],
        folds=[("sha256 of each log", "", [(row.source.title, row.source.sha256 or NONE) for row in rows])],
        source=("The same as JSON", json.dumps(table.pooled_json(rows, pooled), indent=1)),
    )
    return answer_page(answer, room="identify", command=source.command, made=source.made)


def line(pooled: Pooled) -> str:
    """Each pooled quantity with its verdict."""
    values = [f"{row[0]} {row[1]} {row[-1]}" for row in table.together(pooled).rows]
    return f"{pooled.count} logs; {', '.join(values) or 'nothing in common'}"


def build_answer(pooled: Pooled) -> Answer:
    """The answer of `palpate identify` for many logs."""
    return table.build_answer(_rows(pooled), pooled)


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
    """A row for each log, by its name, or by its place."""
    names = pooled.names or [f"log {i + 1}" for i in range(pooled.count)]
    options = next((dict(result.options) for result in pooled.logs if result is not None), {})
    command = "palpate.identification.pool(...).report(...)"
    return [
        table.LogRow(
            Source(name, options, command=command), result, "" if result else "it was not identified"
        )
        for name, result in zip(names, pooled.logs, strict=True)
    ]
