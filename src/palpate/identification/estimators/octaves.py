"""Normal equations by octave of frequency: all that the mixed model needs of a log, whatever its length.

Each contact goes through a discrete cosine transform without its mean, so that an offset of the force in each contact
drops out. The products of all columns are then summed over the lines of each octave and over groups of contacts.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

SHORTEST = 8
"""Rows of a segment, at least: fewer have no second octave."""
MOST_GROUPS = 8
"""Groups of contacts whose stiffness may differ: enough for a variance between them, few enough for a small system."""


@dataclass(frozen=True)
class Segment:
    """Evenly spaced rows without a gap.

    Args:
        first, last: of the rows, past the last.
        group: which group of contacts it belongs to.
    """

    first: int
    last: int
    group: int


@dataclass(frozen=True)
class Octaves:
    """Sums over lines.

    Args:
        products: of the columns with each other, shape (groups, octaves, p, p).
        lines: how many lines each sum has, shape (groups, octaves).
        frequency: geometric middle of each octave [Hz], shape (octaves,).
    """

    products: Array
    lines: Array
    frequency: Array

    @property
    def total(self) -> Array:
        """Sums over all groups, shape (octaves, p, p)."""
        whole: Array = self.products.sum(axis=0)
        return whole

    def of_groups(self, groups: Sequence[int]) -> Octaves:
        """The same of some groups only, as one."""
        own = list(groups)
        products, lines = (sums[own].sum(axis=0, keepdims=True) for sums in (self.products, self.lines))
        return Octaves(products, lines, self.frequency)


def segments_of(rows: NDArray[np.intp], spans: NDArray[np.intp]) -> list[Segment]:
    """Cut rows, shape (m,), at the ends of contacts and at gaps; too short pieces are left out.

    Args:
        rows: sample of each row.
        spans: number of the contact of each row.
    """
    if not len(rows):
        return []
    step = int(np.median(np.diff(rows))) if len(rows) > 1 else 1
    cuts = np.flatnonzero((np.diff(rows) != step) | (np.diff(spans) != 0)) + 1
    edges = np.r_[0, cuts, len(rows)]
    pieces = [(int(a), int(b)) for a, b in zip(edges[:-1], edges[1:], strict=True) if b - a >= SHORTEST]
    numbers = np.unique([spans[a] for a, _ in pieces])
    share = max(-(-len(numbers) // MOST_GROUPS), 1)
    return [Segment(a, b, int(np.searchsorted(numbers, spans[a])) // share) for a, b in pieces]


def octave_of(frequency: Array, lowest: float) -> NDArray[np.intp]:
    """Number of each line's octave; the lowest has the first three lines of the longest segment."""
    return np.maximum(np.floor(np.log2(frequency / lowest * (1 + 1e-9))).astype(np.intp) - 1, 0)


def line_frequencies(count: int, dt: float) -> Array:
    """Of the cosines 1 to count - 1 of a segment [Hz]."""
    found: Array = np.arange(1, count) / (2 * count * dt)
    return found


def lowest_line(segments: Sequence[Segment], dt: float) -> float:
    """The lowest frequency of the longest segment [Hz], from which octaves are counted."""
    return 1 / (2 * max(s.last - s.first for s in segments) * dt)


def octaves_of(columns: Array, segments: Sequence[Segment], dt: float, lowest: float) -> Octaves:
    """Sum the products of columns, shape (m, p), by octave.

    Args:
        columns: at the rows that the segments count.
        segments: one at least.
        dt: from row to row [s].
        lowest: frequency from which octaves are counted [Hz].
    """
    from scipy.fft import dct

    count = int(octave_of(np.array([0.5 / dt]), lowest)[0]) + 1
    groups = max(s.group for s in segments) + 1
    p = columns.shape[1]
    products, lines = np.zeros((groups, count, p, p)), np.zeros((groups, count))
    for segment in segments:
        own = dct(columns[segment.first : segment.last], norm="ortho", axis=0)[1:]
        number = octave_of(line_frequencies(segment.last - segment.first, dt), lowest)
        edges = np.searchsorted(number, np.arange(count + 1))
        for octave in range(count):
            part = own[edges[octave] : edges[octave + 1]]
            products[segment.group, octave] += part.T @ part
            lines[segment.group, octave] += len(part)
    frequency = lowest * 2.0 ** (np.arange(count) + 1.5)
    frequency[0] = lowest * 1.7  # geometric middle of lines 1 to 3
    return Octaves(products, lines, frequency)
