"""Signals as a page holds them: sixteen bits a value, thinned without losing what sticks out."""

from __future__ import annotations

import base64
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.arrays import Array, Mask

GAP = -32768
"""Where there is no value."""
NO_PLACE = -32767
"""Where a column has no place, and a line goes on over it."""
ABSENT = "absent"
"""The same, in a column that is not packed."""
_HALF = 32500
"""Steps of a two-byte number on either side of the middle, but for what says that there is none."""


def packed(values: Array) -> dict[str, Any]:
    """A column: `b` its values as little-endian int16 in base64, value = origin `o` + step `s` (i + 32500).

    Infinite stands for a place that the column does not have, NaN for a gap. The step is a 65,000th of the column's
    range: finer than a screen, and than four digits of most readings.
    """
    known = np.isfinite(values)
    low, high = (float(values[known].min()), float(values[known].max())) if known.any() else (0.0, 0.0)
    step = (high - low) / (2 * _HALF) or 1.0
    codes = np.full(len(values), GAP, dtype="<i2")
    codes[np.isinf(values)] = NO_PLACE
    codes[known] = np.round((values[known] - low) / step).astype(np.int64) - _HALF
    return {"b": base64.b64encode(codes.tobytes()).decode(), "s": step, "o": low}


def with_peaks(x: Array, values: Array, most: int) -> tuple[Array, Array]:
    """A line through values over x, of about so many points that keep its peaks."""
    rows = thinned(values, most)
    return x[rows], values[rows]


def thinned(values: Array, most: int, dense: Mask | None = None) -> NDArray[np.intp]:
    """Rows to be shown, in order: of every stretch those with the smallest and the largest value.

    Args:
        values: that must keep their peaks, shape (n,); NaN are passed over.
        most: rows, about.
        dense: rows of which half of all that are shown are to be, shape (n,).
    """
    n = len(values)
    if n <= most:
        return np.arange(n)
    if dense is not None and dense.any() and not dense.all():
        inside, outside = np.flatnonzero(dense), np.flatnonzero(~dense)
        share = max(most // 2, most - len(outside))
        parts = [
            inside[thinned(values[inside], share)],
            outside[thinned(values[outside], most - min(share, len(inside)))],
        ]
        return np.unique(np.concatenate(parts))
    edges = np.linspace(0, n, max(most // 2, 1) + 1).astype(int)
    kept = [0, n - 1]
    for a, b in pairwise(edges):
        piece = values[a:b]
        if len(piece) and np.isfinite(piece).any():
            kept += [a + int(np.nanargmin(piece)), a + int(np.nanargmax(piece))]
        elif len(piece):
            kept.append(a)
    return np.unique(kept)
