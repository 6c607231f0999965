"""A panel as wide as the figure, in a figure of several columns."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def wide_panel(drawing: Figure, row: Sequence[Axes]) -> Axes:
    """One panel in place of a row of them."""
    place = row[0].get_subplotspec()
    assert place is not None
    at, grid = place.rowspan.start, place.get_gridspec()
    for axis in row:
        axis.remove()
    axis = drawing.add_subplot(grid[at, :])
    axis.grid(visible=True, color="#e6e6e6", linewidth=0.8)
    axis.set_axisbelow(True)
    axis.spines[["top", "right"]].set_visible(False)
    return axis
