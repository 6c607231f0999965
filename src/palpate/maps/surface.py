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
        cell: area of a cell [m^2].
    """

    places: Array
    inside: Mask
    across: Array
    along: Array
    cell: float

    @property
    def shape(self) -> tuple[int, int]:
        """Number of rows and of columns."""
        return len(self.along), len(self.across)


@dataclass(frozen=True)
class Surface:
    """The hull of places of presses.

    In two dimensions the coordinates are those of the places. In three they are along the two principal axes of the
    places, and the height over them is a thin-plate spline: a surface that folds back over itself is not covered.

    Args:
        presses: places (n, d), d 2 or 3 [m].
    """

    presses: Array

    def __post_init__(self) -> None:
        try:
            ConvexHull(self.coordinates(self.presses))
        except (QhullError, ValueError):
            raise InputError(
                f"a map needs presses at three places at least that are not in one line, got {len(self.presses)} "
                f"presses at {len(np.unique(self.presses, axis=0))} places"
            ) from None

    @property
    def is_curved(self) -> bool:
        """Whether the places have three coordinates."""
        return self.presses.shape[1] == 3

    def coordinates(self, places: Array) -> Array:
        """Coordinates (m, 2) [m] of places (m, d) on the surface."""
        return (places - self._centre) @ self._axes.T if self.is_curved else places

    def places(self, coordinates: Array) -> Array:
        """Places (m, d) [m] on the surface at coordinates (m, 2) [m]."""
        if not self.is_curved:
            return coordinates
        known, first = np.unique(self.coordinates(self.presses), axis=0, return_index=True)
        normal = np.cross(*self._axes)
        height = RBFInterpolator(known, (self.presses[first] - self._centre) @ normal)(coordinates)
        return self._centre + coordinates @ self._axes + np.outer(height, normal)

    def grid(self, count: int) -> Grid:
        """A grid of square cells over the hull's rectangle, of some `count` places."""
        known = self.coordinates(self.presses)
        low, size = known.min(axis=0), np.ptp(known, axis=0)
        side = float(np.sqrt(np.prod(size) / count))
        across, along = (
            low[k] + side * (np.arange(max(int(np.ceil(size[k] / side)), 1)) + 0.5) for k in range(2)
        )
        points = np.stack(np.meshgrid(across, along), axis=-1).reshape(-1, 2)
        hull = ConvexHull(known).equations
        inside = np.all(points @ hull[:, :2].T + hull[:, 2] <= 1e-9, axis=1)
        return Grid(self.places(points), inside, across, along, side * side)

    @property
    def _centre(self) -> Array:
        return self.presses.mean(axis=0)

    @property
    def _axes(self) -> Array:
        """The two axes of largest spread (2, 3)."""
        axes: Array = np.linalg.svd(self.presses - self._centre, full_matrices=False)[2][:2]
        return axes
