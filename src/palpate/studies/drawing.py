"""The panels of a study's figures: curves and maps."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from palpate.arrays import Array, Mask
from palpate.report import style
from palpate.report.look.assets import OUTCOMES, PAIRS

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLORS = style.SERIES
HALO = PAIRS["paper"][0]
"""Rim that keeps a mark legible on any field."""
LOG_RATIO = 40.0
"""Ratio of the largest to the smallest value from which a logarithmic axis is used."""
MAX_COLUMNS = 3
"""Panels side by side."""
LEGEND: dict[str, Any] = {"fontsize": 8, "frameon": True, "framealpha": 0.85, "edgecolor": "none"}


@dataclass(frozen=True)
class Scale:
    """One axis of a figure.

    Args:
        label: with its unit.
        values: numbers, or texts.
        log: True if numbers are drawn over their logarithm.
    """

    label: str
    values: Sequence[Any]
    log: bool = False

    @property
    def numeric(self) -> bool:
        """True if the values are numbers."""
        return all(isinstance(v, int | float) and not isinstance(v, bool) for v in self.values)

    @property
    def places(self) -> Array:
        """Places of the values on the axis."""
        return np.asarray(self.values, float) if self.numeric else np.arange(len(self.values), dtype=float)

    def edges(self) -> Array:
        """Edges of the cells around the values: halfway between neighbours."""
        at = np.log(self.places) if self.log else self.places
        if len(at) == 1:
            half = 0.1 if self.log else 0.5
            edges = np.array([at[0] - half, at[0] + half])
        else:
            middle = (at[1:] + at[:-1]) / 2.0
            edges = np.concatenate([[2 * at[0] - middle[0]], middle, [2 * at[-1] - middle[-1]]])
        return np.exp(edges) if self.log else edges

    def dress(self, axis: Axes, which: str) -> None:
        """Limits, ticks and label along `x` or `y`."""
        axis.set(**{f"{which}label": self.label, f"{which}lim": tuple(self.edges()[[0, -1]])})
        if not self.numeric:
            names = [style.literal(str(value)).replace(", ", "\n") for value in self.values]
            (axis.set_xticks if which == "x" else axis.set_yticks)(self.places, names)
        elif self.log:
            style.logarithmic(axis, which)


def is_wide(values: Array) -> bool:
    """True if the values are better drawn over their logarithm."""
    good = values[np.isfinite(values)]
    return bool(len(good) and good.min() > 0.0 and good.max() > LOG_RATIO * good.min())


def _panels(count: int, width: float, height: float) -> tuple[Figure, list[Axes]]:
    """A figure of so many panels of this size [inches]."""
    columns = min(count, MAX_COLUMNS)
    rows = math.ceil(count / columns)
    figure, axes = style.grid((width * columns + 0.6, height * rows), rows, columns)
    for spare in axes[count:]:
        spare.remove()
    return figure, axes[:count]


@dataclass(frozen=True)
class MetricLine:
    """A metric over a parameter.

    Args:
        label: of the setting.
        x: places on the axis.
        middle, low, high: median and range there; NaN where there is none.
    """

    label: str
    x: Array
    middle: Array
    low: Array
    high: Array


@dataclass(frozen=True)
class LinePanel:
    """A panel of lines over one parameter."""

    title: str
    x: Scale
    lines: Sequence[MetricLine]


def curves_figure(panels: Sequence[LinePanel], label: str, words: Sequence[str] = ()) -> Figure:
    """Lines of medians, with bars over the range; `words` are the meanings of a metric's whole numbers."""
    figure, axes = _panels(len(panels), 5.4 if len(panels) == 1 else 4.3, 3.4)
    for panel, axis in zip(panels, axes, strict=True):
        style.plain(axis)
        for i, line in enumerate(panel.lines):
            ranges = np.array([line.middle - line.low, line.high - line.middle])
            look: dict[str, Any] = {"color": COLORS[i % len(COLORS)], "markersize": 3.5, "linewidth": 1.4}
            mark = "o-" if panel.x.numeric else "o"
            axis.errorbar(line.x, line.middle, ranges, fmt=mark, label=line.label, **look)
        panel.x.dress(axis, "x")
        if words:
            axis.set_yticks(range(len(words)), words)
        elif is_wide(np.concatenate([line.middle for line in panel.lines] or [np.zeros(0)])):
            axis.set_yscale("log")
        axis.set_ylabel(label)
        axis.set_title(panel.title, loc="left", fontsize=9.5)
        if len(panel.lines) > 1:
            axis.legend(**LEGEND)
    return figure


@dataclass(frozen=True)
class Heat:
    """A map over two parameters.

    Args:
        title: of the panel.
        x, y: its axes.
        values: shape (y, x), NaN where there is none; or words.
        failed: shape (y, x), True where most runs were not completed.
    """

    title: str
    x: Scale
    y: Scale
    values: Array | NDArray[np.str_]
    failed: Mask


def heat_figure(panels: Sequence[Heat], label: str) -> Figure:
    """Maps side by side with one scale of colours."""
    figure, axes = _panels(len(panels), 4.3, 3.5)
    words = panels[0].values.dtype.kind in "US"
    norm = None if words else _norm(np.concatenate([np.ravel(panel.values) for panel in panels]))
    mesh: Any = None
    for panel, axis in zip(panels, axes, strict=True):
        axis.set_facecolor(style.CARD)
        if words:
            axis.pcolormesh(panel.x.edges(), panel.y.edges(), _word_colors(panel.values))
        else:
            mesh = axis.pcolormesh(
                panel.x.edges(), panel.y.edges(), panel.values, norm=norm, cmap="viridis_r"
            )
        _draw_crosses(panel, axis)
        panel.x.dress(axis, "x")
        panel.y.dress(axis, "y")
        axis.set_title(panel.title, loc="left", fontsize=9.5)
    if words:
        _draw_key(figure, panels)
    else:
        figure.colorbar(mesh, ax=axes, label=label, shrink=0.9)
    return figure


def _norm(values: Array) -> Any:
    from matplotlib.colors import LogNorm, Normalize

    good = values[np.isfinite(values)]
    if not len(good):
        return Normalize(0.0, 1.0)
    low, high = float(good.min()), float(good.max())
    if is_wide(good):
        return LogNorm(low, high)
    return Normalize(low, high if high > low else low + 1.0)


def _word_colors(words: NDArray[Any]) -> Array:
    from matplotlib.colors import to_rgb

    return np.array([[to_rgb(OUTCOMES.get(str(word), HALO)) for word in row] for row in words])


def _draw_crosses(panel: Heat, axis: Axes) -> None:
    """Draw a cross on each cell of which most runs were not completed."""
    y, x = np.nonzero(panel.failed)
    size = max(2.0, min(5.0, 90.0 / max(panel.values.shape)))
    for color, width in ((HALO, 2.2), (style.INK, 0.9)):
        look: dict[str, Any] = {"color": color, "markersize": size, "markeredgewidth": width}
        axis.plot(panel.x.places[x], panel.y.places[y], "x", **look)


def _draw_key(figure: Figure, panels: Sequence[Heat]) -> None:
    from matplotlib.patches import Patch

    words = {str(word) for panel in panels for word in panel.values.flat}
    patches = [Patch(color=color, label=word) for word, color in OUTCOMES.items() if word in words]
    figure.legend(handles=patches, loc="outside upper right", ncols=len(patches), fontsize=8.5, frameon=False)
