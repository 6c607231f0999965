"""Parts of a film: an SVG that moves by itself, in the pages' colours by light and by dark."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from palpate.arrays import Array, Indices
from palpate.bench.summary import CONTACT
from palpate.records import Record
from palpate.report.look.assets import DATA, PAIRS

FRAMES = 96
"""Number of pictures in a film."""
Panel = tuple[float, float, float, float]
"""Left, top, width and height of a part of the picture."""


def touch_time(record: Record) -> float:
    """Time of the first row in contact; of the first row if there is none [s]."""
    return float(record["t"][np.argmax(record["phase"] == CONTACT)])


def frame_rows(record: Record, before: float) -> Indices:
    """Rows evenly in time, from `before` seconds before the first contact to the end."""
    t = record["t"]
    start = max(float(t[0]), touch_time(record) - before)
    return np.searchsorted(t, np.linspace(start, float(t[-1]), FRAMES)).clip(max=len(t) - 1)


def sheet() -> str:
    """Style sheet with the pages' colours for light and dark."""
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


def film_svg(parts: Sequence[str], left: float, width: float, height: float) -> str:
    """The SVG of a film from its parts; `left`, `width` and `height` bound the picture."""
    head = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="{left:g} 0 {width:g} {height:g}">'
    return "\n".join([head, "<!-- Made by palpate -->", f"<style>{sheet()}</style>", *parts, "</svg>\n"])


@dataclass(frozen=True)
class FilmView:
    """A parallel projection from the base's axes into the picture."""

    right: Array
    up: Array
    scale: float
    origin: Array

    def __call__(self, points: Array) -> Array:
        flat = np.column_stack([points @ self.right, -(points @ self.up)])
        return np.asarray(self.origin + self.scale * flat)


def trace_panel(t: Array, value: Array, known: Array, panel: Panel, words: str) -> list[str]:
    """A moving dot on a value over the film's time [s], beside the desired or true value; words above."""
    left, top, width, height = panel
    seconds = float(t[-1] - t[0])
    top_value = 1.1 * max(float(value.max()), float(known.max()), 1e-9)
    x = left + width * (t - t[0]) / max(seconds, 1e-9)
    line, desired = (np.column_stack([x, top + height * (1.0 - v / top_value)]) for v in (value, known))
    across, along = (
        animation(name, [f"{v:.1f}" for v in values], seconds)
        for name, values in zip(("cx", "cy"), line.T, strict=True)
    )
    return [
        f'<path class="flat" d="M{left:g} {top + height:g}h{width:g}"/>',
        f'<polyline class="want" points="{coordinates(desired)}"/>',
        f'<polyline class="force" points="{coordinates(line)}"/>',
        f'<circle class="dot" r="5" cx="{x[0]:.1f}" cy="{line[0, 1]:.1f}">{across}{along}</circle>',
        text(left, top - 8, words),
    ]


def text(x: float, y: float, words: str) -> str:
    """Words at a place of the picture."""
    return f'<text x="{x:g}" y="{y:g}">{words}</text>'


def animation(name: str, values: Sequence[str], seconds: float) -> str:
    """An attribute that runs through values in a loop."""
    return (
        f'<animate attributeName="{name}" dur="{max(seconds, 0.1):.3f}s" repeatCount="indefinite" '
        f'values="{";".join(values)}"/>'
    )


def fit_view(points: Array, panel: Panel, azimuth: float, elevation: float) -> FilmView:
    """The projection that shows points in a panel, as large as it allows.

    Args:
        points: shape (n, 3).
        panel: of the picture.
        azimuth: of the eye about the base's z [rad].
        elevation: angle above the base's xy plane [rad].
    """
    right = np.array([-np.sin(azimuth), np.cos(azimuth), 0.0])
    towards = np.array(
        [np.cos(azimuth) * np.cos(elevation), np.sin(azimuth) * np.cos(elevation), np.sin(elevation)]
    )
    up = np.cross(towards, right)
    flat = np.column_stack([points @ right, -(points @ up)])
    lowest, high = flat.min(axis=0), flat.max(axis=0)
    left, top, width, height = panel
    scale = float(min(width / max(high[0] - lowest[0], 1e-6), height / max(high[1] - lowest[1], 1e-6))) * 0.9
    middle = np.array([left + 0.5 * width, top + 0.5 * height])
    return FilmView(right, up, scale, middle - scale * 0.5 * (lowest + high))


def coordinates(points: Array) -> str:
    """Points of a polyline or a polygon, shape (n, 2), as SVG has them."""
    return " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
