"""Predictions for presses: duration of a touch, effect of noise, largest change of a surface."""

from __future__ import annotations

import numpy as np

from palpate.force.gains import Gains
from palpate.force.steps import Step
from palpate.force.stiffness_bound import SHOWED

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
    travel = gains.force / (stiffness * gains.arm.limits.speed)
    found = RISES * rise(gains, stiffness)
    return (
        LAGS * gains.theta
        + travel
        + DECAYS * damping / stiffness
        + found
        + LEVELS * level_time(gains, stiffness)
    )


def level_time(gains: Gains, stiffness: float) -> float:
    """Time from the touch until the force is above what the sensor may show in free motion, at the approach [s].

    Args:
        gains: of the loop.
        stiffness: K of the surface itself [N/m].
    """
    return 2.0 * gains.level / (gains.arm.seen(stiffness) * gains.approach)


def softest(gains: Gains) -> float:
    """The surface whose force rises by a standard deviation of the noise in a lag, at the approach's speed [N/m].

    On stiffer ones a touch is found as soon as it is felt: `settling_bound` holds without the noise's term.
    """
    felt = gains.arm.sensor.noise / (gains.approach * gains.theta)
    return gains.arm.surface(felt)


STIFFENING_AT = (0.05, 0.5)
"""Errors over F_d at which `stiffening` is said: at the edge of what is settled, and half-way up."""


def stiffening(gains: Gains, step: Step, error: float, overshoot: float = OVERSHOOT) -> float:
    """How many times stiffer, as felt, a surface may become while the force is so far below F_d.

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
