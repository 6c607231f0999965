"""theta: the whole lag of an arm's force loop in one number."""

from __future__ import annotations

from dataclasses import replace
from math import pi

import numpy as np

from palpate.errors import InputError
from palpate.force.arm import Arm, PositionLoop
from palpate.force.boundary import stable_between
from palpate.force.sampled_loop import Law, SampledLoop

SOFTEST = 1.0
"""From where on stiffnesses are looked at [N/m]; below it a torque arm's loop does not change any more."""
_POINTS = 40


def ultimate_gain(loop: SampledLoop, stiffness: float, damping: float = 0.0, kept: float = 0.0) -> float:
    """g K_eff at which the loop on this surface starts to grow [1/s].

    Args:
        loop: of the arm.
        stiffness: K; for a position arm K_eff [N/m].
        damping: B [N s/m].
        kept: of the command's low-pass, see `Law`.
    """
    seen = stiffness if loop.arm.kind == "position" else loop.arm.seen(stiffness)
    start = loop.phi(stiffness, damping, Law(0.0, kept))
    found = stable_between(start, loop.phi(stiffness, damping, Law(1.0 / seen, kept)))
    if not found or found[0][0] > 0.0:
        raise InputError(
            f"{loop.arm.title}: its own loop is not stable on a surface of {stiffness:g} N/m; "
            "raise the damping, or lower the stiffness, in [inner]"
        )
    return found[0][1]


def lag_of(arm: Arm) -> float:
    """theta [s]: a pure delay pi/(2 theta) of the same ultimate gain, on the surface where that is lowest.

    An inner loop that is known to intervals counts as the slowest of what it may be.

    The sum of all lags would be longer for some arms and shorter for others; what the gain may be is decided by the
    ultimate gain alone. For a position arm that is one number; for a torque arm it depends on the stiffness.
    """
    loop = SampledLoop(arm)
    if isinstance(arm.inner, PositionLoop):
        return pi / 2.0 / min(ultimate_gain(replace(loop, inner=c), arm.series) for c in arm.inner.corners)
    stiffnesses = np.geomspace(SOFTEST, arm.limits.stiffness, _POINTS)
    return pi / 2.0 / min(ultimate_gain(loop, float(k)) for k in stiffnesses)


def sum_of_lags(arm: Arm) -> float:
    """The lags of inner loop, delays, sensor and hold added up, as an engineer would [s]."""
    inner = arm.inner
    own = inner.damping / (pi * inner.bandwidth if isinstance(inner, PositionLoop) else inner.stiffness)
    return own + inner.delay + arm.low_pass.lag + 0.5 / arm.sensor.sampling + 0.5 * arm.tick
