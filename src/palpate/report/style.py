"""How figures look: one size, one palette, light grids."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from palpate.logs import whole

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

INK = "#222222"
BLUE, ORANGE, GREEN, RED, VIOLET, GREY = "#1f6fb4", "#e07b16", "#2a9254", "#c4342d", "#7b53a6", "#8a8a8a"
DPI = 110


def figure(
    rows: int = 1, *, height: float = 2.6, width: float = 9.0, **subplots: Any
) -> tuple[Figure, list[Axes]]:
    """A figure of so many panels above each other that share their x axis; each `height` inches high."""
    from matplotlib.figure import Figure

    drawing = Figure(figsize=(width, height * rows + 0.5), dpi=DPI, layout="constrained")
    axes = drawing.subplots(rows, 1, sharex=True, squeeze=False, **subplots)[:, 0]
    for axis in axes:
        plain(axis)
    return drawing, list(axes)


def plain(axis: Axes) -> None:
    """A light grid behind the data, and no frame above and to the right."""
    axis.grid(visible=True, color="#e6e6e6", linewidth=0.8)
    axis.set_axisbelow(True)
    axis.spines[["top", "right"]].set_visible(False)


def legend(axis: Axes, **options: Any) -> None:
    """The legend above the panel, out of the way of the data."""
    options = {"loc": "lower right", "bbox_to_anchor": (1.0, 1.0), "ncols": 6, "frameon": False, **options}
    axis.legend(fontsize=8.5, borderaxespad=0.2, **options)


def save(drawing: Figure, path: Path) -> Path:
    """Writes the figure as PNG, the file there whole or not at all."""
    with whole(path) as draft:
        drawing.savefig(draft, format="png")
    return path
