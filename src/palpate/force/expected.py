"""Predictions for presses: the linear loop's steps and margins, a touch's duration, effect of noise, largest change."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, log, pi

import numpy as np
from numpy.typing import NDArray

from palpate.arrays import Array
from palpate.force.boundary import rank_one
from palpate.force.ceiling import residual_travel
from palpate.force.gains import Gains
from palpate.force.lag import ultimate_gain
from palpate.force.sampled_loop import SampledLoop, law_for
from palpate.force.stiffness_bound import SHOWED
from palpate.units import quantity

LAGS, DECAYS, RISES, LEVELS = 8.0 + 0.5 * SHOWED, 4.0, 5.0, 3.0
"""Lags of the loop, B/K, times in which a surface rises out of the noise, and in which it comes to the level, that a
first touch takes at most; a ramp comes to `SHOWED` times its rise in half a lag in half as many lags.
Measured by benchmarks/force/first_touches.py, where 99.9 % of the touches that settle in its 4 s keep to their sum."""
OVERSHOOT = 0.1
"""Over F_d, that at most one in a thousand first touches passes; from the same."""


def rise(gains: Gains, stiffness: float) -> float:
    """Time in which a surface rises out of the noise at the approach's speed [s].

    A ramp of slope s in n readings a second of deviation sigma has energy s^2 n t^3/(3 sigma^2); before that is some
    ten no law can tell it from none. The unit is (sigma^2/(n s^2))^(1/3), s = K_eff v.

    Args:
        gains: of the loop.
        stiffness: K of the surface itself [N/m].
    """
    sensor = gains.arm.sensor
    slope = gains.arm.seen(stiffness) * gains.approach
    return float((sensor.noise**2 / (sensor.sampling * slope**2)) ** (1.0 / 3.0))


def settling_bound(gains: Gains, stiffness: float, damping: float = 0.0) -> float:
    """Time from the touch in which 99 % of first touches settle within 5 % [s].

    Args:
        gains: of the loop.
        stiffness: K of the surface itself [N/m].
        damping: B [N s/m].
    """
    travel = gains.force / (stiffness * gains.speed)
    rise_time = RISES * rise(gains, stiffness)
    return (
        LAGS * gains.theta
        + travel
        + DECAYS * damping / stiffness
        + rise_time
        + LEVELS * level_time(gains, stiffness)
    )


def level_time(gains: Gains, stiffness: float) -> float:
    """Time from the touch until the force is above what the sensor may show in free motion, at the approach [s].

    Args:
        gains: of the loop.
        stiffness: K of the surface itself [N/m].
    """
    return 2.0 * gains.level / (gains.arm.seen(stiffness) * gains.approach)


BAND = 0.05
"""Error over F_d within which a press counts as settled."""
SOFT_TISSUE = 300.0
"""Stiffness of soft foam and tissue [N/m], for which a press is predicted where nothing is known of the surface."""


@dataclass(frozen=True)
class PressTime:
    """Time from the touch of a soft surface until the force stays within 5 %.

    Args:
        stiffness: K of the surface [N/m].
        least: that any law with this F_max takes [s]; None without F_max.
        usual: within which 99 % of first touches settle [s].
        most: bound on a spring while K_u is at most the cap [s]: K_u stays that high where the surface rises so slowly
            that it passes for a drift of the sensor, or has hidden something hard.
    """

    stiffness: float
    least: float | None
    usual: float
    most: float

    def __str__(self) -> str:
        """Give the times in words, to be read after the F_max."""
        usual, most = quantity(self.usual, "s"), quantity(self.most, "s")
        least = (
            ""
            if self.least is None
            else f"; no law with this F_max takes less than {quantity(self.least, 's')}"
        )
        surface = quantity(self.stiffness, "N/m")
        return (
            f"the press takes up to {usual} on {surface}, and up to {most} where that passes for a drift of the sensor,"
            f" or hid something hard{least}"
        )


def press_time(gains: Gains, stiffness: float = SOFT_TISSUE) -> PressTime:
    """Predict the time of a press on a soft surface without damping.

    The speed is at least min(approach, g (F_d - F)) with the gain g at the cap, so that the force comes nearer in
    proportion to the error at least. The lower bound is that of a speed of (F_max - F)/(K_eff Theta): no momentum.

    Args:
        gains: of the loop.
        stiffness: K of the surface itself [N/m].
    """
    arm, felt = gains.arm, gains.arm.seen(stiffness)
    force, limit = gains.force, gains.force_max
    error = min(gains.approach / gains.gain, force)  # from which the gain decides, no more the approach
    most = (
        LAGS * gains.theta
        + (force - error) / (felt * gains.approach)
        + log(error / (BAND * force)) / (felt * gains.gain)
    )
    least = None
    if limit is not None:
        slowness = arm.seen(gains.cap) * residual_travel(arm) / felt
        least = float(slowness * log(limit / (limit - (1.0 - BAND) * force)))
    return PressTime(stiffness, least, settling_bound(gains, stiffness), float(most))


def softest(gains: Gains) -> float:
    """The surface whose force rises by a standard deviation of the noise in a lag, at the approach's speed [N/m].

    On stiffer ones a touch is found as soon as it is felt: `settling_bound` holds without the noise's term.
    """
    felt = gains.arm.sensor.noise / (gains.approach * gains.theta)
    return gains.arm.surface(felt)


STIFFENING_AT = (0.05, 0.5)
"""Errors over F_d at which `stiffening` is said: at the edge of what is settled, and half-way up."""


def stiffening(gains: Gains, step: Step, error: float, overshoot: float = OVERSHOOT) -> float:
    """Largest factor by which a surface may stiffen, as felt, while the force is so far below F_d.

    For a lag theta whatever comes is decided by readings of before, so that the tip goes on as it would have: on a
    surface n times stiffer the force then rises n times as far, by n (F(t + theta) - F(t)). theta stands for the whole
    lag, so that this is what to expect and no bound: half as stiff is below `overshoot`, twice as stiff above
    (benchmarks/force/disturbed.py).

    Args:
        gains: of the loop.
        step: the press on the surface as it was.
        error: over F_d, when the surface changes.
        overshoot: over F_d.
    """
    at = int(np.argmax(step.force > 1.0 - error))
    later = np.interp(step.time[at] + gains.theta, step.time, step.force)
    return float((overshoot + error) / (later - step.force[at]))


@dataclass(frozen=True)
class Step:
    """The force after a touch, or a step, without noise.

    Args:
        time: [s], shape (n,).
        force: over F_d, shape (n,).
    """

    time: Array
    force: Array

    @property
    def overshoot(self) -> float:
        """Overshoot beyond the desired force, over F_d."""
        return max(float(self.force.max()) - 1.0, 0.0)

    @property
    def settling(self) -> float:
        """Time at which the force enters the band for good [s]; infinite if it does not."""
        outside = np.flatnonzero(np.abs(self.force - 1.0) > BAND)
        if len(outside) == len(self.force) or (len(outside) and outside[-1] == len(self.force) - 1):
            return inf
        return float(self.time[outside[-1] + 1]) if len(outside) else 0.0


@dataclass(frozen=True)
class Margins:
    """Stability margins of the loop.

    Args:
        gain: factor.
        phase: [deg].
        delay: [s].
    """

    gain: float
    phase: float
    delay: float


def step_of(gains: Gains, bound: float, held: float | None = None) -> Step:
    """The force on a surface without damping of this stiffness, as felt.

    Args:
        gains: of the loop.
        bound: K [N/m].
        held: K_u in use; the surface's own K if left out [N/m].
    """
    loop = SampledLoop(gains.arm)
    used = bound if held is None else held
    g = gains.gain_at(used)
    Phi = loop.phi(bound, 0.0, law_for(gains.arm, g, used))
    reading = np.zeros(loop.size)
    reading[0] = bound / loop.force_unit
    slowest = gains.theta / gains.alpha * max(gains.gain_at(bound) / g, 1.0)
    n = int(min(12.0 * slowest * gains.arm.rate, 20000.0))
    # About the state of rest under F_d: it starts from no force, all else at rest.
    x = np.zeros(loop.size)
    tip = -loop.force_unit / bound
    x[0] = tip
    p = 2 + len(loop.low_pass[1])
    if p > 2:
        x[2] = -1.0
    x[p : p + loop.lines[0]] = -1.0
    first = p + loop.lines[0] + 1
    series = loop.arm.seen(bound) if loop.arm.kind != "position" else bound
    x[first : first + loop.lines[1]] = -loop.force_unit / series
    if loop.arm.kind == "torque":
        x[first + 1 : first + loop.lines[1]] = -1.0
    force = np.empty(n)
    for k in range(n):
        force[k] = 1.0 + float(reading @ x)
        x = Phi @ x
    return Step(np.arange(n) / gains.arm.rate, force)


def frequency_response(gains: Gains, bound: float) -> tuple[Array, NDArray[np.complex128]]:
    """Frequencies [Hz] and the open loop on a surface of this stiffness, K_u being just that."""
    loop = SampledLoop(gains.arm)
    start, closed = (loop.phi(bound, 0.0, law_for(gains.arm, g, bound)) for g in (0.0, gains.gain_at(bound)))
    b, c = rank_one(closed - start)
    low = 0.01 / gains.theta / (2.0 * pi)
    high = 0.5 * gains.arm.rate
    frequencies = np.geomspace(low, high, 2000)
    z = np.exp(2j * pi * frequencies / gains.arm.rate)
    eye = np.eye(loop.size)
    return frequencies, np.array([-(c @ np.linalg.solve(v * eye - start, b)) for v in z])


def margins(gains: Gains, bound: float) -> Margins:
    """Stability margins on a surface of this stiffness, with K_u equal to it."""
    ultimate = ultimate_gain(SampledLoop(gains.arm), bound)
    series = bound if gains.arm.kind == "position" else gains.arm.seen(bound)
    gain = ultimate / (gains.gain_at(bound) * series)
    frequencies, L = frequency_response(gains, bound)
    above = np.abs(L) >= 1.0
    crossing = np.flatnonzero(above[:-1] & ~above[1:])
    phase = [180.0 + float(np.degrees(np.unwrap(np.angle(L)))[i + 1]) for i in crossing]
    if not phase:
        return Margins(gain, inf, inf)
    delays = [max(p, 0.0) / 360.0 / float(frequencies[i + 1]) for p, i in zip(phase, crossing, strict=True)]
    return Margins(gain, min(phase), min(delays))
