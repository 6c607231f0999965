"""Axes of a force sensor that stand at the end of their range: to be found before axes are mixed."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Rows = NDArray[np.bool_]

_FEWEST = 8
_SHARE = 1000
_MOVED = 0.02


def saturated_rows(force: Array, place: Array, inside: Rows) -> Rows:
    """Rows in contact in which an axis rests at exactly its extreme value while the tool moves on, shape (n,).

    Args:
        force: in the axes that it was recorded in [N], shape (n, 3); NaN where there is no reading.
        place: of the tool [m], shape (n, 3), likewise.
        inside: rows in contact, shape (n,).
    """
    stuck = np.zeros(len(force), bool)
    least, far = max(_FEWEST, len(force) // _SHARE), _MOVED * _travel(place)
    for axis in force.T:
        rows = np.flatnonzero(np.isfinite(axis) & inside)
        if not len(rows) or not np.ptp(axis[rows]):
            continue
        for level in (axis[rows].max(), axis[rows].min()):
            for begin, end in _runs(axis[rows] == level):
                own = rows[begin:end]
                if len(own) >= least and _travel(place[own[0] : own[-1] + 1]) > far:
                    stuck[own] = True
    return stuck


def _travel(place: Array) -> float:
    """How far the tool gets [m]."""
    there = place[np.isfinite(place.sum(axis=1))]
    return float(np.linalg.norm(np.ptp(there, axis=0))) if len(there) else 0.0


def _runs(here: Rows) -> list[tuple[int, int]]:
    """First and past-the-last place of each stretch that is true."""
    edges = np.diff(np.r_[0, here.astype(np.int8), 0])
    return list(zip(np.flatnonzero(edges > 0).tolist(), np.flatnonzero(edges < 0).tolist(), strict=True))
