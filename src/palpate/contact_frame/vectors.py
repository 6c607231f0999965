"""Vectors and rotations over time, with rows that hold no reading."""

from __future__ import annotations

import numpy as np

from palpate.arrays import Array, Mask
from palpate.errors import InputError
from palpate.signals.samples import continuous

Vector = tuple[float, float, float]
FEWEST = 20
"""Rows for a mean that is said of a log: its standard deviation is then a fifth of a reading's, or less."""
_UNIT = 0.1
"""By which a quaternion's length is off at most where its four numbers are rounded to one digit."""


def read_rows(vectors: Array) -> Mask:
    """Rows of vectors, shape (n, k), that hold a reading in each component."""
    return np.isfinite(vectors.sum(axis=1))


def matrices(time: Array, quaternions: Array) -> Array:
    """Rotation matrices, shape (n, 3, 3), of quaternions (x, y, z, w), shape (n, 4); rows of NaN are bridged.

    Raises:
        InputError: they are not of unit length.
    """
    from scipy.spatial.transform import Rotation

    there = read_rows(quaternions)
    lengths = np.linalg.norm(quaternions[there], axis=1)
    if not len(lengths) or np.abs(lengths - 1).max() > _UNIT:
        worst = lengths[np.argmax(np.abs(lengths - 1))] if len(lengths) else float("nan")
        raise InputError(f"the pose's quaternions must have length 1, got {worst:.3g}; give them as x,y,z,w")
    steady = continuous(quaternions[there])
    if not there.all():
        steady = np.column_stack([np.interp(time, time[there], part) for part in steady.T])
    turned: Array = Rotation.from_quat(steady).as_matrix()
    return turned
