"""The film of a run: the planar arm before the surface, and the force below it."""

import numpy as np

from palpate.arrays import Array
from palpate.records import Record
from palpate.report.film import animation, coordinates, film_of, frames_of, text, trace_panel, view_of
from palpate.robots.arm3 import Arm3

BEFORE = 1.0
"""Before the switch to force control, from where it shows the run [s]."""
_WIDE, _HIGH = 640.0, 520.0
_ARM, _FORCE = (20.0, 20.0, 600.0, 270.0), (40.0, 350.0, 560.0, 140.0)
"""Left, top, width and height of the arm's panel, and of the force's."""
_CORNERS = np.array([[-0.06, -0.17, 0.0], [0.56, 0.1, 0.0]])
"""Extent of the picture along x and y [m]: the planar arm's reach in front of a wall, and its base."""


def film(record: Record) -> str:
    """The film of a run of at least two rows, as SVG."""
    rows = frames_of(record, BEFORE)
    seconds = float(record["t"][rows[-1]] - record["t"][rows[0]])
    view = view_of(_CORNERS, _ARM, -0.5 * np.pi, 0.5 * np.pi)
    angles = np.cumsum(np.column_stack([record[f"q{i}"][rows] for i in (1, 2, 3)]), axis=1)
    steps = np.array(Arm3().length)[:, None] * np.stack(
        [np.cos(angles), np.sin(angles), 0.0 * angles], axis=2
    )
    joints = np.concatenate([np.zeros((len(rows), 1, 3)), np.cumsum(steps, axis=1)], axis=1)
    arm = [coordinates(view(points)) for points in joints]
    tip = np.array([view(points[-1:])[0] for points in joints])
    across, along = (
        animation(name, [f"{v:.1f}" for v in values], seconds)
        for name, values in zip(("cx", "cy"), tip.T, strict=True)
    )
    surface = [coordinates(view(_ground(wall))) for wall in (record["x"] - record["penetration"])[rows]]
    force, desired = record["force"][rows], record["force_desired"][rows]
    words = f"force and desired force, up to {float(force.max()):.3g} N in {seconds:.3g} s"
    parts = [
        f'<polygon class="surface" points="{surface[0]}">{animation("points", surface, seconds)}</polygon>',
        f'<polyline class="arm" points="{arm[0]}">{animation("points", arm, seconds)}</polyline>',
        f'<circle class="dot" r="6" cx="{tip[0, 0]:.1f}" cy="{tip[0, 1]:.1f}">{across}{along}</circle>',
        text(_ARM[0], _ARM[1] + _ARM[3] + 20, "the arm, to scale"),
    ]
    return film_of(
        [*parts, *trace_panel(record["t"][rows], force, desired, _FORCE, words)], 0.0, _WIDE, _HIGH
    )


def _ground(wall: float) -> Array:
    """Corners of the surface behind a wall at x, shape (4, 3) [m]."""
    (_, low, _), (far, high, _) = _CORNERS
    return np.array([[wall, low, 0.0], [far, low, 0.0], [far, high, 0.0], [wall, high, 0.0]])
