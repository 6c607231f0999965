"""The six panels in which the thesis shows an identification, two a row, and rows of ours under them."""

import numpy as np

from palpate.arrays import Array
from palpate.records import Record
from palpate.report import style
from palpate_thesis.drawing import Axes, Figure
from palpate_thesis.least_squares.press_runs import between

COLORS = {"foam": style.SERIES[0], "relaxing foam": style.SERIES[1], "rubber": style.SERIES[2]}
PARAMETERS = {"M": ("$M_e$ [kg]", 1.0), "B": ("$B_e$ [N s/m]", 1.0), "K": ("$K_e$ [kN/m]", 1e-3)}
NAMES = {
    "Force": "f [N]",
    "Displacement": "x [mm]",
    "Force / displacement": "f/x [kN/m]",
    "Inertia": PARAMETERS["M"][0],
    "Damping": PARAMETERS["B"][0],
    "Stiffness": PARAMETERS["K"][0],
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


def six(
    name: str, press: Record, front: str, slot: tuple[float, float], calm: float = CALM, zero: bool = False
) -> tuple[Figure, list[Axes]]:
    """Force, displacement, their ratio, and M, B, K of one front-end on the surface of this name.

    The thesis' letters, in its order read down the columns: (a)-(c) left, (d)-(f) right.

    Args:
        name: of the surface.
        press: first contact.
        front: end of the names of the columns of M, B and K.
        slot: that is drawn [s].
        calm: time from which values set the scale of a panel [s].
        zero: True if the scales of M, B and K include zero.
    """
    drawing, axes = grid(3)
    left, right = axes[0:6:2], axes[1:6:2]
    for axis, letter, (title, label) in zip((*left, *right), "abcdef", NAMES.items(), strict=True):
        set_title(axis, letter, title)
        axis.set(ylabel=label, xlim=slot)
    rows, color = between(press, *slot), COLORS[name]
    t, x = press["t"][rows], press["displacement"][rows]
    late = t >= calm
    force = press["force_sampled" if front == "raw" else "force_measured"][rows]
    quotient = 1e-3 * force / np.where(np.abs(x) > 2e-5, x, np.nan)
    for axis, values, width in zip(left, (force, 1e3 * x, quotient), (0.7, 1.1, 0.7), strict=True):
        axis.plot(t, values, color=color, linewidth=width)
    calm_limits(left[2], quotient[late])
    for axis, (key, (_, scale)) in zip(right, PARAMETERS.items(), strict=True):
        values = scale * press[f"{key}_{front}"][rows]
        axis.plot(t, values, color=color, linewidth=1.1)
        calm_limits(axis, np.zeros(int(zero)), values[late])
    for axis in (left[2], right[2]):
        axis.set_xlabel("time since 5 N [s]")
    return drawing, axes


def calm_limits(axis: Axes, *curves: Array, margin: float = 0.25) -> None:
    """Set the scale of a panel from curves without their first moments; without a finite value it stays."""
    finite = [c for c in curves if np.isfinite(c).any()]
    if not finite:
        return
    low = min(float(np.nanmin(c)) for c in finite)
    high = max(float(np.nanmax(c)) for c in finite)
    room = margin * max(high - low, 1e-9)
    axis.set_ylim(low - room, high + room)
