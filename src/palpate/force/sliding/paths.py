"""Paths of a slide along a surface: a direction for each tick."""

import numpy as np
from numpy.typing import ArrayLike

from palpate.arrays import Array
from palpate.errors import InputError, unknown
from palpate.force.gains import Gains
from palpate.force.sliding.slide_domain import numbers_of
from palpate.force.sliding.sliding_loop import CHI2_95, sliding

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
    distance = speed / rate * np.arange(round(seconds * rate))
    if path == "circle":
        angle = heading + distance / extent
    elif path == "raster":  # a pass, a tenth of it aside, and the pass back
        turn = distance % (2.2 * extent)
        angle = heading + np.pi * ((turn >= 1.1 * extent) & (turn < 2.1 * extent))
        sideways = ((turn >= extent) & (turn < 1.1 * extent)) | (turn >= 2.1 * extent)
        angle = np.where(sideways, heading + 0.5 * np.pi, angle)
    else:
        angle = heading + np.pi * (np.floor(distance / extent) % 2.0) * (path == "back")
    return np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], 1)


def duration(path: str, seconds: float, speed: float, extent: float) -> float:
    """Duration of a slide [s]: a line ends at its length; arguments as of `directions`."""
    return min(seconds, extent / speed) if path == "line" else seconds


def check_directions(ways: Array, gains: Gains, into: ArrayLike) -> None:
    """Refuse a path that the true normal may point along, as far as the given one may be wrong.

    Args:
        ways: unit vectors along the path, shape (n, 3).
        gains: with a table `slide`.
        into: direction into the surface, shape (3,).

    Raises:
        InputError: a normal within its 95 % cone of the path, or one without length.
    """
    nearest = float(np.abs(ways @ np.array(sliding(gains, into).into)).max())
    angle, cone = np.degrees([np.arccos(min(nearest, 1.0)), CHI2_95 * numbers_of(gains).slope])
    if angle <= cone:
        raise InputError(
            f"--normal is {angle:.2g} degrees off a direction of the path and may be wrong by {cone:.2g} (--tilt): the"
            " tip would not slide; give the direction into the surface, across the path"
        )
