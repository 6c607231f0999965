"""The clouds of a study: a metric over parameters that were drawn at random."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from palpate.arrays import Array
from palpate.report import style
from palpate.report.study.axes import COLORS, Scale, bounded, grid

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

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
            bounded(axis, every)
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
