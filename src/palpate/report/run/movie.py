"""A film of a run: the arm before the surface, and the force below it, for a slide or a message."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from palpate.bench.summary import CONTACT
from palpate.errors import InputError
from palpate.files import MADE, check_place, whole
from palpate.records import Record
from palpate.report import style
from palpate.robots.arm3 import Arm3

if TYPE_CHECKING:
    from matplotlib.figure import Figure

BEFORE = 1.0
"""Before the switch to force control, from where it shows the run [s]."""
FRAMES_PER_S = 20
MOST = 300
"""Frames; a longer run is shown faster, and says so."""
_WIDE, _HIGH, _DPI = 6.4, 5.0, 100
_REACH = (-0.06, 0.56)
_SIDE = (-0.17, 0.1)
"""Extent of the picture along x and y [m]: the planar arm's reach in front of a wall, and its base."""


def write_movie(record: Record, path: Path) -> Path:
    """Writes a film of a run as GIF, atomically.

    Args:
        record: of a bench, at least two rows.
        path: of the film.

    Raises:
        InputError: a place that may not be written, or too few rows.
    """
    check_movie(path)
    if len(record) < 2:
        raise InputError("there is no film: the run ended at its start")
    rows, pace = frames_of(record)
    frames = [frame.convert("P", palette=1, colors=64) for frame in _frames(record, rows, pace)]
    with whole(path) as draft:
        frames[0].save(
            draft,
            format="GIF",
            save_all=True,
            append_images=frames[1:],
            duration=1000 // FRAMES_PER_S,
            loop=0,
            comment=f"\n{MADE}\n".encode(),
        )
    return path


def check_movie(path: Path) -> None:
    """Refuses a place for a film before any work is done.

    Raises:
        InputError: it is none.
    """
    if path.suffix.lower() != ".gif":
        raise InputError(f"a film is a GIF; name it {path.with_suffix('.gif')} instead of {path}")
    check_place(path, "--movie")


def frames_of(record: Record) -> tuple[NDArray[np.intp], float]:
    """The rows that are shown, a frame each, and how much faster than the run they pass."""
    t = record["t"]
    contact = record["phase"] == CONTACT
    first = float(t[np.argmax(contact)]) - BEFORE if contact.any() else float(t[0])
    first = max(first, float(t[0]))
    count = int(np.clip(np.ceil((t[-1] - first) * FRAMES_PER_S), 2, MOST))
    times = np.linspace(first, t[-1], count)
    pace = max((float(t[-1]) - first) * FRAMES_PER_S / count, 1.0)
    return np.clip(np.searchsorted(t, times), 0, len(t) - 1), pace


def _frames(record: Record, rows: NDArray[np.intp], pace: float) -> Any:
    """A picture a row."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from PIL import Image

    with style.ink():
        figure, moving = _scene(record, rows, pace)
        canvas = FigureCanvasAgg(figure)
        moving(int(rows[0]))
        canvas.draw()
        figure.set_layout_engine("none")  # found once; anew for each frame it takes most of the time
        for row in rows:
            moving(int(row))
            canvas.draw()
            yield Image.fromarray(np.asarray(canvas.buffer_rgba())[..., :3].copy())


def _scene(record: Record, rows: NDArray[np.intp], pace: float) -> tuple[Figure, Any]:
    """The figure, and the function that draws a row into it."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(_WIDE, _HIGH), dpi=_DPI, layout="constrained", facecolor="white")
    above, below = figure.subplots(2, 1, height_ratios=(3, 2))
    faster = "" if pace < 1.05 else f", {pace:.1f} times as fast"
    above.set(xlim=_REACH, ylim=_SIDE, aspect="equal", xticks=[], yticks=[])
    above.spines[:].set_visible(False)
    ground = above.axvspan(_REACH[1], _REACH[1], color=style.MEASURED, alpha=0.2, lw=0)
    (arm,) = above.plot([], [], color=style.INK, lw=6, solid_capstyle="round", marker="o", ms=9, mfc="white")
    (tip,) = above.plot([], [], "o", color=style.F, ms=9)
    said = above.text(0.0, 1.0, "", transform=above.transAxes, va="top", color=style.QUIET)
    seen = slice(int(rows[0]), int(rows[-1]) + 1)
    t = record["t"]
    style.panel(below, "force [N]", "time [s]")
    below.plot(t[seen], record["force_measured"][seen], color=style.MEASURED, lw=0.6, label="measured")
    below.plot(t[seen], record["force_desired"][seen], **style.KNOWN, label="desired")
    below.plot(t[seen], record["force"][seen], color=style.F, lw=1.6, label="true")
    now = below.axvline(t[seen][0], color=style.QUIET, lw=1)
    below.set_xlim(t[seen][0], t[seen][-1])
    style.legend(below, loc="upper right", bbox_to_anchor=(1.0, 1.18))
    length = np.array(Arm3().length)

    def moving(row: int) -> None:
        angles = np.cumsum([record[f"q{i}"][row] for i in (1, 2, 3)])
        x = np.concatenate([[0.0], np.cumsum(length * np.cos(angles))])
        y = np.concatenate([[0.0], np.cumsum(length * np.sin(angles))])
        arm.set_data(x, y)
        tip.set_data(x[-1:], y[-1:])
        wall = record["x"][row] - record["penetration"][row]
        ground.set_x(wall)
        ground.set_width(_REACH[1] - wall)
        now.set_xdata([t[row], t[row]])
        depth = 1e3 * record["penetration"][row]
        place = f"{depth:.2f} mm deep" if depth > 0 else f"{-depth:.1f} mm away"
        said.set_text(f"{t[row]:.2f} s{faster}: {record['force'][row]:.1f} N, {place}")

    return figure, moving
