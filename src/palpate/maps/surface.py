"""The part of a surface that presses cover: a grid of places within their hull, flat or curved."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import RBFInterpolator
from scipy.spatial import ConvexHull, QhullError

from palpate.arrays import Array, Mask
from palpate.errors import InputError


@dataclass(frozen=True)
class Grid:
    """Places on a rectangular grid over a surface.

    Args:
        places: of the grid (rows * columns, d) [m].
        inside: whether a place lies within the hull of the presses (rows * columns,).
        across: coordinates of the columns [m].
        along: coordinates of the rows [m].
        ends: of the cells: across from and to, along from and to (4,) [m].
    """

    places: Array
    inside: Mask
    across: Array
    along: Array
    ends: Array

    @property
    def shape(self) -> tuple[int, int]:
        """Number of rows and of columns."""
        return len(self.along), len(self.across)

    @property
    def cell(self) -> float:
        """Area of a cell [m^2]."""
        return float(np.prod(self.ends[1::2] - self.ends[::2])) / len(self.places)


@dataclass(frozen=True)
class Surface:
    """The hull of places of presses.

    In two dimensions the coordinates are those of the places. In three they are along two axes in the principal plane
    of the places, the first along an axis of the frame, and the height over the plane is a thin-plate spline: a surface
    that folds back over itself is not covered.

    Args:
        presses: places (n, d), d 2 or 3 [m].
    """

    presses: Array

    def __post_init__(self) -> None:
        count = len(np.unique(self.presses, axis=0))
        try:
            spans = count > 2 and ConvexHull(self.coordinates(self.presses))
        except QhullError:
            spans = False
        if not spans:
            raise InputError(
                "a map needs presses at three places at least that are not in one line; number of places given: "
                f"{count}"
            )

    @property
    def is_curved(self) -> bool:
        """True if the places have three coordinates."""
        return self.presses.shape[1] == 3

    def coordinates(self, places: Array) -> Array:
        """Coordinates (m, 2) [m] of places (m, d) on the surface."""
        return places @ self._axes[:2].T if self.is_curved else places

    def places(self, coordinates: Array) -> Array:
        """Places (m, d) [m] on the surface at coordinates (m, 2) [m]."""
        if not self.is_curved:
            return coordinates
        points, first = np.unique(self.coordinates(self.presses), axis=0, return_index=True)
        *plane, normal = self._axes
        height = RBFInterpolator(points, self.presses[first] @ normal)(coordinates)
        return coordinates @ np.array(plane) + np.outer(height, normal)

    def grid(self, count: int) -> Grid:
        """A grid of nearly square cells that fill the hull's rectangle, of some `count` places."""
        corners = self.coordinates(self.presses)
        low = corners.min(axis=0)
        size = np.ptp(corners, axis=0)
        cells = np.clip(np.round(size * np.sqrt(count / np.prod(size))), 1.0, count).astype(int)
        steps = size / cells
        across, along = (low[k] + steps[k] * (np.arange(cells[k]) + 0.5) for k in range(2))
        points = np.stack(np.meshgrid(across, along), axis=-1).reshape(-1, 2)
        hull = ConvexHull(corners).equations
        inside = np.all(points @ hull[:, :2].T + hull[:, 2] <= 1e-9, axis=1)
        return Grid(self.places(points), inside, across, along, np.column_stack([low, low + size]).ravel())

    @property
    def names(self) -> tuple[str, str]:
        """Axes of the frame along which the coordinates are, nearly so where the surface is tilted."""
        return (("y", "z"), ("z", "x"), ("x", "y"))[self._across if self.is_curved else 2]

    @property
    def _normal(self) -> Array:
        """Normal of the principal plane (3,), along the frame's axis that is nearest to it."""
        normal: Array = np.linalg.svd(self.presses - self.presses.mean(axis=0), full_matrices=False)[2][-1]
        return normal * np.sign(normal[np.abs(normal).argmax()])

    @property
    def _across(self) -> int:
        """The frame's axis that is nearest to the normal."""
        return int(self._normal.argmax())

    @property
    def _axes(self) -> Array:
        """The two axes of the coordinates, and the normal (3, 3)."""
        normal = self._normal
        first = np.eye(3)[(self._across + 1) % 3]
        first = first - (first @ normal) * normal
        first /= np.linalg.norm(first)
        return np.array([first, np.cross(normal, first), normal])
