"""Causes of error that are no sensor's noise: how a guide, a cable, an amplifier or a log changes what is written."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]
Rng = np.random.Generator


@dataclass(frozen=True)
class World:
    """A cause of error.

    Args:
        felt: force at the tip [N] from the depth of the probe [m] and that of the contact [N].
        seen: what position [m] and force [N] the sensors have, from the true ones, a step [s] apart.
        end: share of the way beyond which the position stands still.
        late: delays of the force and of the position [s] at instants [s], shape (n,).
        lag: lowest and highest of what it adds to the force's lag [s].
        friction: share of the load by which a slope in loading and in unloading differ from the surface's.
        spring: stiffness beside the surface, which may be counted with it or not [N/m].
    """

    felt: Callable[[Array, Array], Array] = lambda _, force: force
    seen: Callable[[Array, Array, float], tuple[Array, Array]] = lambda x, force, _: (x, force)
    late: Callable[[Array], tuple[Array, Array]] = lambda times: (0 * times, 0 * times)
    end: float = 1.0
    lag: tuple[float, float] = (0.0, 0.0)
    friction: float = 0.0
    spring: float = 0.0


def averaged(width: float) -> World:
    """Each row is the mean of both channels over a time [s]."""
    return World(seen=lambda x, force, dt: (_mean(x, width, dt), _mean(force, width, dt)))


def moving_average(width: float) -> World:
    """The force is the mean over the time [s] before its row: a converter that sums."""
    lag = width / 2, width / 2
    return World(
        seen=lambda x, force, dt: (x, _mean(force, width, dt)),
        late=lambda t: (0 * t + width / 2, 0 * t),
        lag=lag,
    )


def at_end(share: float) -> World:
    """The position sensor reads no further than a share of the way."""
    return World(end=share)


def decaying(tau: float) -> World:
    """A charge amplifier: a force that stays reads as one that decays with tau [s]."""
    return World(seen=lambda x, force, dt: (x, force - _lagged(force, tau, dt)))


def creeping(share: float, tau: float) -> World:
    """A load cell that gives on by a share of its load with tau [s]."""
    return World(seen=lambda x, force, dt: (x, force + share * _lagged(force, tau, dt)))


def guided(mu: float, way: float) -> World:
    """Friction in the guide in proportion to the load, which turns within a way [m] (Dahl, 1968)."""
    return World(felt=lambda x, force: force * (1 + mu * _dahl(x, way)), friction=mu)


def sticky(pull: float, way: float) -> World:
    """A drop between probe and surface: it pulls [N] from the touch until they are a way [m] apart."""
    return World(felt=lambda x, force: force - pull * _bridged(x, force, way))


def cabled(stiffness: float) -> World:
    """A cable pulls in proportion to the way [N/m]."""
    return World(felt=lambda x, force: force + stiffness * (x - x[0]), spring=stiffness)


def humming(size: float, frequency: float, phase: float) -> World:
    """Mains in the force [N]."""

    def seen(x: Array, force: Array, dt: float) -> tuple[Array, Array]:
        return x, force + size * np.sin(2 * np.pi * frequency * dt * np.arange(len(x)) + phase)

    return World(seen=seen)


def playing(width: float) -> World:
    """The position is read behind a gear with play [m]."""
    return World(seen=lambda x, force, _: (_play(x, width / 2), force))


def late_position(delay: float) -> World:
    """The position is read late [s], as of a controller that reports its last cycle."""
    return World(late=lambda t: (0 * t, 0 * t + delay), lag=(-delay, -delay))


def networked(delay: float, rng: Rng) -> World:
    """The force comes over a network whose delay wanders, up to `delay` [s]."""
    knots = rng.uniform(0, delay, 600)
    return World(late=lambda t: (np.interp(t, 0.1 * np.arange(600), knots), 0 * t), lag=(0.0, delay))


def two_clocks(rate: float, longest: float = 60.0) -> World:
    """The force's clock runs slower by a share."""
    return World(late=lambda t: (rate * t, 0 * t), lag=(0.0, rate * longest))


def ringing(frequency: float, damping: float) -> World:
    """The force sensor swings with its tool at a frequency [Hz] and a share of the critical damping."""
    return World(seen=lambda x, force, dt: (x, _resonant(force, frequency, damping, dt)))


def _mean(signal: Array, width: float, dt: float) -> Array:
    """Mean over a time about each sample, shape (n,)."""
    half = max(int(width / dt / 2), 1)
    sums = np.cumsum(np.pad(signal, (half + 1, half), mode="edge"))
    return (sums[2 * half + 1 :] - sums[: -2 * half - 1]) / (2 * half + 1)


def _lagged(signal: Array, tau: float, dt: float) -> Array:
    from scipy.signal import lfilter

    keep = np.exp(-dt / tau)
    return lfilter([1 - keep], [1, -keep], signal)


def _resonant(signal: Array, frequency: float, damping: float, dt: float) -> Array:
    from scipy.signal import cont2discrete, lfilter

    w = 2 * np.pi * frequency
    top, bottom, _ = cont2discrete(([w**2], [1, 2 * damping * w, w**2]), dt, method="foh")
    return lfilter(top.ravel(), bottom, signal - signal[0]) + signal[0]


@njit(cache=True)
def _dahl(x, way):
    z = np.zeros_like(x)
    for i in range(1, len(x)):
        to = 1.0 if x[i] >= x[i - 1] else -1.0
        z[i] = to + (z[i - 1] - to) * np.exp(-abs(x[i] - x[i - 1]) / way)
    return z


@njit(cache=True)
def _bridged(x, force, way):
    found, joined, left = np.zeros_like(x), False, 0.0
    for i in range(len(x)):
        if force[i] > 0.0:
            joined, left = True, x[i]
        elif left - x[i] > way:
            joined = False
        found[i] = 1.0 if joined else 0.0
    return found


@njit(cache=True)
def _play(x, half):
    found, at = np.empty_like(x), x[0]
    for i in range(len(x)):
        at = min(max(at, x[i] - half), x[i] + half)
        found[i] = at
    return found
