"""theta, the whole lag of an arm's force loop in one number; and how close the loop comes to growing."""

from __future__ import annotations

from dataclasses import replace
from math import inf, pi, sqrt

import msgspec
import numpy as np
from numpy.typing import NDArray

from palpate.arrays import Array
from palpate.errors import InputError
from palpate.force.arm import Arm, PositionLoop, ServoLoop
from palpate.force.boundary import rank_one, stable_between
from palpate.force.sampled_loop import SampledLoop, law_for

MIN_STIFFNESS = 1.0
"""Lowest stiffness that is tried [N/m]; below it a torque arm's loop does not change any more."""
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
    series = stiffness if loop.arm.kind == "position" else loop.arm.seen(stiffness)
    start, unit = (law_for(loop.arm, g, stiffness) for g in (0.0, 1.0 / series))
    intervals = stable_between(loop.phi(stiffness, damping, start), loop.phi(stiffness, damping, unit))
    if not intervals or intervals[0][0] > 0.0:
        raise InputError(
            f"{loop.arm.title}: its own loop is not stable on a surface of {stiffness:g} N/m; "
            "raise the damping, or lower the stiffness, in [inner]"
        )
    return intervals[0][1]


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
    loop = SampledLoop(arm)
    stiffnesses = np.geomspace(MIN_STIFFNESS, arm.limits.stiffness, _POINTS)
    return min((float(k) for k in stiffnesses), key=lambda k: ultimate_gain(loop, k))


def yielding_lag(arm: Arm, tip: ServoLoop, stiffness: float) -> float:
    """Lag of the loop on a surface [s] whose law is for the servo in the arm's file, while this one acts.

    The delay is the tip's, and need not be whole ticks: between two of them the lag is a straight line.
    """
    ticks = tip.delay * arm.rate
    whole_ticks = int(ticks)
    inner = msgspec.structs.replace(arm.inner, delay=whole_ticks * arm.tick)
    loop = SampledLoop(msgspec.structs.replace(arm, inner=inner), tip=tip)
    less, more = (pi / 2.0 / ultimate_gain(loop.later(extra), stiffness) for extra in (0, 1))
    return less + (ticks - whole_ticks) * (more - less)


def swinging(arm: Arm, lag: float) -> float:
    """Factor by which a tip mass that swings on a position arm's stiffness lowers the ultimate gain, at least 1.

    From the answer without it to that with it, on the surface where it is lowest; by the loop as it is between ticks,
    of which only the ratio is used.
    """
    inner = arm.inner
    assert isinstance(inner, PositionLoop)
    assert inner.mass is not None
    stiffness = inner.stiffness
    m = inner.mass
    w: Array = np.geomspace(0.1, 100.0, 20_000) / lag  # half a turn of a delay is at pi/2
    s = 1j * w
    square, rate = inner.squared
    late = arm.longest_delay + 0.5 / arm.sensor.sampling + 1.5 * arm.tick
    rigid = square / (s * s + rate * s + square) * arm.low_pass.at(w) * np.exp(-late * s) / s
    damping = 2.0 * STRUCTURE * sqrt(stiffness * m)
    stiffnesses = np.geomspace(1e-3 * stiffness, arm.limits.stiffness, _POINTS)
    drive = stiffness + damping * s
    responses = [
        drive * (1.0 + k / stiffness) / (m * s * s + damping * s + stiffness + k) for k in stiffnesses
    ]
    return max(1.0, *(_largest(rigid * f) / _largest(rigid) for f in responses))


def _largest(answer: NDArray[np.complex128]) -> float:
    """Largest size of an open loop at a phase of half a turn: one over its ultimate gain."""
    a = answer[:-1]
    b = answer[1:]
    return float(np.abs(a[(a.imag * b.imag <= 0.0) & (a.real < 0.0)]).max())


def sum_of_lags(arm: Arm) -> float:
    """The lags of inner loop, delays, sensor and hold added up, as an engineer would [s]."""
    inner = arm.inner
    inner_lag = inner.damping / (pi * inner.bandwidth if isinstance(inner, PositionLoop) else inner.stiffness)
    return inner_lag + inner.delay + arm.low_pass.lag + 0.5 / arm.sensor.sampling + 0.5 * arm.tick


MAX_SENSITIVITY = 1.66
"""Largest sensitivity |1/(1 + L)| on any surface: that of alpha = 0.48 where all of the lag is delay."""
MAX_RELIEF = 0.3
"""Largest rho: g theta K_eff/alpha is then at most 1.43 where K_u is K; the proof of the adapting law allows 2."""
_FREQUENCIES = 120
_STIFFNESSES = 12


def sensitivity(loop: SampledLoop, gain: float, stiffness: float, damping: float = 0.0) -> float:
    """Largest |1/(1 + L)| on a surface; infinite where the loop grows.

    Args:
        loop: of the arm.
        gain: g [m/(s N)].
        stiffness: K, for a position arm as felt [N/m].
        damping: B [N s/m].
    """
    start, closed = (loop.phi(stiffness, damping, law_for(loop.arm, g, stiffness)) for g in (0.0, gain))
    if np.abs(np.linalg.eigvals(closed)).max() >= 1.0:
        return inf
    b, c = rank_one(closed - start)
    z = np.exp(1j * np.geomspace(1e-3, 0.9 * np.pi, _FREQUENCIES))
    inner = np.linalg.solve(z[:, None, None] * np.eye(loop.size) - start, b.astype(complex)[None, :, None])[
        ..., 0
    ]
    return float(np.abs(1.0 / (1.0 - inner @ c)).max())


def relief_of(arm: Arm, theta: float, alpha: float) -> float:
    """Relief rho: on a surface of stiffness K the lag is shorter by this fraction times (K + K_s/2)/(K + K_s).

    Most of the lag of an arm that yields is its spring and damper, K_s and D, not delay, and the stiffer the surface
    beside the spring, the shorter it is. The largest fraction that keeps the sensitivity below `MAX_SENSITIVITY` on
    every stiffness; 0 for a position arm, whose tip does not feel the surface.

    Args:
        arm: what moves.
        theta: [s].
        alpha: gain in units of 1/theta.
    """
    if arm.kind == "position":
        return 0.0
    loop = SampledLoop(arm)
    relief = MAX_RELIEF
    for K in np.geomspace(0.01 * arm.series, arm.limits.stiffness, _STIFFNESSES).tolist():
        part = (K + 0.5 * arm.series) / (K + arm.series)
        unit = alpha / theta * (1.0 / arm.series + 1.0 / K)
        while relief > 0.0 and sensitivity(loop, unit / (1.0 - relief * part), K) > MAX_SENSITIVITY:
            relief = max(relief - 0.02, 0.0)
    return relief
