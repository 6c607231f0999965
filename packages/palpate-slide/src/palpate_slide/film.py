"""The film of a slide: the surface from aside, the tool or the normal on it with its cone, the force and friction."""

from __future__ import annotations

import numpy as np

from palpate.arrays import Array
from palpate.force.sliding.sliding_loop import CHI2_95
from palpate.report.film import (
    FRAMES,
    FilmView,
    Panel,
    animation,
    coordinates,
    film_of,
    text,
    trace_panel,
    view_of,
)
from palpate_slide.ground import Ground, surface_height
from palpate_slide.world import COLUMNS

SURFACE: Panel = (20.0, 24.0, 480.0, 360.0)
"""Left, top, width and height of the surface's panel; then of the force's, and of friction's."""
FORCE: Panel = (540.0, 44.0, 340.0, 130.0)
FRICTION: Panel = (540.0, 244.0, 340.0, 130.0)
WIDE, HIGH = 900.0, 420.0
LINES = 13
"""Of the surface's grid, each way."""
ROD = 76.0
"""Length of the normal that is drawn at the tip."""
WIDER = 5.0
"""Times that a cone is drawn as wide as it is."""
BEFORE = 0.6
"""Time before the slide that is shown, or before the touch if there was no slide [s]."""
STICKS = 9
"""Normals that stay along the path."""


def slide_film(rows: Array, tick: float, ground: Ground, half: str = "") -> str:
    """The film of a slide as SVG.

    Args:
        rows: as of `world.simulate`, shape (n, 25).
        tick: between two rows [s].
        ground: the surface.
        half: `surface` or `force` for that half alone, which is legible on a telephone; both if empty.
    """
    c = dict(zip(COLUMNS, rows.T, strict=True))
    began = np.flatnonzero(c["sliding" if c["sliding"].any() else "normal_force"] > 0.0)
    first = max(int(began[0]) - round(BEFORE / tick), 0) if len(began) else 0
    shown = np.linspace(first, len(rows) - 1, FRAMES).astype(int)
    c, t = {name: np.nan_to_num(column[shown]) for name, column in c.items()}, tick * shown
    left, width = {"": (0.0, WIDE), "surface": (0.0, 520.0), "force": (520.0, 380.0)}[half]
    parts = _surface_panel(c, float(t[-1] - t[0]), ground) if half != "force" else []
    if half != "surface":
        seconds, on = float(t[-1] - t[0]), c["sliding"] > 0.0
        words = f"force, up to {c['normal_force'].max():.3g} N in {seconds:.3g} s; dashed: desired"
        parts += trace_panel(t, c["normal_force"], c["desired"], FORCE, words)
        mu = np.where(on, c["mu"], 0.0)
        words = (
            f"friction, {mu[-1]:.2f} at the end; dashed: truth"
            if on.any()
            else "friction: the tip did not slide"
        )
        parts += trace_panel(t, mu, c["mu_true"], FRICTION, words)
    return film_of([_STYLE, *parts], left, width, HIGH)


_STYLE = (
    "<style>.net{fill:none;stroke:var(--quiet);stroke-opacity:.45;stroke-width:.8} .rod{stroke:var(--ink);"
    "stroke-width:6;stroke-linecap:round} .cone{fill:var(--quiet);fill-opacity:.35} .stick{stroke:var(--ink);"
    "stroke-width:1.2} .way{fill:none;stroke:var(--tip);stroke-width:3;stroke-linejoin:round}</style>"
)


def _surface_panel(c: dict[str, Array], seconds: float, ground: Ground) -> list[str]:
    tip, n, tool = (np.stack([c[f"{of}{axis}"] for axis in "xyz"], 1) for of in ("", "n", "a"))
    net = _net(tip, ground)
    view = view_of(
        np.vstack([line for line in net if len(line)]), SURFACE, np.radians(-65.0), np.radians(28.0)
    )
    seen, size = view(tip), ROD / view.scale
    ends, on = view(tip - size * (tool if tool.any() else n)), c["sliding"] > 0.0
    cones = [coordinates(_cone(view, *one, size)) for one in zip(tip, n, c["cone"], strict=True)]
    way = np.linalg.norm(np.diff(tip, axis=0), axis=1) * on[1:]
    gone = np.append(0.0, np.cumsum(way)) / max(float(way.sum()), 1e-9)
    path = seen[on] if on.any() else seen[:1]
    places = np.searchsorted(gone, np.linspace(0.0, 1.0, STICKS + 2)[1 : -1 if on.any() else 1])
    moving = "".join(
        animation(name, [f"{v:.1f}" for v in values], seconds)
        for name, values in (("x1", seen[:, 0]), ("y1", seen[:, 1]), ("x2", ends[:, 0]), ("y2", ends[:, 1]))
    )
    return [
        *(f'<polyline class="net" points="{coordinates(view(line))}"/>' for line in net if len(line) > 1),
        *(stick for k in places for stick in _stick(view, tip[k], n[k], float(c["cone"][k]), 0.6 * size)),
        f'<polyline class="way" pathLength="1" stroke-dasharray="1 1" points="{coordinates(path)}">',
        f"{animation('stroke-dashoffset', [f'{1.0 - g:.4f}' for g in gone], seconds)}</polyline>",
        f'<polygon class="cone" points="{cones[-1]}">{animation("points", cones, seconds)}</polygon>',
        f'<line class="rod" {_ends(seen[-1], ends[-1])}>{moving}</line>',
        text(SURFACE[0], HIGH - 8, f"to scale; cones of 95 % are drawn {WIDER:g} times as wide"),
    ]


def _stick(view: FilmView, at: Array, n: Array, deviation: float, size: float) -> list[str]:
    """A normal that stays, with its cone."""
    cone = coordinates(_cone(view, at, n, deviation, size))
    return [
        f'<polygon class="cone" points="{cone}"/>',
        f'<line class="stick" {_ends(*view(np.array([at, at - size * n])))}/>',
    ]


def _ends(one: Array, two: Array) -> str:
    return f'x1="{one[0]:.1f}" y1="{one[1]:.1f}" x2="{two[0]:.1f}" y2="{two[1]:.1f}"'


def _cone(view: FilmView, at: Array, n: Array, deviation: float, size: float) -> Array:
    """The outline of a normal's cone."""
    half = size * np.tan(min(WIDER * CHI2_95 * deviation, 0.6))
    aside = np.cross(n, np.cross(view.right, view.up))
    aside /= max(float(np.linalg.norm(aside)), 1e-9)
    return view(np.array([at, at - size * n + half * aside, at - size * n - half * aside]))


def _net(tip: Array, ground: Ground) -> list[Array]:
    """Lines of a grid on the surface around the path, each of shape (m, 3) [m]."""
    low, high = tip[:, :2].min(axis=0), tip[:, :2].max(axis=0)
    middle, reach = 0.5 * (low + high), 0.62 * max(float((high - low).max()), 0.02)
    own = np.linspace(-reach, reach, LINES)
    places = np.array(
        [[[x, y, surface_height(ground, x, y)] for y in middle[1] + own] for x in middle[0] + own]
    )
    lines = [*places, *places.transpose(1, 0, 2)]
    return [line[np.isfinite(line[:, 2])] for line in lines]
