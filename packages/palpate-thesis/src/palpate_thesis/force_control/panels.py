"""Panels that the figures of force control are put together from."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeVar

import numpy as np

from palpate.records import Record
from palpate.report import style
from palpate_studies.metrics.following import LIMIT
from palpate_thesis.force_control.tracking import Tracking
from palpate_thesis.look import LIMIT_LINE, Axes, Figure

T = TypeVar("T")
HELD: dict[str, Any] = {"color": style.OK, "s": 16, "linewidths": 0}
FAILED: dict[str, Any] = {"color": style.FAIL, "s": 20, "marker": "x", "linewidths": 1.0}
"""How a run is marked that did what is claimed, and one that did not."""


def panels(heights: Sequence[float], columns: int = 1, width: float = 9.0) -> tuple[Figure, list[list[Axes]]]:
    """Rows of panels of these heights [inches], each with an x axis of its own."""
    size = (width, sum(heights) + 0.45 * len(heights))
    drawing, axes = style.grid(size, len(heights), columns, height_ratios=heights)
    return drawing, [axes[i : i + columns] for i in range(0, len(axes), columns)]


def across(row: Sequence[Axes]) -> Axes:
    """The first panel of a row, stretched over all of it; the others go."""
    axis, *others = row
    for other in others:
        other.remove()
    where = axis.get_subplotspec()
    if where is not None:
        axis.set_subplotspec(where.get_gridspec()[where.rowspan.start, :])
    return axis


def force_panel(axis: Axes, shown: Record) -> None:
    """Measured, true and desired force, and where a motor is at its limit."""
    t = shown["t"]
    axis.plot(t, shown["force_measured"], color=style.MEASURED, linewidth=0.7, label="measured")
    axis.plot(t, shown["force"], color=style.F, linewidth=1.6, label="true")
    axis.plot(t, shown["force_desired"], **style.KNOWN, label="desired")
    limits(axis, shown)
    axis.set(ylabel="force [N]", xlabel="time since contact [s]", xlim=(t[0], t[-1]))
    style.legend(axis)


def limits(axis: Axes, shown: Record) -> None:
    """A bar at the lower edge where a motor is at its limit."""
    limited = np.maximum.reduce([shown[f"saturated{i}"] for i in (1, 2, 3)]) > 0.0
    if limited.any():
        look: dict[str, Any] = {"color": style.FAIL, "linewidth": 0, "label": "a motor at its limit"}
        transform = axis.get_xaxis_transform()
        axis.fill_between(shown["t"], 0.0, 0.035, where=limited, transform=transform, **look)


def dots_panel(
    axis: Axes,
    found: Mapping[str, Sequence[T]],
    value: Callable[[T], float],
    holds: Callable[[T], bool],
    limit: float | None,
) -> None:
    """One mark per run, by variation: a dot if the claim is true, a cross if not."""
    for at, runs in enumerate(found.values()):
        spot = at + np.linspace(-0.22, 0.22, max(2, len(runs)))[: len(runs)]
        for good, mark in ((True, HELD), (False, FAILED)):
            places = [i for i, one in enumerate(runs) if holds(one) == good]
            axis.scatter(spot[places], [value(runs[i]) for i in places], **mark)
    if limit is not None:
        axis.axhline(limit, **LIMIT_LINE)
    axis.set_xticks(range(len(found)), list(found))
    axis.set(xlim=(-0.6, len(found) - 0.4), ylim=(0.0, None))
    axis.grid(visible=False, axis="x")


def following_panel(axis: Axes, found: Mapping[str, Sequence[Tracking]]) -> None:
    """RMS error outside the steps, by variation."""
    dots_panel(axis, found, lambda one: one.settled, lambda one: one.follows, LIMIT)
    title = "outside the steps, a mark each run: a dot follows, a cross does not; dashed: the limit"
    axis.set(ylabel="RMS error [N]", title=title)


def legend_inside(axis: Axes, **options: object) -> None:
    """The legend in a corner of the panel, where panels stand side by side."""
    axis.legend(frameon=True, framealpha=0.85, edgecolor="none", **options)
