"""What first touches are expected to come to: how long one takes, and from which stiffness on noise does not matter."""

from __future__ import annotations

from palpate.force.gains import Gains

LAGS, DECAYS, RISES = 8.0, 4.0, 5.0
"""Lags of the loop, B/K, and times in which a surface rises out of the noise, that a first touch takes at most.

Measured by benchmarks/force/first_touches.py, where more than 99.9 % of all touches keep to their sum.
"""
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
    """Time from the touch in which more than 99 % of first touches settle within 5 % [s].

    Args:
        gains: of the loop.
        stiffness: K of the surface itself [N/m].
        damping: B [N s/m].
    """
    travel = gains.force / (stiffness * gains.arm.limits.speed)
    found = RISES * rise(gains, stiffness)
    return LAGS * gains.theta + travel + DECAYS * damping / stiffness + found


def softest(gains: Gains) -> float:
    """The surface whose force rises by a standard deviation of the noise in a lag, at the approach's speed [N/m].

    On stiffer ones a touch is found as soon as it is felt: `settling_bound` holds without its last term.
    """
    felt = gains.arm.sensor.noise / (gains.approach * gains.theta)
    return gains.arm.surface(felt)
