"""Paths of a slide along a surface: a direction for each tick."""

import numpy as np

from palpate.arrays import Array
from palpate.errors import unknown

PATHS = ("line", "back", "circle", "raster")


def directions(
    path: str, seconds: float, rate: float, speed: float, extent: float, heading: float = 0.0
) -> Array:
    """Unit vectors along the surface for each tick, shape (n, 3).

    Args:
        path: one of `PATHS`.
        seconds: of the slide [s].
        rate: ticks a second [Hz].
        speed: along the surface [m/s].
        extent: length of a line or a pass, radius of a circle [m].
        heading: of the beginning [rad].

    Raises:
        InputError: no such path.
    """
    if path not in PATHS:
        raise unknown("path", path, PATHS)
    way = speed / rate * np.arange(round(seconds * rate))
    if path == "circle":
        angle = heading + way / extent
    elif path == "raster":  # a pass, a tenth of it aside, and the pass back
        turn = way % (2.2 * extent)
        angle = heading + np.pi * ((turn >= 1.1 * extent) & (turn < 2.1 * extent))
        aside = ((turn >= extent) & (turn < 1.1 * extent)) | (turn >= 2.1 * extent)
        angle = np.where(aside, heading + 0.5 * np.pi, angle)
    else:
        angle = heading + np.pi * (np.floor(way / extent) % 2.0) * (path == "back")
    return np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], 1)
