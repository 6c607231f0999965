"""Ticks of a law in Python, with every fault that a loop meets: what its C has to repeat to the last bit."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate._jit import kernel
from palpate.arrays import Array
from palpate.errors import InputError
from palpate.force import ForceLoop, Gains, SlidingLoop
from palpate.identifiers import ContactIdentifier, RecursiveLeastSquares

PRESS = 4000
"""Ticks from one reset to the next."""
RARE = 1e-3
"""Share of the ticks at which each kind of fault begins."""


BLIND, LATE, LATER, SATURATED, STUCK, LIMITED, STEPPED, LOST, RECEDES, UNASKED = range(1, 11)
"""Faults of a force loop: readings that are no number; missed ticks, and an unknown count of them; the end of the
sensor's scale; a reading that stands still; one above the limit; steps of the desired force; positions that are none; a
surface that recedes; a desired force that is no number."""
_QUIET, _UNTARED, _BLOCKED = 0.1, 0.2, 0.3
"""Up to which share of the presses the sensor has no noise; else is not tared; else the tip is blocked half-way."""


@dataclass(frozen=True)
class Recording:
    """How a law is run in Python for its C to repeat.

    Args:
        inputs: numbers of a tick that the law is given.
        every: ticks between two digests of the whole state.
        press: the rows of a press, given whether it is the first, its ticks and a generator: whether the state begins
            anew, the inputs, the value, and the digest of the state behind the tick or 0, shape (ticks, inputs + 3).
    """

    inputs: int
    every: int
    press: Callable[[bool, int, np.random.Generator], Array]

    def presses(self, ticks: int, seed: int) -> Iterator[Array]:
        """Rows of so many ticks, a press at a time."""
        for number in range(-(-ticks // PRESS)):
            rng = np.random.default_rng([seed, number])
            yield self.press(number == 0, min(PRESS, ticks - number * PRESS), rng)


@kernel
def _fnv(words, prime, after):
    for word in words:
        after = (after ^ word) * prime
    return after


def digest_of(state: Array) -> float:
    """A hash of a state's bits (FNV-1a by words), as a number of the same bits; every NaN counts as the same."""
    words = np.where(np.isnan(state), np.uint64(1), state.view(np.uint64))
    whole = _fnv(words, np.uint64(1099511628211), np.uint64(14695981039346656037))
    return float(np.uint64(whole).view(np.float64))


def of_force_loop(loop: ForceLoop) -> Recording:
    """Presses of a force loop on surfaces from soft to beyond its cap."""
    return Recording(4, 100, lambda _, ticks, rng: _force_press(loop, ticks, rng))


def _force_press(loop: ForceLoop, ticks: int, rng: np.random.Generator) -> Array:
    gains, state = loop.gains, loop._state
    sensor, tick = gains.arm.sensor, gains.arm.tick
    K = gains.cap * 10.0 ** rng.uniform(-3.0, 0.5)
    B, wall = K * 10.0 ** rng.uniform(-4.0, -1.5), gains.approach * tick * ticks * rng.uniform(0.05, 0.3)
    noise = (sensor.noise * rng.uniform(0.2, 1.5) * rng.standard_normal(ticks)).tolist()
    kinds, whens = rng.integers(BLIND, UNASKED + 1, ticks).tolist(), (rng.random(ticks) < RARE).tolist()
    lengths, bias = rng.integers(1, 200, ticks).tolist(), float(rng.normal(0.0, 0.02 * gains.force))
    quality = rng.random()
    if quality < _QUIET:
        noise, bias = [0.0] * ticks, 0.0
    elif quality < _UNTARED:
        bias *= 20.0
    step, drift = (
        max(1, round(1.0 / (sensor.sampling * tick))),
        float(rng.normal(0.0, 1e-4 * gains.force * tick)) if quality >= _QUIET else 0.0,
    )
    reading, x, before, fault, left = 0.0, 0.0, 0.0, 0, 0
    out = np.zeros((ticks, 7))
    loop.reset()
    for k in range(ticks):
        fault, left = (kinds[k], lengths[k]) if whens[k] else (fault if left > 1 else 0, left - 1)
        force = max(K * (x - wall) + B * (x - before) / tick, 0.0) if x > wall else 0.0
        if k % step == 0 and fault != STUCK:
            reading = min(max(force + bias + drift * k + noise[k], -sensor.full_scale), sensor.full_scale)
        wall += 2e-6 if fault == RECEDES else 0.0
        desired = gains.force * (1.0 + 0.25 * (left % 3) if fault == STEPPED else 1.0)
        loop._desired = float("nan") if fault == UNASKED else min(desired, 0.9 * gains.force_limit)
        given = _reading(gains, fault, left, reading)
        place = x if fault != LOST else float("nan") if left % 2 else 1e4
        missed = float(left % 7 * left) if fault == LATE else float("nan") if fault == LATER else 0.0
        speed = loop.update(given, place, missed)
        out[k, 1:6] = loop.desired, given, place, missed, speed
        out[k, 6] = digest_of(state) if k % 100 == 99 else 0.0
        before, x = x, x + tick * speed
        if _UNTARED < quality < _BLOCKED and k > ticks // 2:
            wall, x = wall + 0.5 * max(x - wall, 0.0) * (k == ticks // 2 + 1), before
    out[0, 0] = 1.0
    loop.desired = gains.force
    return out


def _reading(gains: Gains, fault: int, left: int, reading: float) -> float:
    """A reading of the force as a fault changes it [N]."""
    if fault == BLIND:
        return float("nan") if left % 2 else float("inf")
    if fault == SATURATED:
        return gains.arm.sensor.full_scale if left % 3 else -gains.arm.sensor.full_scale
    return 1.01 * gains.force_limit if fault == LIMITED else reading


def of_sliding_loop(loop: SlidingLoop) -> Recording:
    """Slides over spheres, bowls and planes, with friction from none to beyond mu_max, and every fault of a press."""
    return Recording(11, 100, lambda _, ticks, rng: _slide(loop, ticks, rng))


def _slide(loop: SlidingLoop, ticks: int, rng: np.random.Generator) -> Array:
    gains, tick = loop.gains, loop.gains.arm.tick
    K, mu = gains.cap * 10.0 ** rng.uniform(-2.5, 0.2), rng.uniform(0.0, 1.0)
    bend, wall, rate = rng.uniform(-30.0, 30.0), 0.1 * gains.approach * tick * ticks, rng.uniform(0.1, 5.0)
    n, noise = loop.normal + rng.normal(0.0, 0.1, 3), gains.arm.sensor.noise * rng.standard_normal((ticks, 3))
    kinds, begins = rng.integers(BLIND, UNASKED + 1, ticks), rng.random(ticks) < 2.0 * RARE
    x, v, fault, force, out = np.zeros(3), np.zeros(3), 0, np.zeros(3), np.zeros((ticks, 14))
    changes, desired = rng.integers(0, 2), loop.desired
    noise += rng.normal(0.0, 0.3 * gains.force, 3) * (rng.random() < _UNTARED)
    loop.reset()
    for k in range(ticks):
        fault = kinds[k] if begins[k] else fault * (k % 100 > 0)
        loop._desired = desired * (1.0 + 0.5 * changes * (k // 500 % 2))
        across, along, axis = x - (x @ n) * n, v - (v @ n) * n, k % 3
        wall += {RECEDES: 2e-6, STEPPED: 1e-3 * (k % 100 == 50)}.get(fault, 0.0)
        if fault != STUCK:
            slip = mu * along / (np.linalg.norm(along) + 1e-4)
            force = K * max(x @ n - wall - bend * (across @ across), 0.0) * (n + slip) + noise[k]
            force[axis] = _reading(gains, fault, k, force[axis])
        place = x + (np.nan if fault == LOST else 0.0)
        way = np.array([np.cos(rate * k * tick), np.sin(rate * k * tick), 0.0])
        way = n if fault == RECEDES else way * (np.nan if fault == UNASKED else float(k % 9 > 0))
        missed = {LATE: float(k % 40), LATER: np.nan}.get(fault, 0.0)
        v = loop.update(force, place, way, missed)
        state = digest_of(loop._state) if k % 100 == 99 else 0.0
        out[k] = [k == 0, loop.desired, *force, *place, *way, missed, digest_of(v), state]
        x = x + tick * v
    loop.desired = desired
    return out


def of_least_squares(estimator: RecursiveLeastSquares) -> Recording:
    """Samples of a linear model whose parameters change, with rest, outliers and numbers that are none."""
    first = estimator._state.copy()
    return Recording(
        len(estimator.names) + 1, 100, lambda _, ticks, rng: _samples(estimator, first, ticks, rng)
    )


def _samples(estimator: RecursiveLeastSquares, first: Array, ticks: int, rng: np.random.Generator) -> Array:
    n, state = len(estimator.names), estimator._state
    time = 1e-3 * np.arange(ticks)[:, None]
    phi = np.sin(time * rng.uniform(1.0, 60.0, n) + rng.uniform(0.0, 6.0, n)) * 10.0 ** rng.uniform(
        -4.0, 2.0, n
    )
    theta = 10.0 ** rng.uniform(-1.0, 4.0, n) * np.where(
        time > time[-1] * rng.random(), 1.0, rng.uniform(0.3, 3.0, n)
    )
    force = np.sum(phi * theta, axis=1) + 10.0 ** rng.uniform(-3.0, 0.0) * rng.standard_normal(ticks)
    rest = rng.integers(0, ticks, 2)
    phi[min(rest) : max(rest)] *= rng.choice([0.0, 1e-9, 1.0])
    phi[rng.random(phi.shape) < RARE] = np.nan
    for value in (np.nan, np.inf, -np.inf, 1e31, 1e20, 0.0):
        force[rng.random(ticks) < RARE] = value
    out = np.zeros((ticks, n + 4))
    out[0, 0], out[:, 1 : n + 1], out[:, n + 1] = 1.0, phi, force
    state[:] = first
    for k in range(ticks):
        try:
            estimator.update(phi[k], float(force[k]))
            out[k, n + 2] = 1.0
        except InputError:
            out[k, n + 2] = 0.0
        if k % 100 == 99:
            out[k, n + 3] = digest_of(state)
    return out


def of_identifier(identifier: ContactIdentifier) -> Recording:
    """Approaches and touches of a moving tip, with readings that are missing, jump and saturate."""
    first = identifier._state.copy()
    return Recording(2, PRESS, lambda new, ticks, rng: _touches(identifier, first, new, ticks, rng))


def _touches(
    identifier: ContactIdentifier, first: Array, new: bool, ticks: int, rng: np.random.Generator
) -> Array:
    state, time = identifier._state, np.arange(ticks) / identifier.rate
    swing = 10.0 ** rng.uniform(-4.0, -2.5)
    x = swing * (
        1.3 * np.sin(2.0 * np.pi * rng.uniform(0.2, 1.5) * time) + 0.2 * np.sin(2.0 * np.pi * 17.0 * time)
    )
    depth = np.maximum(x - swing * rng.uniform(-2.0, 0.6), 0.0)
    K, B = 10.0 ** rng.uniform(2.0, 5.0), 10.0 ** rng.uniform(-1.0, 1.5)
    force = np.where(depth > 0.0, K * depth + B * np.gradient(x, 1.0 / identifier.rate), 0.0)
    force = np.clip(
        force + 0.05 * rng.standard_normal(ticks), -1e5, rng.uniform(0.7, 2.0) * force.max() + 0.1
    )
    every = max(int(rng.integers(1, 4)), 1)
    force = force[(np.arange(ticks) // every) * every]
    force[rng.random(ticks) < RARE], x[rng.random(ticks) < 5.0 * RARE] = np.nan, np.nan
    x[rng.random(ticks) < RARE] += 1.0
    begins, ends = np.sort(rng.integers(0, ticks, 2))
    kind = rng.integers(0, 6)
    if kind == 0:  # an encoder that is read every second tick for a while; at the end a tip at rest
        x[:begins], x[ends:] = x[(np.arange(begins) // 2) * 2], x[ends]
    elif kind == 1:  # at rest with a force that changes, from and to a jump
        x[begins:ends] = x[begins] + 1.0
    gap = 0 if kind == 2 else int(rng.integers(0, ticks))
    x[gap : gap + int(rng.integers(0, 60))] = np.nan
    out = np.zeros((ticks, 5))
    fresh = bool(rng.random() < 0.5) or new
    if fresh:
        state[:] = first
    out[0, 0], out[:, 1], out[:, 2] = float(fresh), x, force
    taken: Any = identifier._one
    for k in range(ticks):
        out[k, 3] = taken(state, identifier._weights, x[k], force[k], identifier._out)
    out[-1, 4] = digest_of(state)
    return out
