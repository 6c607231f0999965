"""F_max: the speed that keeps the force below one stated number, on layers and after any signal in free motion.

Theorem. The surface is at rest, unstressed and without mass; its force is a function of the depth that grows by at most
K per metre, in layers or not, or K and a damper with K + B/theta at most the cap. From the first reading at or above
F_d on the commanded speed is not positive, and it never exceeds v. A reading differs from the force, low-passed and as
old as the sensor's samples, by at most epsilon. Then

    F <= F_d + epsilon + (K_eff Theta + D + M) v

Theta [s] is the largest residual travel per unit of speed: what the tip still moves after the command has become zero,
seen from the last reading below F_d (`residual_travel`); D v is a damper's part, M v a mass's. Proof: docs/proofs.md.
M = sqrt(K m) is the momentum of one impact, and a margin: repeated impacts in step with the loop are not in it.

Theta is not a largest value of samples: what lies between the times, ages and phases that are looked at, and what comes
after them, is bounded and added (`_Response`).
"""

from __future__ import annotations

from functools import lru_cache
from math import exp, pi, sqrt

import numpy as np

from palpate.arrays import Array
from palpate.errors import InputError
from palpate.force.arm import Arm, PositionLoop, Sensor
from palpate.force.sampled_loop import filter_of

LATE_TICKS = 1
"""Ticks by which a reading, or a command, may be later than arm and sensor state: the jitter of one tick that a
certificate of an adapting loop covers."""
_STEPS = 24
"""Cells of the sensor's low-pass in a tick of the loop or in a millisecond, whichever is shorter."""
_DECAYS = 12.0
"""Decay times of the low-pass and of the inner loop that are summed one by one; the rest is bounded."""
_FORGOTTEN = 40.0
"""Decay times of the low-pass after which nothing is left in double precision, e^-40."""
_TIMES = 240
"""Times after the last command at which the travel is looked at."""
_PHASES = 64
"""Phases of a tick at which the speed of the tip is looked at."""
BIAS_FRACTION = 0.1
"""Fraction of F_d that is taken out of the readings as bias: the press is too hard by that if it was a surface's."""
_ERROR_DEVIATIONS = 4.0
"""Standard deviations of the sensor's noise that a reading is taken to be off: beyond, once in 16,000 readings."""


def reading_error(arm: Arm, force: float) -> float:
    """epsilon of F_max [N]: noise, half a step, and the force at rest that may have been taken out as bias."""
    step = arm.sensor.resolution or 0.0
    return BIAS_FRACTION * force + _ERROR_DEVIATIONS * arm.sensor.noise + 0.5 * step


def force_ceiling(arm: Arm, force: float, force_max: float, cap: float, theta: float) -> float:
    """Largest commanded speed with which the force stays below F_max [m/s]; not above 0 where none does.

    Args:
        arm: what moves.
        force: F_d [N].
        force_max: F_max [N].
        cap: stiffest surface, K + B/theta [N/m].
        theta: whole lag of the loop, by which the cap counts damping [s].
    """
    return float((force_max - force - reading_error(arm, force)) / force_per_speed(arm, cap, theta))


FORCE_MAX_RATIO = 5.0
"""F_max over the desired force where none is given."""


def usual_force_max(force: float, sensor: Sensor) -> float:
    """F_max where none is given [N]: the sensor must read it."""
    return min(FORCE_MAX_RATIO * force, sensor.full_scale)


def check_same_force_max(tuned: float | None, force_max: float | None) -> None:
    """Refuse another F_max [N] than the one that gains were tuned for [N].

    Raises:
        InputError: it names both.
    """
    if force_max is not None and force_max != tuned:
        known = "no F_max" if tuned is None else f"F_max = {tuned:g} N"
        raise InputError(
            f"--force-max is {force_max:g} N, and the gains are for {known}; tune with --force-max {force_max:g}:N"
        )


def check_force_max(arm: Arm, force: float, force_max: float | None) -> None:
    """Refuse an F_max that no speed keeps, or that the sensor cannot read.

    Raises:
        InputError: it says what is needed.
    """
    if force_max is None:
        return
    if force >= arm.sensor.full_scale:
        raise InputError(
            f"the force of {force:g} N is not below the sensor's full scale of {arm.sensor.full_scale:g} N; ask for "
            "less"
        )
    least = force + reading_error(arm, force)
    if not force_max > least:
        raise InputError(
            f"F_max must be above {least:.4g} N, the force of {force:g} N and what a reading may be off, "
            f"got {force_max:g} N; raise it, or press more softly"
        )
    if force_max > arm.sensor.full_scale:
        raise InputError(
            f"F_max must be at most the sensor's full scale of {arm.sensor.full_scale:g} N, got {force_max:g} N"
        )


@lru_cache(maxsize=64)
def force_per_speed(arm: Arm, cap: float, theta: float) -> float:
    """Largest force beyond the last reading below F_d, per unit of commanded speed: K_eff Theta + D + M [N s/m].

    Stiffness and damping share the cap, and the force is linear in both: the worse of a spring and of a damper counts.
    Neither exceeds the series stiffness, on which the commanded position acts.
    """
    travel, (_, weights, rest) = residual_travel(arm), _low_pass(arm)
    spring = arm.seen(cap) * travel
    damper = theta * cap * (1.0 + float(weights.sum()) + rest) * _tip_speed(arm)
    mass = arm.inner.mass
    momentum = 0.0 if mass is None else sqrt(cap * mass)
    return max(spring, min(damper, arm.series * travel)) + momentum


def residual_travel(arm: Arm) -> float:
    """Theta [s]: the largest distance, over all commands up to a speed, from where a reading below F_d was taken.

    The reading is the low-passed force of up to `sensor_ticks` ago. The command goes on for a tick after it; then the
    tip still comes after by the inner loop's lag and delay. Every command between the two signs is admitted, so that
    an overshoot of the inner loop counts, too; of its intervals the worst corner.
    """
    inner = arm.inner
    if not isinstance(inner, PositionLoop):
        # A spring and a damper: the tip comes after by D/K_s, beyond a delay that every command has.
        return inner.damping / inner.stiffness + _travel(arm, None)
    return max(_travel(arm, _Response(*corner)) for corner in inner.corners)


def _travel(arm: Arm, response: _Response | None) -> float:
    """Sum over the ages of the low-pass of the travel since then, each by its weight, at the worst later time."""
    ages, weights, rest = _low_pass(arm)
    tick, late = arm.tick, arm.delay_ticks * arm.tick
    begin = -(arm.sensor_ticks + LATE_TICKS) * tick - ages
    settled = 0.0 if response is None else _DECAYS / response.decay
    count = int((late + settled - float(begin[-1])) / tick) + 2
    sent = -tick * np.arange(count)  # times of the commands that may be positive; the last is at 0
    if (
        response is None
    ):  # a command acts at once and for good: the travel only grows until the last has acted
        moved = begin[:, None] - sent - late < 0.0
        return float(weights @ (tick * moved.sum(axis=1))) + rest * tick * count
    ends, spacing = np.linspace(0.0, late + settled, _TIMES, retstep=True)
    before, worst = response.step(begin[:, None] - sent - late), 0.0
    for end in ends:
        travel = tick * np.abs(response.step(end - sent - late) - before).sum(axis=1)
        worst = max(worst, float(weights @ travel))
    # Between two times: a function with f'' >= -c exceeds its chord by at most c/8 times the square of the spacing.
    between = spacing**2 / 8.0 * response.summed_acceleration(tick)
    # Within a cell of ages the place changes by the tip's speed; commands before those of the sum have settled.
    within = float(ages[1] - ages[0]) * response.speed(tick) if len(ages) > 1 else 0.0
    total = float(weights.sum())
    return worst + total * (between + within + 2.0 * response.tail(tick)) + rest * 2.0 * tick * count


class _Response:
    """Answer S of the inner loop to a step, w^2/(s^2 + 2 z w s + w^2), with bounds of its sums over the ticks.

    Damping is by `rate` = 2 z w. With the slower pole's decay d, |1 - S| <= (1 + d t) e^(-d t), whatever the damping.
    A sum over ticks T of |g| is at most the integral of |g| plus T times that of |g'|.

    Args:
        square: w^2 [1/s^2].
        rate: 2 z w [1/s].
    """

    def __init__(self, square: float, rate: float):
        self._square, self._rate = square, rate
        root = np.sqrt(complex(0.25 * rate**2 - square))
        self._root = root if abs(root) > 1e-6 * rate else complex(1e-6 * rate)  # of a double pole, to 1e-12
        self.decay = 0.5 * rate - root.real
        """Slowest rate at which the answer decays [1/s]."""
        swing = abs(root.imag)
        overshoot = exp(-0.5 * pi * rate / swing) if swing > 0.0 else 0.0
        self._variation = (1.0 + overshoot) / (1.0 - overshoot)

    def step(self, time: Array) -> Array:
        """S at times since the step [s]."""
        t, a, c = np.maximum(time, 0.0), 0.5 * self._rate, self._root
        return 1.0 - (np.exp(-a * t) * (np.cosh(c * t) + a / c * np.sinh(c * t))).real

    def summed_acceleration(self, tick: float) -> float:
        """Bound of the sum over ticks of T |S''| [1/s]."""
        second = 2.0 * self._square / self.decay + self._rate * self._variation  # integral of |S''|
        third = self._square * self._variation + self._rate * second
        return second + tick * (self._square + third)

    def speed(self, tick: float) -> float:
        """Bound of the tip's speed over that of the command: the sum over ticks of T |S'| at the worst phase."""
        phases, spacing = np.linspace(0.0, tick, _PHASES, retstep=True)
        later = tick * np.arange(int(_DECAYS / self.decay / tick) + 2)
        t, c = phases[:, None] + later, self._root
        slope = (self._square / c * np.exp(-0.5 * self._rate * t) * np.sinh(c * t)).real
        sampled = tick * np.abs(slope).sum(axis=1).max()
        rest = self._square / self.decay * self.tail(tick)
        return float(sampled) + 0.5 * spacing * self.summed_acceleration(tick) + rest

    def tail(self, tick: float) -> float:
        """Bound of the sum over ticks of T |1 - S|, from `_DECAYS` decay times after a step on [s]."""
        return exp(-_DECAYS) * ((2.0 + _DECAYS) / self.decay + (1.0 + _DECAYS) * tick)


def _tip_speed(arm: Arm) -> float:
    """Largest speed of the tip over that of the command."""
    inner = arm.inner
    if not isinstance(inner, PositionLoop):
        return 1.0
    return max(_Response(*corner).speed(arm.tick) for corner in inner.corners)


@lru_cache(maxsize=64)
def _low_pass(arm: Arm) -> tuple[Array, Array, float]:
    """Ages [s] and largest weights of the force of each age in a reading, by cells, and the weight of older forces.

    The impulse response in a cell is below the chord of its magnitudes plus h^2/8 times the largest second derivative,
    which a cell's beginning bounds by the norm of A. An age is the oldest of its cell.
    """
    low_pass = arm.low_pass
    if not low_pass.sections:
        return np.zeros(1), np.ones(1), 0.0
    from scipy.linalg import expm

    A, b, c = filter_of(low_pass)
    step = min(arm.tick, 1e-3) / _STEPS
    count = int(_FORGOTTEN / low_pass.decay / step) + 1
    states = np.empty((count + 1, len(b)))
    states[0], once = b, expm(A * step)
    for k in range(count):
        states[k + 1] = once @ states[k]
    size = np.abs(states @ c)
    grown = exp(step * float(np.linalg.norm(A, 2))) * float(np.linalg.norm(c @ A @ A))
    bent = step**2 / 8.0 * grown * np.linalg.norm(states[:-1], axis=1)
    weights = step * (0.5 * (size[:-1] + size[1:]) + bent)
    summed = int(_DECAYS / low_pass.decay / step) + 1
    return step * np.arange(1.0, summed + 1.0), weights[:summed], float(weights[summed:].sum())
