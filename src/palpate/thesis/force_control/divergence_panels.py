"""Panels that show how the neural controller comes to lose its surface."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from palpate.arrays import Array
from palpate.report import style
from palpate.thesis.force_control.panels import legend_inside

if TYPE_CHECKING:
    from matplotlib.axes import Axes

DURATION = 240.0
"""Seconds of contact that count as steady [s]."""
PARTS = (
    "hidden, from torques",
    "hidden, from poses",
    "hidden thresholds",
    "output of the force",
    "output thresholds",
)


@dataclass(frozen=True)
class Course:
    """A long run: once a second the sizes of the weights, and the gains from the torques to the force."""

    t: Array  # (n,) [s]
    sizes: Array  # (n, 5), in the order of `PARTS`
    gains: Array  # (n, 3) [N per N m]
    lost: float | None  # when contact was lost [s]


@dataclass(frozen=True)
class Loss:
    """Signals in the last moments before the loss of contact."""

    t: Array  # before the loss [s]
    force: Array  # the network's [N]
    velocity: Array  # of the tip along x [m/s]
    true: Array  # contact force [N]


def weights_panel(axis: Axes, course: Course, name: str) -> None:
    """Sizes of the weights over a run."""
    colors = style.SERIES[:5]
    for sizes, part, color in zip(course.sizes.T, PARTS, colors, strict=True):
        axis.plot(course.t, sizes, color=color, linewidth=1.2, label=part)
    if course.lost is not None:
        axis.axvline(course.lost, color=style.INK, linestyle="--", linewidth=1)
    axis.set(xlabel="time since contact [s]", ylabel="size of the weights", ylim=(0.0, 1.05))
    axis.set_title(f"{name}, eta 5e-5", loc="left", fontsize=9.5)


def gains_panel(axis: Axes, courses: Mapping[str, Mapping[float, Sequence[Course]]]) -> None:
    """Gain from the torques to the force, on each surface."""
    for (name, found), color in zip(courses.items(), style.SERIES[:3], strict=True):
        course = found[5e-5][0]
        axis.plot(course.t, np.linalg.norm(course.gains, axis=1), color=color, linewidth=1.2, label=name)
        if course.lost is not None:
            axis.plot(
                course.t[-1],
                np.linalg.norm(course.gains[-1]),
                "x",
                color=color,
                markersize=9,
                markeredgewidth=2,
            )
    axis.set(xlabel="time since contact [s]", ylabel="gain [N per N m]", ylim=(0.0, 2.9))
    axis.set_title("from the torques to the network's force, eta 5e-5", loc="left", fontsize=9.5)
    legend_inside(axis, loc="upper right", ncols=3)


def loss_panel(axis: Axes, loss: Loss | None) -> None:
    """The last moments before a loss."""
    if loss is None:
        axis.set_axis_off()
        return
    axis.plot(loss.t, loss.force, color=style.SERIES[0], linewidth=1.4, label="network's force")
    axis.plot(loss.t, loss.true, color=style.F, linewidth=1.4, label="contact force")
    axis.plot(loss.t, 200 * loss.velocity, color=style.INK, linewidth=1.1, label="velocity along x")
    axis.set(xlabel="time before the loss [s]", ylabel="[N], [5 mm/s]", xlim=(loss.t[0], 0.0))
    axis.set_title("the loss: foam that relaxes, eta 5e-5", loc="left", fontsize=9.5)
    legend_inside(axis, loc="upper left")


def times_panel(axis: Axes, found_on: Mapping[str, Mapping[float, Sequence[Course]]]) -> None:
    """Times of loss over the learning rate, on each surface."""
    for (name, found), color, shift in zip(
        found_on.items(), style.SERIES[:3], (1.0, 0.94, 1.06), strict=True
    ):
        for rate, courses in found.items():
            _mark_losses(axis, [rate * shift] * len(courses), [c.lost for c in courses], color)
        axis.plot([], [], "o", color=color, markersize=4, label=name)
    axis.plot([], [], "^", color=style.MEASURED, markersize=5, label=f"kept for {DURATION:g} s, as with PI")
    axis.set(
        xscale="log", xlabel="learning rate eta", ylabel="contact lost after [s]", ylim=(0.0, DURATION * 1.08)
    )
    legend_inside(axis, loc="center right", bbox_to_anchor=(1.0, 0.62))


def _mark_losses(axis: Axes, at: Sequence[float], times: Sequence[float | None], color: str) -> None:
    for x, lost in zip(at, times, strict=True):
        axis.plot(
            x, DURATION if lost is None else lost, "^" if lost is None else "o", color=color, markersize=5
        )


def steps_panel(axis: Axes, found: Mapping[float, Sequence[Course]]) -> None:
    """Growth of the output weights of the force over the steps asked for, at each learning rate."""
    for (rate, courses), color in zip(found.items(), style.SERIES[:5], strict=True):
        one = courses[0]
        axis.plot(one.t / 2.5, one.sizes[:, 3], color=color, linewidth=1.5, label=f"{rate:g}")
    axis.set(xlabel="steps of the desired force", ylabel="force's output weights", yscale="log")
    axis.set_title("growth by steps, foam that relaxes", loc="left", fontsize=9.5)
    legend_inside(axis, loc="lower right", title="eta", title_fontsize=8)


def causes_panel(axis: Axes, causes: Mapping[str, Sequence[float | None]]) -> None:
    """Times of loss with one thing changed at a time."""
    for i, (name, times) in enumerate(causes.items()):
        for lost in times:
            marker, color = (">", style.OK) if lost is None else ("o", style.FAIL)
            axis.plot(DURATION if lost is None else lost, i, marker, color=color, markersize=6)
        last = max(DURATION if lost is None else lost for lost in times)
        side = "right" if last > 0.8 * DURATION else "left"
        axis.text(last + (-4 if side == "right" else 4), i, name, fontsize=8.5, va="center", ha=side)
    axis.set_yticks([])
    axis.invert_yaxis()
    axis.set(
        xlim=(0.0, DURATION * 1.02),
        xlabel=f"contact lost after [s]; at the right edge: kept for {DURATION:g} s",
    )
    axis.set_title("foam that relaxes, eta 5e-5, one thing changed at a time", loc="left", fontsize=9.5)
