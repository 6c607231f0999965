"""The curves of a study, with their spread over the seeds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from palpate.arrays import Array
from palpate.report import style
from palpate.report.study.axes import COLORS, Scale, grid

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Line:
    """A metric over a parameter.

    Args:
        label: which setting.
        x: places on the axis.
        middle, low, high: median and range over the seeds; NaN where there is none.
        reference: it is what the study is compared with.
    """

    label: str
    x: Array
    middle: Array
    low: Array
    high: Array
    reference: bool = False


@dataclass(frozen=True)
class Curve:
    """A panel of lines."""

    title: str
    x: Scale
    lines: Sequence[Line]
    log: bool = False


def curves_figure(panels: Sequence[Curve], label: str) -> Figure:
    """Lines with bands from the least to the largest of the seeds."""
    drawing, axes = grid(len(panels), 5.4 if len(panels) == 1 else 4.3, 3.4)
    for panel, axis in zip(panels, axes, strict=True):
        style.plain(axis)
        for i, one in enumerate(line for line in panel.lines if not line.reference):
            color = COLORS[i % len(COLORS)]
            if panel.x.numeric:
                axis.fill_between(one.x, one.low, one.high, color=color, alpha=0.18, linewidth=0)
                axis.plot(
                    one.x, one.middle, "o-", color=color, markersize=3.5, linewidth=1.4, label=one.label
                )
            else:
                _bars(one, axis, color, 0.12 * (i - (len(panel.lines) - 1) / 2))
        for i, one in enumerate(line for line in panel.lines if line.reference):
            dashes = ("--", ":", "-.")[i % 3]
            axis.fill_between(one.x, one.low, one.high, color=style.INK, alpha=0.1, linewidth=0)
            axis.plot(one.x, one.middle, dashes, color=style.INK, linewidth=1.4, label=one.label)
        panel.x.dress(axis.xaxis, axis)
        if panel.log:
            axis.set_yscale("log")
        axis.set_ylabel(label)
        axis.set_title(panel.title, loc="left", fontsize=9.5)
        if len(panel.lines) > 1:
            axis.legend(fontsize=8, frameon=True, framealpha=0.85, edgecolor="none")
    return drawing


def _bars(line: Line, axis: Axes, color: str, aside: float) -> None:
    """A line over what has no order: its points, each with its range, beside those of other lines."""
    ranges = np.array([line.middle - line.low, line.high - line.middle])
    axis.errorbar(line.x + aside, line.middle, ranges, fmt="o", color=color, markersize=4, label=line.label)
