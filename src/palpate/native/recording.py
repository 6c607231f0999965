"""Ticks of a law in Python, with every fault that a loop meets: what its C has to repeat to the last bit."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from palpate._jit import kernel
from palpate.arrays import Array
from palpate.errors import InputError
from palpate.force import ForceLoop, Gains, SlidingLoop
from palpate.identifiers import RecursiveLeastSquares

PRESS_TICKS = 4000
"""Ticks from one reset to the next."""
FAULT_RATE = 1e-3
"""Fraction of the ticks at which each kind of fault begins."""


BLIND, LATE, LATER, SATURATED, STUCK, LIMITED, STEPPED, LOST, RECEDES, UNASKED = range(1, 11)
"""Faults of a force loop: readings that are no number; missed ticks, and an unknown count of them; the end of the
sensor's scale; a reading that stands still; one above the limit; steps of the desired force; positions that are none; a
surface that recedes; a desired force that is no number."""
_QUIET, _UNTARED, _BLOCKED = 0.1, 0.2, 0.3
"""Upper ends of the shares of presses without noise, with an untared sensor, and with a tip blocked half-way."""


@dataclass(frozen=True)
class Recording:
    """Runs of a law in Python for its C to repeat.

    Args:
        inputs: numbers of a tick that the law is given.
        press: the rows of a press, given its ticks and a generator: whether the state begins anew, the inputs, the
            value, and every hundredth tick the digest of the state behind it, else 0, shape (ticks, inputs + 3).
    """

    inputs: int
    press: Callable[[int, np.random.Generator], Array]

    def presses(self, ticks: int, seed: int) -> Iterator[Array]:
        """Rows of all ticks, press by press."""
        for number in range(-(-ticks // PRESS_TICKS)):
            rng = np.random.default_rng([seed, number])
            yield self.press(min(PRESS_TICKS, ticks - number * PRESS_TICKS), rng)


@kernel
def _fnv(words, prime, after):
    for word in words:
        after = (after ^ word) * prime
    return after


def state_digest(state: Array) -> float:
    """A hash of a state's bits (FNV-1a by words), as a number of the same bits; every NaN counts as the same."""
    words = np.where(np.isnan(state), np.uint64(1), state.view(np.uint64))
    digest = _fnv(words, np.uint64(1099511628211), np.uint64(14695981039346656037))
    return float(np.uint64(digest).view(np.float64))


def record_force_loop(loop: ForceLoop) -> Recording:
    """Presses of a force loop on surfaces from soft to beyond its cap."""
    return Recording(4, lambda ticks, rng: _force_press(loop, ticks, rng))


def _force_press(loop: ForceLoop, ticks: int, rng: np.random.Generator) -> Array:
    gains = loop.gains
    state = loop._state
    sensor = gains.arm.sensor
    tick = gains.arm.tick
    K = gains.cap * 10.0 ** rng.uniform(-3.0, 0.5)
    B = K * 10.0 ** rng.uniform(-4.0, -1.5)
    wall = gains.approach * tick * ticks * rng.uniform(0.05, 0.3)
    noise = (sensor.noise * rng.uniform(0.2, 1.5) * rng.standard_normal(ticks)).tolist()
    kinds = rng.integers(BLIND, UNASKED + 1, ticks).tolist()
    whens = (rng.random(ticks) < FAULT_RATE).tolist()
    lengths = rng.integers(1, 200, ticks).tolist()
    bias = float(rng.normal(0.0, 0.02 * gains.force))
    quality = rng.random()
    if quality < _QUIET:
        noise = [0.0] * ticks
        bias = 0.0
    elif quality < _UNTARED:
        bias *= 20.0
    step = max(1, round(1.0 / (sensor.sampling * tick)))
    drift = float(rng.normal(0.0, 1e-4 * gains.force * tick)) if quality >= _QUIET else 0.0
    reading = x = before = 0.0
    fault = ticks_left = 0
    out = np.zeros((ticks, 7))
    loop.reset()
    for k in range(ticks):
        ticks_left -= 1
        if whens[k]:
            fault, ticks_left = kinds[k], lengths[k]
        elif ticks_left < 1:
            fault = 0
        force = max(K * (x - wall) + B * (x - before) / tick, 0.0) if x > wall else 0.0
        if k % step == 0 and fault != STUCK:
            unlimited = force + bias + drift * k + noise[k]
            reading = min(max(unlimited, -sensor.full_scale), sensor.full_scale)
        wall += 2e-6 if fault == RECEDES else 0.0
        desired = gains.force * (1.0 + 0.25 * (ticks_left % 3) if fault == STEPPED else 1.0)
        loop._desired = float("nan") if fault == UNASKED else min(desired, 0.9 * gains.force_limit)
        shown_force = _reading(gains, fault, ticks_left, reading)
        place = _place(fault, ticks_left, x)
        missed = _missed_ticks(fault, ticks_left)
        speed = loop.update(shown_force, place, missed)
        out[k, 1:6] = loop.desired, shown_force, place, missed, speed
        out[k, 6] = state_digest(state) if k % 100 == 99 else 0.0
        before = x
        x = x + tick * speed
        if _UNTARED < quality < _BLOCKED and k > ticks // 2:
            wall = wall + 0.5 * max(x - wall, 0.0) * (k == ticks // 2 + 1)
            x = before
    out[0, 0] = 1.0
    loop.desired = gains.force
    return out


def _reading(gains: Gains, fault: int, samples: int, reading: float) -> float:
    """A reading of the force as a fault changes it [N]."""
    if fault == BLIND:
        return float("nan") if samples % 2 else float("inf")
    if fault == SATURATED:
        return gains.arm.sensor.full_scale if samples % 3 else -gains.arm.sensor.full_scale
    return 1.01 * gains.force_limit if fault == LIMITED else reading


def _place(fault: int, samples: int, x: float) -> float:
    """A position as a fault changes it [m]."""
    if fault != LOST:
        return x
    return float("nan") if samples % 2 else 1e4


def _missed_ticks(fault: int, samples: int) -> float:
    """Number of missed ticks; NaN if it is unknown."""
    if fault == LATE:
        return float(samples % 7 * samples)
    return float("nan") if fault == LATER else 0.0


def record_sliding_loop(loop: SlidingLoop) -> Recording:
    """Slides over spheres, bowls and planes, with friction from none to beyond mu_max, and every fault of a press."""
    return Recording(11, lambda ticks, rng: _slide(loop, ticks, rng))


def _slide(loop: SlidingLoop, ticks: int, rng: np.random.Generator) -> Array:
    gains = loop.gains
    tick = loop.gains.arm.tick
    K = gains.cap * 10.0 ** rng.uniform(-2.5, 0.2)
    mu = rng.uniform(0.0, 1.0)
    bend = rng.uniform(-30.0, 30.0)
    wall = 0.1 * gains.approach * tick * ticks
    rate = rng.uniform(0.1, 5.0)
    n = loop.normal + rng.normal(0.0, 0.1, 3)
    noise = gains.arm.sensor.noise * rng.standard_normal((ticks, 3))
    kinds = rng.integers(BLIND, UNASKED + 1, ticks)
    begins = rng.random(ticks) < 2.0 * FAULT_RATE
    x = np.zeros(3)
    v = np.zeros(3)
    fault = 0
    force = np.zeros(3)
    out = np.zeros((ticks, 14))
    changes = rng.integers(0, 2)
    desired = loop.desired
    noise += rng.normal(0.0, 0.3 * gains.force, 3) * (rng.random() < _UNTARED)
    loop.reset()
    for k in range(ticks):
        fault = kinds[k] if begins[k] else fault * (k % 100 > 0)
        loop._desired = desired * (1.0 + 0.5 * changes * (k // 500 % 2))
        across = x - (x @ n) * n
        along = v - (v @ n) * n
        axis = k % 3
        wall += {RECEDES: 2e-6, STEPPED: 1e-3 * (k % 100 == 50)}.get(fault, 0.0)
        if fault != STUCK:
            slip = mu * along / (np.linalg.norm(along) + 1e-4)
            force = K * max(x @ n - wall - bend * (across @ across), 0.0) * (n + slip) + noise[k]
            force[axis] = _reading(gains, fault, k, force[axis])
        place = x + (np.nan if fault == LOST else 0.0)
        heading = np.array([np.cos(rate * k * tick), np.sin(rate * k * tick), 0.0])
        heading = n if fault == RECEDES else heading * (np.nan if fault == UNASKED else float(k % 9 > 0))
        missed = {LATE: float(k % 40), LATER: np.nan}.get(fault, 0.0)
        v = loop.update(force, place, heading, missed)
        state = state_digest(loop._state) if k % 100 == 99 else 0.0
        out[k] = [k == 0, loop.desired, *force, *place, *heading, missed, state_digest(v), state]
        x = x + tick * v
    loop.desired = desired
    return out


def record_least_squares(estimator: RecursiveLeastSquares) -> Recording:
    """Samples of a linear model whose parameters change, with rest, outliers and numbers that are none."""
    first = estimator._state.copy()
    return Recording(len(estimator.names) + 1, lambda ticks, rng: _samples(estimator, first, ticks, rng))


def _samples(estimator: RecursiveLeastSquares, first: Array, ticks: int, rng: np.random.Generator) -> Array:
    n = len(estimator.names)
    state = estimator._state
    time = 1e-3 * np.arange(ticks)[:, None]
    frequencies = rng.uniform(1.0, 60.0, n)
    phases = rng.uniform(0.0, 6.0, n)
    amplitudes = 10.0 ** rng.uniform(-4.0, 2.0, n)
    phi = np.sin(time * frequencies + phases) * amplitudes
    parameters = 10.0 ** rng.uniform(-1.0, 4.0, n)
    change = time[-1] * rng.random()
    theta = parameters * np.where(time > change, 1.0, rng.uniform(0.3, 3.0, n))
    noise = 10.0 ** rng.uniform(-3.0, 0.0)
    force = np.sum(phi * theta, axis=1) + noise * rng.standard_normal(ticks)
    pause = rng.integers(0, ticks, 2)
    phi[min(pause) : max(pause)] *= rng.choice([0.0, 1e-9, 1.0])
    phi[rng.random(phi.shape) < FAULT_RATE] = np.nan
    for value in (np.nan, np.inf, -np.inf, 1e31, 1e20, 0.0):
        force[rng.random(ticks) < FAULT_RATE] = value
    out = np.zeros((ticks, n + 4))
    out[0, 0] = 1.0
    out[:, 1 : n + 1] = phi
    out[:, n + 1] = force
    state[:] = first
    for k in range(ticks):
        try:
            estimator.update(phi[k], float(force[k]))
            out[k, n + 2] = 1.0
        except InputError:
            out[k, n + 2] = 0.0
        if k % 100 == 99:
            out[k, n + 3] = state_digest(state)
    return out
