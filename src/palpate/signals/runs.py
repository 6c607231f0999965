"""Unbroken runs of samples."""

from __future__ import annotations

import numpy as np

from palpate.arrays import Mask


def runs(inside: Mask) -> list[tuple[int, int]]:
    """First and past-the-last sample of each unbroken run within, in their order.

    Args:
        inside: shape (n,).
    """
    edges = np.diff(np.r_[0, np.asarray(inside).astype(np.int8), 0])
    return list(zip(np.flatnonzero(edges > 0).tolist(), np.flatnonzero(edges < 0).tolist(), strict=True))
