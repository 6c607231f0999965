"""F_max: the speed that keeps the force below one stated number, on layers and after any signal in free motion.

Theorem. The surface is at rest, unstressed and without mass; its force is a function of the depth that grows by at most
K per metre, in layers or not, or K and a damper with K + B/theta at most the cap. From the first reading at or above
F_d on the commanded speed is not positive, and it never exceeds v. A reading differs from the force, low-passed and as
old as the sensor's samples, by at most epsilon. Then

    F <= F_d + epsilon + (K_eff Theta + D + M) v

Theta [s] is the largest residual travel per unit of speed: what the tip still moves after the command has become zero,
seen from the last reading below F_d (`residual_travel`); D v is a damper's part, M v a mass's. Proof: docs/proofs.md.
M = sqrt(K m) is the momentum of one impact, and a margin: repeated impacts in step with the loop are not in it.
"""

from __future__ import annotations

from functools import lru_cache
from math import sqrt

import numpy as np

from palpate.arrays import Array
from palpate.force.arm import Arm, PositionLoop
from palpate.force.sampled_loop import filter_of

LATE_TICKS = 1
"""Ticks by which a reading, or a command, may be later than arm and sensor state: the jitter of one tick that a
certificate of an adapting loop covers."""
_STEPS = 12
"""Points of the sensor's low-pass in a tick of the loop or in a millisecond, whichever is shorter."""
_DECAYS = 12.0
"""Decay times of the low-pass and of the inner loop that are summed: e^-12 of them is left."""
_TIMES = 40
"""Times after the last command at which the travel is looked at."""


def speed_ceiling(arm: Arm, force: float, force_max: float, error: float, cap: float, theta: float) -> float:
    """Largest commanded speed with which the force stays below F_max [m/s]; not above 0 where none does.

    Args:
        arm: what moves.
        force: F_d [N].
        force_max: F_max [N].
        error: epsilon, largest difference of a reading from the low-passed force after the touch [N].
        cap: stiffest surface, K + B/theta [N/m].
        theta: whole lag of the loop, by which the cap counts damping [s].
    """
    return (force_max - force - error) / force_per_speed(arm, cap, theta)


@lru_cache(maxsize=64)
def force_per_speed(arm: Arm, cap: float, theta: float) -> float:
    """Largest force beyond the last reading below F_d, per unit of commanded speed: K_eff Theta + D + M [N s/m].

    Stiffness and damping share the cap, and the force is linear in both: the worse of a spring and of a damper counts.
    Neither exceeds the series stiffness, on which the commanded position acts.
    """
    travel, low_pass = residual_travel(arm), _low_pass(arm)
    spring = arm.seen(cap) * travel
    damper = theta * cap * (1.0 + float(np.sum(np.abs(low_pass[1])))) * _overshoot(arm)
    mass = arm.inner.mass
    momentum = 0.0 if mass is None else sqrt(cap * mass)
    return max(spring, min(damper, arm.series * travel)) + momentum


def residual_travel(arm: Arm) -> float:
    """Theta [s]: the largest distance, over all commands up to a speed, from where a reading below F_d was taken.

    The reading is the low-passed force of up to `sensor_ticks` ago. The command goes on for a tick after it; then the
    tip still comes after by the inner loop's lag and delay. Every command between the two signs is admitted, so that
    an overshoot of the inner loop counts, too; of its intervals the worst corner.
    """
    ages, weights = _low_pass(arm)
    begin = -(arm.sensor_ticks + LATE_TICKS) * arm.tick - ages
    late = arm.delay_ticks * arm.tick
    inner = arm.inner
    if not isinstance(inner, PositionLoop):
        # A spring and a damper: the tip comes after by D/K_s, beyond a delay that every command has.
        return inner.damping / inner.stiffness + _travel(begin, weights, arm.tick, late, None)
    return max(_travel(begin, weights, arm.tick, late, corner) for corner in inner.corners)


def _travel(
    begin: Array, weights: Array, tick: float, late: float, corner: tuple[float, float] | None
) -> float:
    """Sum over the ages of the low-pass of the travel since then, each by its weight, at the worst later time."""
    settled = 0.0 if corner is None else _DECAYS / _decay(corner)
    count = int((late + settled - float(begin[-1])) / tick) + 2
    sent = -tick * np.arange(count)  # times of the commands that may be positive; the last is at 0
    before = _step(begin[:, None] - sent - late, corner)
    worst = 0.0
    for end in np.linspace(0.0, late + settled, _TIMES):
        travel = tick * np.abs(_step(end - sent - late, corner) - before).sum(axis=1)
        worst = max(worst, float(np.abs(weights) @ travel))
    return worst


def _step(time: Array, corner: tuple[float, float] | None) -> Array:
    """Answer of the inner loop to a step at 0: w^2/(s^2 + 2 z w s + w^2), or the step itself."""
    t = np.maximum(time, 0.0)
    if corner is None:
        return (time >= 0.0).astype(float)
    square, rate = corner
    a, c = 0.5 * rate, np.sqrt(complex(0.25 * rate**2 - square))
    if abs(c) < 1e-6 * a:
        return 1.0 - np.exp(-a * t) * (1.0 + a * t)
    answer = 1.0 - np.exp(-a * t) * (np.cosh(c * t) + a / c * np.sinh(c * t))
    return np.asarray(answer.real)


def _decay(corner: tuple[float, float]) -> float:
    """Slowest rate at which the inner loop's answer decays [1/s]."""
    square, rate = corner
    return 0.5 * rate - sqrt(max(0.25 * rate**2 - square, 0.0))


def _overshoot(arm: Arm) -> float:
    """Largest speed of the tip over that of the command."""
    inner = arm.inner
    if not isinstance(inner, PositionLoop):
        return 1.0
    worst = 1.0
    for corner in inner.corners:
        time = np.linspace(0.0, _DECAYS / _decay(corner), 4000)
        worst = max(worst, float(np.abs(np.diff(_step(time, corner))).sum()))
    return worst


@lru_cache(maxsize=64)
def _low_pass(arm: Arm) -> tuple[Array, Array]:
    """Ages [s], and the weight of the force of each age in a reading; weights of either sign, whose sum is 1."""
    low_pass = arm.low_pass
    if not low_pass.sections:
        return np.zeros(1), np.ones(1)
    from scipy.linalg import expm

    A, b, c = filter_of(low_pass)
    step = min(arm.tick, 1e-3) / _STEPS
    count = int(_DECAYS / low_pass.decay / step) + 1
    once, x, answer = expm(A * step), np.asarray(b, float), np.empty(count)
    for k in range(count):
        answer[k] = c @ x
        x = once @ x
    ages: Array = step * np.arange(count, dtype=np.float64)
    return ages, np.asarray(answer / answer.sum())
