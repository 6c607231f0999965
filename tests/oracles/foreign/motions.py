"""How the probe is moved: a command in depths, followed by a robot of its own bandwidth.

A course is rest in free motion, approach to a base depth, rest there, the motion itself, rest, retreat and again rest.
Depths are in units of the depth that the largest force belongs to.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]
Rng = np.random.Generator

_FREQUENCY_SHARE = 1 / 12
"""Highest frequency of a motion over the rate of the log."""
_FASTEST = 20.0


@dataclass(frozen=True)
class Course:
    """A command and its parts.

    Args:
        command: depth over the largest depth, or force over the largest force, shape (n,); below 0 is air.
        base, begin, end: times [s] at which the probe rests at its base, the motion begins, and it ends.
        by_force: whether it is a force that is asked for.
    """

    command: Array
    base: float
    begin: float
    end: float
    by_force: bool = False


def _step(t: Array, rng: Rng, fastest: float) -> Array:
    hold = rng.uniform(0.6, 1.5)
    return 0.3 + 0.5 * (np.floor(t / hold) % 2)


def _ramp_hold(t: Array, rng: Rng, fastest: float) -> Array:
    rise, period = rng.uniform(0.2, 1.5), t[-1] / int(rng.integers(1, 4))
    hold = 0.6 * period
    at = t % period
    return np.interp(at, [0, rise, rise + hold, min(2 * rise + hold, 0.98 * period)], [-0.1, 0.9, 0.9, -0.1])


def _ramps(t: Array, rng: Rng, fastest: float) -> Array:
    period = rng.uniform(2, 5)
    return -0.1 + 1.0 * (1 - np.abs((t % period) / period * 2 - 1))


def _hold(t: Array, rng: Rng, fastest: float) -> Array:
    return np.full_like(t, rng.uniform(0.5, 0.9))


def _sine(t: Array, rng: Rng, fastest: float) -> Array:
    f = min(rng.uniform(0.5, 5), fastest)
    return 0.5 + rng.uniform(0.2, 0.38) * np.sin(2 * np.pi * f * t)


def _chirp(t: Array, rng: Rng, fastest: float) -> Array:
    low, high = rng.uniform(0.2, 0.6), min(rng.uniform(5, _FASTEST), fastest)
    ratio = np.log(high / low)
    return 0.5 + 0.3 * np.sin(2 * np.pi * low * t[-1] / ratio * (np.exp(ratio * t / t[-1]) - 1))


def _multisine(t: Array, rng: Rng, fastest: float) -> Array:
    count = int(rng.integers(4, 9))
    lines = np.geomspace(0.3, min(rng.uniform(4, 15), fastest), count)
    waves = (
        np.sin(2 * np.pi * lines[:, None] * t + rng.uniform(0, 2 * np.pi, (count, 1))) / lines[:, None] ** 0.3
    )
    total = waves.sum(0)
    return 0.5 + 0.35 * total / np.abs(total).max()


def _hand(t: Array, rng: Rng, fastest: float) -> Array:
    wander = _wander(t, rng.uniform(0.4, 1.5), rng)
    return 0.45 + rng.uniform(0.3, 0.6) * wander / np.abs(wander).max()


def _taps(t: Array, rng: Rng, fastest: float) -> Array:
    f = rng.uniform(0.8, 2.5)
    return np.maximum(1.5 * np.sin(2 * np.pi * f * t) - 0.6, -0.3)


def _dither(t: Array, rng: Rng, fastest: float) -> Array:
    return 0.55 + rng.uniform(0.15, 0.35) * np.sin(2 * np.pi * rng.uniform(1.5, 4) * t)


def _force_steps(t: Array, rng: Rng, fastest: float) -> Array:
    hold = rng.uniform(0.8, 2.0)
    return 0.3 + 0.5 * (np.floor(t / hold) % 2)


def _force_sine(t: Array, rng: Rng, fastest: float) -> Array:
    f = rng.uniform(0.4, 2)
    return 0.5 + 0.3 * np.sin(2 * np.pi * f * t)


def _force_chirp(t: Array, rng: Rng, fastest: float) -> Array:
    return _chirp(t, rng, min(fastest, 5.0))


_MAKERS: dict[str, Callable[[Array, Rng, float], Array]] = {
    "step": _step,
    "ramp-hold": _ramp_hold,
    "ramps": _ramps,
    "hold": _hold,
    "sine": _sine,
    "chirp": _chirp,
    "multisine": _multisine,
    "hand": _hand,
    "taps": _taps,
    "dither": _dither,
    "force-steps": _force_steps,
    "force-sine": _force_sine,
    "force-chirp": _force_chirp,
}
MOTIONS = tuple(_MAKERS)
BY_FORCE = tuple(name for name in MOTIONS if name.startswith("force-"))


def course(name: str, rng: Rng, dt: float, rate: float, gap: float) -> Course:
    """A course of one kind of motion.

    Args:
        name: of MOTIONS.
        rng: draws its numbers.
        dt: step [s].
        rate: rows of the log per second, which bounds the motion's frequencies.
        gap: how far from the surface it begins, over the largest depth.

    Raises:
        KeyError: no such motion.
    """
    length = float(rng.uniform(4, 9)) * (1.6 if name in ("ramps", "ramp-hold", "hand") else 1.0)
    t = np.arange(int(length / dt)) * dt
    own = _MAKERS[name](t, rng, min(_FREQUENCY_SHARE * rate, _FASTEST))
    air, rest, approach = rng.uniform(0.4, 1.0), rng.uniform(0.3, 1.0), rng.uniform(0.4, 1.2)
    by_force = name in BY_FORCE
    away = -0.15 if by_force else -gap
    marks = np.cumsum([air, approach, rest])
    after = marks[2] + length + np.cumsum([rest, approach, air])
    total = np.arange(int(after[-1] / dt)) * dt
    turning = [0, marks[0], marks[1], marks[2], marks[2] + length, after[0], after[1], after[2]]
    levels = [away, away, own[0], own[0], own[-1], own[-1], away, away]
    command = np.interp(total, turning, levels)
    first = int(marks[2] / dt)
    command[first : first + len(own)] = own
    return Course(command, float(marks[1]), float(marks[2]), float(marks[2] + length), by_force)


@njit(cache=True)
def _tracked(command, phi, gamma0, gamma1, third):
    out = np.empty((3, len(command)))
    state = np.array([command[0], 0.0, 0.0])
    for i in range(len(command)):
        if i:
            state = phi @ state + gamma0 * command[i - 1] + gamma1 * command[i]
        out[:, i] = state
    return out


def tracked(command: Array, bandwidth: float, dt: float) -> tuple[Array, Array, Array]:
    """What a robot makes of a command: three equal lags, exact for the straight lines between its points.

    Args:
        command: shape (n,).
        bandwidth: of each lag [Hz].
        dt: step [s].

    Returns:
        Position, speed and acceleration, shape (n,) each.
    """
    from scipy.linalg import expm

    w = 2 * np.pi * bandwidth
    system = np.zeros((5, 5))
    system[0, 1] = system[1, 2] = 1.0
    system[2] = [-(w**3), -3 * w**2, -3 * w, w**3, 0.0]
    system[3, 4] = 1.0 / dt
    whole = expm(system * dt)
    gamma1 = np.ascontiguousarray(whole[:3, 4])
    gamma0 = np.ascontiguousarray(whole[:3, 3]) - gamma1
    x, v, a = _tracked(command, np.ascontiguousarray(whole[:3, :3]), gamma0, gamma1, w)
    return x, v, a


def _wander(t: Array, highest: float, rng: Rng) -> Array:
    """A smooth random motion: sines up to a frequency [Hz] with random phases, shape (n,)."""
    lines = np.arange(1, max(int(highest * t[-1]), 3) + 1) / t[-1]
    amplitude = rng.normal(size=len(lines)) / (0.3 + lines)
    phases = rng.uniform(0, 2 * np.pi, len(lines))
    total = np.zeros_like(t)
    for f, size, phase in zip(lines, amplitude, phases, strict=True):
        total += size * np.sin(2 * np.pi * f * t + phase)
    return total - total.mean()


def drifting(t: Array, size: float, rng: Rng) -> Array:
    """Height of a surface that slides or moves, up to `size` from its mean, slower than half a hertz, shape (n,)."""
    wander = _wander(t, 0.4, rng) + rng.normal() * (t / t[-1] - 0.5) * 4
    wander -= wander[0]
    return size * wander / np.abs(wander).max()
