"""theta: the whole lag of an arm's force loop in one number."""

from __future__ import annotations

from dataclasses import replace
from math import pi, sqrt

import msgspec
import numpy as np
from numpy.typing import NDArray

from palpate.arrays import Array
from palpate.errors import InputError
from palpate.force.arm import Arm, PositionLoop, ServoLoop
from palpate.force.boundary import stable_between
from palpate.force.sampled_loop import SampledLoop, law_for

SOFTEST = 1.0
"""From where on stiffnesses are looked at [N/m]; below it a torque arm's loop does not change any more."""
_POINTS = 40
STRUCTURE = 0.05
"""Damping ratio of a drive train's own spring, typical of strain-wave gears."""


def ultimate_gain(loop: SampledLoop, stiffness: float, damping: float = 0.0) -> float:
    """g K_eff at which the loop on this surface starts to grow [1/s], with a servo's lead for its stiffness.

    Args:
        loop: of the arm.
        stiffness: K; for a position arm K_eff [N/m].
        damping: B [N s/m].
    """
    seen = stiffness if loop.arm.kind == "position" else loop.arm.seen(stiffness)
    start, unit = (law_for(loop.arm, g, stiffness) for g in (0.0, 1.0 / seen))
    found = stable_between(loop.phi(stiffness, damping, start), loop.phi(stiffness, damping, unit))
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
        lag = pi / 2.0 / min(ultimate_gain(replace(loop, inner=c), arm.series) for c in arm.inner.corners)
        return lag if arm.inner.mass is None else lag * swinging(arm, lag)
    return pi / 2.0 / ultimate_gain(loop, worst_stiffness(arm))


def worst_stiffness(arm: Arm) -> float:
    """The surface on which the ultimate gain of an arm that yields is lowest [N/m]."""
    loop, stiffnesses = SampledLoop(arm), np.geomspace(SOFTEST, arm.limits.stiffness, _POINTS)
    return min((float(k) for k in stiffnesses), key=lambda k: ultimate_gain(loop, k))


def yielding_lag(arm: Arm, tip: ServoLoop, stiffness: float) -> float:
    """Lag of the loop on a surface [s] whose law is for the servo in the arm's file, while this one acts.

    The delay is the tip's, and need not be whole ticks: between two of them the lag is a straight line.
    """
    ticks = tip.delay * arm.rate
    whole = int(ticks)
    inner = msgspec.structs.replace(arm.inner, delay=whole * arm.tick)
    loop = SampledLoop(msgspec.structs.replace(arm, inner=inner), tip=tip)
    less, more = (pi / 2.0 / ultimate_gain(loop.later(extra), stiffness) for extra in (0, 1))
    return less + (ticks - whole) * (more - less)


def swinging(arm: Arm, lag: float) -> float:
    """By what a tip whose mass swings on a position arm's own stiffness lowers the ultimate gain, at least 1.

    From the answer without it to that with it, on the surface where it is lowest; by the loop as it is between ticks,
    of which only the ratio is used.
    """
    inner = arm.inner
    assert isinstance(inner, PositionLoop)
    assert inner.mass is not None
    own, m = inner.stiffness, inner.mass
    w: Array = np.geomspace(0.1, 100.0, 20_000) / lag  # half a turn of a delay is at pi/2
    s = 1j * w
    square, rate = inner.squared
    late = arm.longest_delay + 0.5 / arm.sensor.sampling + 1.5 * arm.tick
    rigid = square / (s * s + rate * s + square) * arm.low_pass.at(w) * np.exp(-late * s) / s
    damping = 2.0 * STRUCTURE * sqrt(own * m)
    stiffnesses = np.geomspace(1e-3 * own, arm.limits.stiffness, _POINTS)
    felt = [(own + damping * s) * (1.0 + k / own) / (m * s * s + damping * s + own + k) for k in stiffnesses]
    return max(1.0, *(_largest(rigid * f) / _largest(rigid) for f in felt))


def _largest(answer: NDArray[np.complex128]) -> float:
    """Of an open loop where it turns the phase by half a turn: one over its ultimate gain."""
    a, b = answer[:-1], answer[1:]
    return float(np.abs(a[(a.imag * b.imag <= 0.0) & (a.real < 0.0)]).max())


def sum_of_lags(arm: Arm) -> float:
    """The lags of inner loop, delays, sensor and hold added up, as an engineer would [s]."""
    inner = arm.inner
    own = inner.damping / (pi * inner.bandwidth if isinstance(inner, PositionLoop) else inner.stiffness)
    return own + inner.delay + arm.low_pass.lag + 0.5 / arm.sensor.sampling + 0.5 * arm.tick
