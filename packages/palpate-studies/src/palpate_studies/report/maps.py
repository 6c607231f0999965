"""The maps of a study: a metric over two parameters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from palpate.arrays import Array, Mask
from palpate.report import style
from palpate.report.look.assets import MAPS, OUTCOMES
from palpate_studies.report.lines import Scale, decades, grid

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

HALO = MAPS["map-halo"]


@dataclass(frozen=True)
class BoundaryLine:
    """A line over a map.

    Args:
        label: what it is.
        x, y: its points, in the places of the map's scales.
    """

    label: str
    x: Sequence[float]
    y: Sequence[float]


@dataclass(frozen=True)
class Heat:
    """A map over two parameters.

    Args:
        title: of the panel.
        x, y: its axes.
        values: shape (y, x), NaN where there is none; or words.
        failed: shape (y, x), where most runs did not come to their end.
        bounds: lines over it.
    """

    title: str
    x: Scale
    y: Scale
    values: Array | NDArray[np.str_]
    failed: Mask
    bounds: Sequence[BoundaryLine] = ()


def heat_figure(panels: Sequence[Heat], label: str) -> Figure:
    """Maps side by side with one scale of colours."""
    drawing, axes = grid(len(panels), 4.3, 3.5)
    words = panels[0].values.dtype.kind in "US"
    norm = None if words else _norm([np.asarray(p.values, float) for p in panels])
    mesh = None
    for panel, axis in zip(panels, axes, strict=True):
        if words:
            _words(panel, axis)
        else:
            mesh = _heat(panel, axis, norm)
        _crosses(panel, axis)
        _bounds(panel, axis)
        panel.x.dress(axis.xaxis, axis)
        panel.y.dress(axis.yaxis, axis)
        axis.set_title(panel.title, loc="left", fontsize=9.5)
    if words:
        _key(drawing, panels)
    elif mesh is not None:
        drawing.colorbar(mesh, ax=axes, label=label, shrink=0.9)
    return drawing


def _norm(values: Sequence[Array]) -> Any:
    from matplotlib.colors import LogNorm, Normalize

    every = np.concatenate([v[np.isfinite(v)] for v in values])
    if not len(every):
        return Normalize(0.0, 1.0)
    low, high = float(every.min()), float(every.max())
    if decades(every):
        return LogNorm(low, high)
    return Normalize(low, high if high > low else low + 1.0)


def _heat(panel: Heat, axis: Axes, norm: Any) -> Any:
    axis.set_facecolor(style.CARD)
    return axis.pcolormesh(panel.x.edges(), panel.y.edges(), panel.values, norm=norm, cmap="viridis_r")


def _words(panel: Heat, axis: Axes) -> None:
    from matplotlib.colors import to_rgb

    colors = np.array([[to_rgb(OUTCOMES.get(str(word), HALO)) for word in row] for row in panel.values])
    axis.pcolormesh(panel.x.edges(), panel.y.edges(), colors)


def _crosses(panel: Heat, axis: Axes) -> None:
    """Where most runs did not come to their end."""
    y, x = np.nonzero(panel.failed)
    size = max(2.0, min(5.0, 90.0 / max(panel.values.shape)))
    for color, width in ((HALO, 2.2), (style.INK, 0.9)):  # seen on dark and on light
        axis.plot(
            panel.x.places[x], panel.y.places[y], "x", color=color, markersize=size, markeredgewidth=width
        )


def _bounds(panel: Heat, axis: Axes) -> None:
    limits = panel.x.edges()[[0, -1]], panel.y.edges()[[0, -1]]
    for i, one in enumerate(panel.bounds):
        label = one.label if i == 0 else None
        axis.plot(one.x, one.y, color=HALO, linewidth=3.4)
        axis.plot(one.x, one.y, color=style.FAIL, linewidth=1.8, label=label)
    axis.set(xlim=limits[0], ylim=limits[1])
    if panel.bounds:
        axis.legend(fontsize=8, loc="upper left", frameon=True, framealpha=0.85, edgecolor="none")


def _key(drawing: Figure, panels: Sequence[Heat]) -> None:
    from matplotlib.patches import Patch

    there = {str(word) for panel in panels for word in panel.values.flat}
    patches = [Patch(color=color, label=word) for word, color in OUTCOMES.items() if word in there]
    drawing.legend(
        handles=patches, loc="outside upper right", ncols=len(patches), fontsize=8.5, frameon=False
    )
