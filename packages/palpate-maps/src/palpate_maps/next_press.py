"""Where to press next: the place that takes most off the weighted variance of the field (Picheny et al. 2010)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.spatial.distance import cdist
from scipy.stats import norm

from palpate.arrays import Array
from palpate.errors import InputError

Goal = Literal["interval", "edge", "maximum"]


@dataclass(frozen=True)
class NextPresses:
    """Places to press next, in order; an array of them where one is wanted.

    Args:
        places: (count, d) [m].
        expected_half: half-width of the 95 % interval of the stiffness there after these presses (count,) [N/m].
    """

    places: Array
    expected_half: Array

    def __len__(self) -> int:
        return len(self.places)

    def __array__(self, dtype: object = None, copy: object = None) -> Array:
        return np.array(self.places, dtype=float)


def importance(goal: Goal, mean: Array, variance: Array, threshold: float | None) -> Array:
    """How much the variance at each place counts (m,).

    Args:
        goal: the interval counts everywhere alike; an edge half so, for lumps not yet found, and half by the density
            of the field at the threshold (Picheny et al. 2010, eq. 8); the maximum by the probability to exceed the
            largest mean.
        mean: of the field's logarithm (m,).
        variance: of the field's logarithm (m,).
        threshold: logarithm of the edge's stiffness.
    """
    std = np.sqrt(np.maximum(variance, 1e-12))
    match goal:
        case "interval":
            return np.ones(len(mean))
        case "edge":
            if threshold is None:
                raise InputError(
                    "an edge is where the stiffness crosses a threshold; name it with --stiffer-than"
                )
            density = norm.pdf(threshold, mean, std)
            return 1.0 + density / max(float(density.mean()), 1e-300)
        case "maximum":
            return np.asarray(norm.sf(mean.max(), mean, std))


def choose(
    covariance: Array, weights: Array, noise: float, cost: Array | None = None
) -> Iterator[tuple[int, Array]]:
    """Choose places one after the other, each by what it takes off the weighted variance given those before.

    Args:
        covariance: of the field at the candidates (m, m).
        weights: of the candidates' variances (m,).
        noise: variance of one press.
        cost: of going from a candidate to another (m, m), relative to that of a press; the last row is from where the
            robot stands.

    Yields:
        The next candidate, and the variance at each candidate after a press there (m,).
    """
    left, last = covariance, -1
    while True:
        gain = np.einsum("i,ij,ij->j", weights, left, left) / (np.diag(left) + noise)
        if cost is not None:
            gain = gain / (1.0 + cost[last])
        last = int(np.argmax(gain))
        column = left[:, last] / np.sqrt(left[last, last] + noise)
        yield last, np.maximum(np.diag(left) - column**2, 0.0)
        left = left - np.outer(column, column)


def travel(candidates: Array, start: Array | None, speed: float) -> Array:
    """Cost of each way (m + 1, m): its length over what the robot travels in the time of one press.

    Args:
        candidates: (m, d) [m].
        start: where the robot stands (d,) [m]; None where it does not matter.
        speed: way in the time of one press [m].
    """
    origin = np.zeros((1, len(candidates))) if start is None else cdist(start[None], candidates)
    return np.vstack([cdist(candidates, candidates), origin]) / speed
