"""Saturated axes of a force sensor, found before the axes are rotated."""

from __future__ import annotations

import numpy as np

from palpate.arrays import Array, Mask
from palpate.identification.saturation import at_limit


def saturated_rows(force: Array, place: Array, inside: Mask) -> Mask:
    """Mask in contact in which an axis rests at exactly its extreme value while the tool moves on, shape (n,).

    Args:
        force: in the axes that it was recorded in [N], shape (n, 3); NaN where there is no reading.
        place: of the tool [m], shape (n, 3), likewise.
        inside: rows in contact, shape (n,).
    """
    stuck = np.zeros(len(force), bool)
    for axis in force.T:
        there = np.isfinite(axis) & inside
        if there.any() and np.ptp(axis[there]):
            stuck |= at_limit(axis, place, (axis[there].max(), axis[there].min()), there)
    return stuck
