"""The curves of a study, with their spread over the seeds."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.arrays import Array
from palpate.report import style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLORS = style.SERIES
WIDE = 40.0
"""Ratio of the largest to the smallest value from which they are drawn by the logarithm."""
ACROSS = 3
"""Panels side by side at most."""


@dataclass(frozen=True)
class Scale:
    """One axis of a figure.

    Args:
        label: with its unit.
        values: numbers, or texts.
        log: numbers are drawn over their logarithm.
    """

    label: str
    values: Sequence[Any]
    log: bool = False

    @property
    def numeric(self) -> bool:
        """Whether the values are numbers, and have their places."""
        return all(isinstance(v, int | float) and not isinstance(v, bool) for v in self.values)

    @property
    def places(self) -> Array:
        """Where the values stand on the axis."""
        return np.asarray(self.values, float) if self.numeric else np.arange(len(self.values), dtype=float)

    def edges(self) -> Array:
        """Of the cells around the values: halfway between neighbours."""
        at = np.log(self.places) if self.log else self.places
        if len(at) == 1:
            half = 0.5 if not self.log else 0.1
            edges = np.array([at[0] - half, at[0] + half])
        else:
            middle = (at[1:] + at[:-1]) / 2.0
            edges = np.concatenate([[2 * at[0] - middle[0]], middle, [2 * at[-1] - middle[-1]]])
        return np.exp(edges) if self.log else edges

    def dress(self, which: Any, axis: Axes) -> None:
        """Ticks and label of `axis.xaxis` or `axis.yaxis`."""
        which.set_label_text(self.label)
        if not self.numeric:
            which.set_ticks(self.places, [style.literal(str(v)).replace(", ", "\n") for v in self.values])
        elif self.log:
            (axis.set_xscale if which is axis.xaxis else axis.set_yscale)("log")
            if min(which.get_view_interval()) <= 0.0:  # there is nothing to be drawn over it
                which.set_view_interval(*self.edges()[[0, -1]], ignore=True)
            self._ticks(which)
        elif 2 < len(self.values) <= 8:
            which.set_ticks(self.places, [f"{v:g}" for v in self.values])

    def _ticks(self, which: Any) -> None:
        """Powers of ten; over less than two decades some between them, but no more than have room."""
        from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

        which.set_minor_formatter(NullFormatter())
        span = self.places.max() / self.places.min()
        if span < 100.0:
            which.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if span < 15.0 else (1.0, 3.0)))
            which.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))


def grid(count: int, width: float, height: float) -> tuple[Figure, list[Axes]]:
    """So many panels of this size [inches]."""
    from matplotlib.figure import Figure

    columns = min(count, ACROSS)
    rows = math.ceil(count / columns)
    drawing = Figure(figsize=(width * columns + 0.6, height * rows), dpi=style.DPI, layout="constrained")
    axes = list(drawing.subplots(rows, columns, squeeze=False).flat)
    for spare in axes[count:]:
        spare.remove()
    return drawing, axes[:count]


def limit_axis(axis: Axes, values: Array) -> None:
    """Where a metric is drawn: its bulk, so that the few from far away leave room for it; how many is said."""
    good = values[np.isfinite(values)]
    if not len(good):
        return
    if decades(good):
        axis.set_yscale("log")
        return
    low, high = bulk(good)
    axis.set_ylim(low, high)
    beyond = int(((good < low) | (good > high)).sum())
    if beyond:
        axis.annotate(
            f"{beyond} beyond", (1.0, 1.0), xycoords="axes fraction", ha="right", va="bottom", fontsize=8
        )


def bulk(values: Array) -> tuple[float, float]:
    """A range that holds the middle 98 % of finite values, or all where they lie not far beyond."""
    low, high = np.quantile(values, (0.01, 0.99))
    room = (high - low) or abs(high) or 1.0
    least, most = values.min(), values.max()
    low = least if least >= low - 0.5 * room else low
    high = most if most <= high + 0.5 * room else high
    return float(low - 0.05 * room), float(high + 0.05 * room)


def decades(values: Array) -> bool:
    """Whether values are better drawn by the logarithm."""
    good = values[np.isfinite(values)]
    return bool(len(good) and good.min() > 0.0 and good.max() > WIDE * good.min())


@dataclass(frozen=True)
class MetricLine:
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
class LinePanel:
    """A panel of lines."""

    title: str
    x: Scale
    lines: Sequence[MetricLine]
    log: bool = False


def curves_figure(panels: Sequence[LinePanel], label: str) -> Figure:
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


def _bars(line: MetricLine, axis: Axes, color: str, aside: float) -> None:
    """A line over what has no order: its points, each with its range, beside those of other lines."""
    ranges = np.array([line.middle - line.low, line.high - line.middle])
    axis.errorbar(line.x + aside, line.middle, ranges, fmt="o", color=color, markersize=4, label=line.label)


EIGHTHS = 8
"""Parts of a cloud over which the middle is drawn."""


@dataclass(frozen=True)
class Points:
    """Runs of one kind.

    Args:
        label: which.
        x: the parameter.
        y: the metric.
    """

    label: str
    x: Array
    y: Array


@dataclass(frozen=True)
class Cloud:
    """A panel of points: a metric over a parameter that was drawn.

    Args:
        x: the parameter's axis, from its least to its largest value.
        kinds: the points.
        words: what the metric's whole numbers mean; empty where it is a quantity.
    """

    x: Scale
    kinds: Sequence[Points]
    words: Sequence[str] = ()


def clouds_figure(panels: Sequence[Cloud], label: str) -> Figure:
    """Points over each parameter, and their middle over each eighth of them."""
    drawing, axes = grid(len(panels), 3.9, 3.0)
    for panel, axis in zip(panels, axes, strict=True):
        style.plain(axis)
        every = np.concatenate([one.y for one in panel.kinds]) if panel.kinds else np.zeros(0)
        for i, one in enumerate(panel.kinds):
            _cloud(one, axis, COLORS[i % len(COLORS)], 0.12 * (i + 1) if panel.words else 0.0, panel.words)
        panel.x.dress(axis.xaxis, axis)
        if panel.words:
            axis.set_yticks(range(len(panel.words)), panel.words)
        else:
            limit_axis(axis, every)
        axis.set_ylabel(label)
        if len(panel.kinds) > 1:
            axis.legend(fontsize=8, frameon=True, framealpha=0.85, edgecolor="none")
    return drawing


def _cloud(points: Points, axis: Axes, color: str, aside: float, words: Sequence[str]) -> None:
    """Points and their middles; those of words, which would lie on each other, are moved apart."""
    apart = aside * np.linspace(-1.0, 1.0, len(points.y)) if aside else 0.0
    axis.scatter(points.x, points.y + apart, color=color, s=9, alpha=0.35, linewidths=0)
    middle = middles(points, words)
    axis.plot(middle[:, 0], middle[:, 1], color=color, linewidth=1.8, label=points.label)


def middles(points: Points, words: Sequence[str] = ()) -> Array:
    """Of each eighth of a cloud the middle of the parameter and of the metric, shape (8, 2) or fewer rows.

    The middle of a quantity is its median, which a few from far away do not move; of words it is the mean.
    """
    middle = np.mean if words else np.median
    parts = np.array_split(np.argsort(points.x, kind="stable"), min(EIGHTHS, len(points.x)))
    return np.array([(np.median(points.x[part]), middle(points.y[part])) for part in parts])
