"""The six panels in which the thesis shows an identification, two a row, and rows of ours under them."""

from collections.abc import Mapping, Sequence

import numpy as np

from palpate.arrays import Array
from palpate.records import Record
from palpate.report import style
from palpate_thesis.drawing import Axes, Figure, strip
from palpate_thesis.drawing import panels as rows_of_panels
from palpate_thesis.least_squares import press_runs
from palpate_thesis.least_squares.press_runs import PressEstimates, between

COLORS = {"foam": style.SERIES[0], "relaxing foam": style.SERIES[1], "rubber": style.SERIES[2]}
PARAMETERS = {"M": ("$M_e$ [kg]", 1.0), "B": ("$B_e$ [N s/m]", 1.0), "K": ("$K_e$ [kN/m]", 1e-3)}
NAMES = {
    "Force": "f [N]",
    "Displacement": "x [mm]",
    "Force / displacement": "f/x [kN/m]",
    **dict(
        zip(("Inertia", "Damping", "Stiffness"), (label for label, _ in PARAMETERS.values()), strict=True)
    ),
}
"""Of the six panels, (a) to (f), and their y axes."""
CALM = 0.03
"""Time after the change-over from which values set the scale of a panel; before, they are transients [s]."""


def grid(rows: int) -> tuple[Figure, list[Axes]]:
    """Panels two a row, lettered (a), (b), ... along the rows."""
    return style.grid((9.0, 2.15 * rows + 0.4), rows, 2)


def set_title(axis: Axes, letter: str, text: str) -> None:
    """Write letter and name above a panel."""
    axis.set_title(f"({letter}) {text}")


def six(axes: list[Axes], name: str, press: Record, front: str, slot: tuple[float, float]) -> None:
    """Draw force, displacement, their ratio, and M, B, K of one front-end on the surface of this name.

    The thesis' letters, in its order read down the columns: (a)-(c) left, (d)-(f) right.
    """
    left, right = axes[0:6:2], axes[1:6:2]
    for axis, letter, (title, label) in zip((*left, *right), "abcdef", NAMES.items(), strict=True):
        set_title(axis, letter, title)
        axis.set(ylabel=label, xlim=slot)
    rows = between(press, *slot)
    t, color = press["t"][rows], COLORS[name]
    x = press["displacement"][rows]
    force = press["force_sampled" if front == "raw" else "force_measured"][rows]
    far = np.where(np.abs(x) > 2e-5, x, np.nan)
    left[0].plot(t, force, color=color, linewidth=0.7)
    left[1].plot(t, 1e3 * x, color=color, linewidth=1.1)
    left[2].plot(t, 1e-3 * force / far, color=color, linewidth=0.7)
    for axis, (key, (_, scale)) in zip(right, PARAMETERS.items(), strict=True):
        axis.plot(t, scale * press[f"{key}_{front}"][rows], color=color, linewidth=1.1)
    for axis in (left[2], right[2]):
        axis.set_xlabel("time since 5 N [s]")


def settling(presses: Mapping[str, Sequence[PressEstimates]], limit: float) -> Figure:
    """Time until K_e is settled, a dot a press, by surface and condition; dashed: the limit [s]."""
    drawing, ((axis,),) = rows_of_panels([2.2])
    times = {name.replace(" ", "\n", 1): [p.settled_K for p in each] for name, each in presses.items()}
    strip(axis, times, "K_e settled after [s]", limit)
    return drawing


def calm_limits(axis: Axes, *curves: Array, margin: float = 0.25) -> None:
    """Set the scale of a panel from curves without their first moments; without a finite value it stays."""
    finite = [c for c in curves if np.isfinite(c).any()]
    if not finite:
        return
    low = min(float(np.nanmin(c)) for c in finite)
    high = max(float(np.nanmax(c)) for c in finite)
    room = margin * max(high - low, 1e-9)
    axis.set_ylim(low - room, high + room)


def calm_ratio(press: Record, force: str = "force_measured") -> Array:
    """f/x in the first slot after `CALM` [kN/m]."""
    return 1e-3 * calm(press, force, press_runs.FIRST) / calm(press, "displacement", press_runs.FIRST)


def calm(press: Record, column: str, stop: float) -> Array:
    """A column from `CALM` to `stop` [s]."""
    return press[column][between(press, CALM, stop)]
