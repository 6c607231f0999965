"""An arm at its surface as a short film: SVG that moves by itself, without a script, and needs no other file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from palpate.arrays import Array
from palpate.bench.sequence import CONTACT
from palpate.press.setting import Place
from palpate.records import Record
from palpate.report.look.tokens import DATA, PAIRS
from palpate.robots.serial.serial_arm import SerialArm

FRAMES = 96
_BEFORE = 0.4
"""Seconds of the approach that are shown."""
_WIDE, _HIGH = 900.0, 420.0
_ARM = (20.0, 20.0, 420.0, 372.0)
"""Left, top, width and height of the arm's panel; then of the tip's, and of the force's."""
_TIP = (480.0, 30.0, 400.0, 170.0)
_FORCE = (480.0, 250.0, 400.0, 130.0)


def _sheet() -> str:
    """Colours by light and by dark: the pages' own."""
    names = ("ink", "quiet", "line", "card")
    light, dark = ("".join(f"--{name}:{PAIRS[name][i]};" for name in names) for i in (0, 1))
    return (
        f":root{{{light}--tip:{DATA['F']}}}\n@media (prefers-color-scheme:dark){{:root{{{dark}}}}}\n"
        "text{font:15px system-ui,sans-serif;fill:var(--quiet)} .arm{fill:none;stroke:var(--ink);stroke-width:11;"
        "stroke-linejoin:round;stroke-linecap:round} .joint{fill:var(--card);stroke:var(--ink)}\n"
        ".surface{fill:var(--line);stroke:var(--quiet)} .flat{fill:none;stroke:var(--line);stroke-width:1}\n"
        ".force{fill:none;stroke:var(--tip);stroke-width:1.6}\n"
        ".want{fill:none;stroke:var(--ink);stroke-width:1.25;stroke-dasharray:5 4}\n"
        ".dot,.probe{fill:var(--tip)} .shadow{fill:none;stroke:var(--line);stroke-width:7;stroke-linejoin:round}\n"
    )


_MARKER = (
    '<marker id="joint" markerWidth="3" markerHeight="3" refX="1.5" refY="1.5">'
    '<circle class="joint" cx="1.5" cy="1.5" r="0.55" stroke-width="0.22"/></marker>'
)


@dataclass(frozen=True)
class _View:
    """Where a point of the base's axes is drawn."""

    right: Array
    up: Array
    scale: float
    origin: Array

    def __call__(self, points: Array) -> Array:
        flat = np.column_stack([points @ self.right, -(points @ self.up)])
        return np.asarray(self.origin + self.scale * flat)


def film(record: Record, arm: SerialArm, place: Place, half: str = "") -> str:
    """The film of a press.

    Args:
        record: of the press.
        arm: what moved.
        place: where.
        half: `arm` or `tip` for that half alone, which is legible on a telephone; both if empty.
    """
    rows = _frames(record)
    seconds = float(record["t"][rows[-1]] - record["t"][rows[0]])
    q = np.column_stack([record[f"q{i}"] for i in range(1, arm.joints + 1)])[rows]
    left, width = {"": (0.0, _WIDE), "arm": (0.0, _TIP[0] - 20.0), "tip": (_TIP[0] - 20.0, _TIP[2] + 40.0)}[
        half
    ]
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="{left:g} 0 {width:g} {_HIGH:g}">',
        "<!-- Made by palpate -->",
        f"<style>{_sheet()}</style>",
        *(_arm_panel(arm, place, q, seconds) if half != "tip" else ()),
        *(_tip_panel(record, rows, seconds) if half != "arm" else ()),
        *(_force_panel(record, rows, seconds) if half != "arm" else ()),
        "</svg>\n",
    ]
    return "\n".join(parts)


def _frames(record: Record) -> NDArray[np.intp]:
    """Rows evenly in time, from a little before the touch to the end."""
    t, pressing = record["t"], record["phase"] == CONTACT
    touch = float(t[np.argmax(pressing)]) if pressing.any() else float(t[0])
    start = max(float(t[0]), touch - _BEFORE)
    return np.searchsorted(t, np.linspace(start, float(t[-1]), FRAMES)).clip(max=len(t) - 1)


def _arm_panel(arm: SerialArm, place: Place, q: Array, seconds: float) -> list[str]:
    bones = [arm.joint_places(one) for one in q]
    patch = _patch(place, 0.16)
    ground = np.column_stack([bones[0][:, :2], 0.0 * bones[0][:, 2]])
    view = _view_of(np.vstack([bones[0], bones[-1], patch, ground]))
    seen = [view(b) for b in bones]
    moving = _animation("points", [_points(s) for s in seen], seconds)
    return [
        f'<polygon class="surface" points="{_points(view(patch))}" fill-opacity="0.55"/>',
        f'<polyline class="shadow" points="{_points(view(ground))}"/>',
        _MARKER,
        '<polyline class="arm" marker-start="url(#joint)" marker-mid="url(#joint)" ',
        f'points="{_points(seen[0])}">{moving}</polyline>',
        _text(_ARM[0], _HIGH - 8, "the arm, to scale"),
    ]


def _tip_panel(record: Record, rows: NDArray[np.intp], seconds: float) -> list[str]:
    """The tip along the normal, drawn so large that its way is seen."""
    left, top, width, height = _TIP
    depth = record["penetration"][rows]
    most = float(np.max(np.abs(depth))) or 1e-3
    middle, y0, scale = left + 0.5 * width, top + 0.45 * height, 0.4 * height / most
    places = y0 + scale * depth
    dents = [_dent(left, width, y0, max(float(p) - y0, 0.0), top + height) for p in places]
    probes = [
        f"{middle - 26:.1f},{p - 60:.1f} {middle:.1f},{p:.1f} {middle + 26:.1f},{p - 60:.1f}" for p in places
    ]
    return [
        f'<polygon class="surface" points="{dents[0]}">{_animation("points", dents, seconds)}</polygon>',
        f'<polygon class="probe" points="{probes[0]}">{_animation("points", probes, seconds)}</polygon>',
        _text(left, top + height + 18, f"the tip; its deepest is {1e3 * float(depth.max()):.3g} mm"),
    ]


def _dent(left: float, width: float, y0: float, deep: float, bottom: float) -> str:
    x = np.linspace(-1.0, 1.0, 17)
    y = y0 + deep * np.maximum(1.0 - np.abs(x) / 0.6, 0.0) ** 1.5
    over = np.column_stack([left + 0.5 * width * (1.0 + x), y])
    return _points(np.vstack([over, [[left + width, bottom], [left, bottom]]]))


def _force_panel(record: Record, rows: NDArray[np.intp], seconds: float) -> list[str]:
    left, top, width, height = _FORCE
    t, force, want = (record[name][rows] for name in ("t", "force", "force_desired"))
    most = 1.1 * max(float(force.max()), float(want.max()), 1e-9)
    x = left + width * (t - t[0]) / max(seconds, 1e-9)
    line = np.column_stack([x, top + height * (1.0 - force / most)])
    asked = np.column_stack([x, top + height * (1.0 - want / most)])
    across, along = (
        _animation(name, [f"{v:.1f}" for v in values], seconds)
        for name, values in zip(("cx", "cy"), line.T, strict=True)
    )
    return [
        f'<path class="flat" d="M{left:g} {top + height:g}h{width:g}"/>',
        f'<polyline class="want" points="{_points(asked)}"/>',
        f'<polyline class="force" points="{_points(line)}"/>',
        f'<circle class="dot" r="5" cx="{x[0]:.1f}" cy="{line[0, 1]:.1f}">{across}{along}</circle>',
        _text(left, top - 8, f"force and desired force, up to {float(force.max()):.3g} N in {seconds:.3g} s"),
    ]


def _text(x: float, y: float, words: str) -> str:
    return f'<text x="{x:g}" y="{y:g}">{words}</text>'


def _animation(name: str, values: Sequence[str], seconds: float) -> str:
    return (
        f'<animate attributeName="{name}" dur="{max(seconds, 0.1):.3f}s" repeatCount="indefinite" '
        f'values="{";".join(values)}"/>'
    )


def _view_of(points: Array) -> _View:
    """From the side of where the arm reaches, a little from above, as large as the panel allows."""
    reach = points.mean(axis=0)
    azimuth = float(np.arctan2(reach[1], reach[0])) - np.radians(60.0)
    low = np.radians(18.0)
    right = np.array([-np.sin(azimuth), np.cos(azimuth), 0.0])
    towards = np.array([np.cos(azimuth) * np.cos(low), np.sin(azimuth) * np.cos(low), np.sin(low)])
    up = np.cross(towards, right)
    flat = np.column_stack([points @ right, -(points @ up)])
    least, most = flat.min(axis=0), flat.max(axis=0)
    left, top, width, height = _ARM
    scale = float(min(width / max(most[0] - least[0], 1e-6), height / max(most[1] - least[1], 1e-6))) * 0.9
    middle = np.array([left + 0.5 * width, top + 0.5 * height])
    return _View(right, up, scale, middle - scale * 0.5 * (least + most))


def _patch(place: Place, half: float) -> Array:
    """Four corners of the surface around the tip."""
    centre = place.pose[:3, 3] + (place.place - place.normal @ place.pose[:3, 3]) * place.normal
    u, v = half * place.axes[1], half * place.axes[2]
    return np.array([centre + u + v, centre + u - v, centre - u - v, centre - u + v])


def _points(points: Array) -> str:
    return " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
