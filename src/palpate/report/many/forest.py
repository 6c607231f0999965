"""The forest plot: each log's value with its interval, the mean of all, and where the next falls."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING, Any

from palpate.identification.pooling import Pooled, PooledParameter
from palpate.report import style
from palpate.report.identification.words import CALLED
from palpate.report.many.table import POINT, LogRow, failures, quantities, quantities_with_number, sentence
from palpate.text import printable

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLOURS = {POINT: style.K, "K": style.K, "B": style.B, "M": style.M}
_ROW, _BESIDE = 0.31, 1.25
"""Height of a log's row, and of what is above and below all of them [in]."""
_LONGEST = 26
"""Letters of a log's name that stand beside its row."""
_LETTERS = 12
_WIDE = 13.0
_TICKS = 5
"""Numbers under a panel at most: more run into each other where it is narrow."""


def write_figure(rows: Sequence[LogRow], pooled: Pooled, path: Path, dpi: int | None = None) -> Path:
    """Draw the forest plots and write them, whole or not at all."""
    figure = draw(rows, pooled)
    return style.save(figure, path, dpi)


def draw(rows: Sequence[LogRow], pooled: Pooled) -> Figure:
    """The sentence, and a forest plot of each quantity that is pooled, two beside each other."""
    from matplotlib.figure import Figure

    names = quantities_with_number(rows, pooled) or [POINT]
    high = height(rows) * -(-len(names) // 2)
    with style.ink():
        figure = Figure(figsize=(_WIDE, high + 1.0), dpi=style.DPI, layout="constrained")
        parts: Any = figure.subfigures(2, 1, height_ratios=(1.0, high))
        head, body = parts
        text = fill(f"{sentence(rows, pooled)} {failures(rows)}".strip(), 125)
        head.text(0.01, 0.95, text, fontsize=13, va="top", parse_math=False)
        grid = body.subplots(-(-len(names) // 2), 2, squeeze=False).ravel()
        for axis in grid[len(names) :]:
            axis.set_axis_off()
        for axis, name in zip(grid, names, strict=False):
            forest(axis, rows, name, quantities(pooled).get(name))
    return figure


def one(rows: Sequence[LogRow], pooled: Pooled, name: str, width: int) -> Figure:
    """One forest plot, so many pixels wide on a page."""
    from matplotlib.figure import Figure

    with style.ink(_LETTERS):
        figure = Figure(figsize=(width / 72, height(rows)), dpi=style.DPI, layout="constrained")
        forest(figure.subplots(), rows, name, quantities(pooled).get(name))
    return figure


def height(rows: Sequence[LogRow]) -> float:
    """Of a forest plot [in]."""
    return _ROW * (len(rows) + 1) + _BESIDE


def forest(axis: Axes, rows: Sequence[LogRow], name: str, pooled: PooledParameter | None) -> None:
    """A row a log, the first at the top; what is pooled at the bottom."""
    unit = pooled.parameter.unit if pooled else "1"
    colour = COLOURS.get(name, style.F)
    called = "stiffness at the working point" if name == POINT else f"{name}, {CALLED.get(name, name)}"
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


def _short(row: LogRow) -> str:
    name = printable(row.source.title)
    return name if len(name) <= _LONGEST else f"{name[: _LONGEST - 9]}…{name[-8:]}"
