"""A force that stands at the end of its range while the probe moves on."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from palpate.arrays import Array, Mask
from palpate.signals.samples import runs

Rows = Mask

_FEWEST = 8
_RUN = 3
"""Equal readings in a row that count as standing still."""
_STEPS = 4.0
"""Steps of the reading's own resolution that the force should have changed by meanwhile, were it not at its limit."""


def at_limit(force: Array, place: Array, levels: Iterable[float], among: Rows | None = None) -> Rows:
    """Rows in unbroken stretches of exactly one force while the probe moves on, shape (n,).

    The probe moves on if, at the slope of the whole log, the force should have changed by more than its resolution.

    Args:
        force: of one axis [N], shape (n,).
        place: of the probe [m], shape (n,) or (n, 3); NaN where there is no reading.
        levels: the forces that may be an end of the range [N].
        among: rows that count, shape (n,); all if not given.
    """
    stuck = np.zeros(len(force), bool)
    rows = np.arange(len(force)) if among is None else np.flatnonzero(among)
    step = np.abs(np.diff(force[rows]))
    if not step.any():
        return stuck
    resolution = float(np.percentile(step[step > 0], 5))
    far = _STEPS * resolution * _travel(place) / max(float(np.ptp(force[rows])), 1e-300)
    for level in levels:
        for begin, end in runs(force[rows] == level):
            own = rows[begin:end]
            if len(own) >= _RUN and _travel(place[own[0] : own[-1] + 1]) > far:
                stuck[own] = True
    return stuck if stuck.sum() >= _FEWEST else np.zeros(len(force), bool)


def _travel(place: Array) -> float:
    """How far the probe gets [m]."""
    place = place.reshape(len(place), -1)
    there = place[np.isfinite(place).all(axis=1)]
    return float(np.linalg.norm(np.ptp(there, axis=0))) if len(there) else 0.0
