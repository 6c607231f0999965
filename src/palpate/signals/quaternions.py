"""Quaternions over time."""

from __future__ import annotations

import numpy as np

from palpate.arrays import Array


def continuous(quaternions: Array) -> Array:
    """Quaternions, shape (n, 4), each with the sign that is nearer to the one before.

    q and -q are the same rotation, and drivers change between them at will; what lies between them is none.
    """
    together = np.sum(quaternions[1:] * quaternions[:-1], axis=1)
    signs = np.cumprod(np.r_[1.0, np.where(together < 0, -1.0, 1.0)])
    steady: Array = quaternions * signs[:, None]
    return steady
