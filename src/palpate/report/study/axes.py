"""The axes and the panels of a study's figures."""

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


def bounded(axis: Axes, values: Array) -> None:
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
