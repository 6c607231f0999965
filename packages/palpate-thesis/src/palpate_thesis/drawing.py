"""One look for all figures: sizes, colours and frames, and the panels that figures are made of."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.records import Record
from palpate.report import style

if TYPE_CHECKING:
    from matplotlib import axes, figure

    Axes = axes.Axes
    Figure = figure.Figure
else:  # for annotations alone: matplotlib is imported when a figure is drawn
    Axes = Figure = Any

LIMIT_LINE: dict[str, Any] = {"color": style.INK, "linewidth": 1, "linestyle": "--"}
STATED: dict[str, Any] = {"color": style.FAIL, "linewidth": 0.9, "linestyle": ":"}
ZERO: dict[str, Any] = {"color": style.MEASURED, "linewidth": 0.9}
"""Lines across a panel: where a claim ceases to hold, what the thesis states, and zero."""
LOOK: dict[str, Any] = {
    "font.size": 9.0,
    "axes.labelsize": 8.5,
    "axes.titlesize": 9.5,
    "axes.titlelocation": "left",
    "axes.labelcolor": style.QUIET,
    **{f"{axis}tick.labelsize": 8.0 for axis in "xy"},
    **{f"{axis}tick.labelcolor": style.QUIET for axis in "xy"},
    "legend.fontsize": 8.0,
    "legend.title_fontsize": 8.0,
    "legend.frameon": False,
    "legend.labelcolor": style.QUIET,
    "legend.handlelength": 1.4,
    **{f"{axis}tick.{kind}.size": 0.0 for axis in "xy" for kind in ("major", "minor")},
    **{f"axes.spines.{side}": False for side in ("left", "right", "top", "bottom")},
    "axes.xmargin": 0.02,
}
"""Parameters of matplotlib: an instrument's face, as on palpate's pages. The data are in ink, the rest is quiet."""


@contextmanager
def apply_look() -> Iterator[None]:
    """The look, for figures that are drawn inside."""
    import matplotlib

    with style.ink(), matplotlib.rc_context(LOOK):
        yield


def panels(heights: Sequence[float], columns: int = 1, width: float = 9.0) -> tuple[Figure, list[list[Axes]]]:
    """Rows of panels of these heights [inches], each with an x axis of its own."""
    size = (width, sum(heights) + 0.45 * len(heights))
    drawing, axes = style.grid(size, len(heights), columns, height_ratios=heights)
    return drawing, [axes[i : i + columns] for i in range(0, len(axes), columns)]


def force_figure(shown: Record) -> Figure:
    """Measured and desired force over the whole width, as the thesis draws them, and where a motor is at its limit."""
    drawing, ((axis,),) = panels([3.2])
    t = shown["t"]
    axis.plot(t, shown["force_measured"], color=style.INK, linewidth=0.8, label="measured")
    axis.plot(t, shown["force_desired"], color=style.MEASURED, linewidth=1.1, label="desired")
    limits(axis, shown)
    axis.set(ylabel="force [N]", xlabel="time since contact [s]", xlim=(t[0], t[-1]))
    style.legend(axis)
    return drawing


def limits(axis: Axes, shown: Record) -> None:
    """Shade the lower edge where a motor is at its limit."""
    limited = np.maximum.reduce([shown[f"saturated{i}"] for i in (1, 2, 3)]) > 0.0
    if limited.any():
        look: dict[str, Any] = {"color": style.FAIL, "linewidth": 0, "label": "a motor at its limit"}
        transform = axis.get_xaxis_transform()
        axis.fill_between(shown["t"], 0.0, 0.035, where=limited, transform=transform, **look)
