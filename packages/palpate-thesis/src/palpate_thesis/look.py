"""One look for all figures: sizes, colours and frames; and the types that drawing functions name."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from palpate.report import style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
else:  # for annotations alone: matplotlib is imported when a figure is drawn
    Axes = Figure = Any

__all__ = ["LIMIT_LINE", "LOOK", "STATED", "ZERO", "Axes", "Figure", "apply_look"]

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
    "xtick.labelsize": 8.0,
    "ytick.labelsize": 8.0,
    "xtick.labelcolor": style.QUIET,
    "ytick.labelcolor": style.QUIET,
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
