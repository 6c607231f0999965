"""The level of a force in the air: where the position moves and the force does not follow.

Over the position, a force is flat up to the touch and rises from there on. A probe that never leaves has no such bend,
and a spring that only hardens has one without a flat side.
"""

from __future__ import annotations

import numpy as np

from palpate.arrays import Array, Mask
from palpate.contact_frame.free_motion.inertia import CHANCE
from palpate.contact_frame.vectors import FEWEST

_ENOUGH = 4000
"""Rows that are looked at, of a longer log evenly: that is a matter of time, not of what is found."""
_PLACES = np.linspace(0.05, 0.95, 37)
"""Of a bend, as shares of the stroke."""
_BENT = CHANCE ** (2.0 / (2 * FEWEST - 3))
"""Share of a straight line's misfit that a bend, one number more, leaves by chance once in a thousand logs of the
fewest independent rows, by Fisher's distribution with 2 degrees of freedom."""
_FLAT = 0.05
"""Of the slope beyond the bend: a spring whose force grows as the penetration to the third power shows 0.14."""


def free_level(force: Array, position: Array) -> float | None:
    """The force [N] of the flat side of a bend; None if there is no bend with one flat side.

    Args:
        force: along the axis in which it changes most [N], shape (n,); NaN where there is no reading.
        position: likewise [m], shape (n,).
    """
    there = np.isfinite(force + position)
    every = slice(None, None, max(1, int(there.sum()) // _ENOUGH))
    force, position = force[there][every], position[there][every]
    low, high = float(position.min()), float(position.max())
    if not high > low:
        return None
    bends = [
        min(
            (_misfit_of_bend(force, side * (position - low - share * (high - low))), side, share)
            for share in _PLACES
        )
        for side in (1.0, -1.0)
    ]
    best, other = sorted(bends)
    if best[0] > _BENT * min(_misfit(force, position), other[0]):
        return None
    _, side, share = best
    flat = side * (position - low - share * (high - low)) < 0
    return float(np.median(force[flat])) if _is_flat(force, position, flat) else None


def _misfit_of_bend(force: Array, beyond: Array) -> float:
    """Misfit of a force that is flat up to a place and straight beyond."""
    return _misfit(force, np.maximum(beyond, 0.0))


def _misfit(force: Array, regressor: Array) -> float:
    """Sum of squares that a straight line leaves."""
    x, f = regressor - regressor.mean(), force - force.mean()
    return float(f @ f - (x @ f) ** 2 / max(float(x @ x), 1e-300))


def _is_flat(force: Array, position: Array, flat: Mask) -> bool:
    """Whether the force does not follow the position on one side, measured by how it does on the other."""
    if min(flat.sum(), (~flat).sum()) < FEWEST or not (np.ptp(position[flat]) and np.ptp(position[~flat])):
        return False
    slopes = [abs(float(np.polyfit(position[side], force[side], 1)[0])) for side in (flat, ~flat)]
    return slopes[0] < _FLAT * slopes[1]
