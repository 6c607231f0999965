"""How deep a surface must be pressed to bear a force."""

from __future__ import annotations

from typing import Any

from palpate.environments import SurfaceState
from palpate.errors import InputError

FIRST = 1e-6
"""Depth at which the search begins [m]."""
DEEPEST = 10.0
"""Depth at which it is given up [m]."""


def rest_for(surface: Any, force: float, rate: float) -> float:
    """Penetration [m] at which a surface that moves at a rate [m/s], relaxed, bears a force [N], inertia left out.

    Negative where the damping alone bears more than that.

    Raises:
        InputError: no depth within metres bears it.
    """
    from scipy.optimize import brentq

    def short(depth: float) -> float:
        return float(surface.force(SurfaceState(depth, rate, 0.0, 1.0), depth, rate)) - force

    bound = FIRST if short(0.0) < 0.0 else -FIRST
    while short(0.0) * short(bound) > 0.0:
        bound *= 2.0
        if abs(bound) > DEEPEST:
            raise InputError(
                f"no depth of the new surface bears the {force:g} N of the old one; change the surface"
            )
    return float(brentq(short, 0.0, bound, xtol=1e-18, rtol=1e-15))
