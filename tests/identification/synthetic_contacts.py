"""Logs of contacts whose truth is known, for the tests of the identification."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from palpate.records import Record

Array = NDArray[np.float64]


def multisine(
    time: Array, low: float, high: float, count: int, rng: np.random.Generator
) -> tuple[Array, ...]:
    """A sum of sines of equal velocity between two frequencies [Hz]: position, velocity, acceleration."""
    omega = 2 * np.pi * np.geomspace(low, high, count)[:, None]
    phase = rng.uniform(0, 2 * np.pi, (count, 1))
    x = np.sin(omega * time + phase) / omega
    v = np.cos(omega * time + phase)
    a = -np.sin(omega * time + phase) * omega
    return x.sum(0), v.sum(0), a.sum(0)


def coloured(n: int, std: float, pole: float, rng: np.random.Generator) -> Array:
    """Noise of first order: e[k] = pole e[k-1] + white, with the standard deviation given."""
    white = rng.normal(0, std * np.sqrt(1 - pole**2), n)
    out = np.empty(n)
    last = rng.normal(0, std)
    for k in range(n):
        last = pole * last + white[k]
        out[k] = last
    return out


def record(time: Array, position: Array, force: Array) -> Record:
    return Record(
        {"time": time, "position": position, "force": force}, {"time": "s", "position": "m", "force": "N"}
    )


def shaken(
    k: float = 5000.0,
    b: float = 40.0,
    m: float = 0.5,
    lag: float = 0.0,
    noise: float = 0.2,
    pole: float = 0.95,
    seed: int = 0,
    n: int = 4000,
    band: tuple[float, float] = (0.5, 40.0),
    position_noise: float = 0.0,
) -> Record:
    """A probe in steady contact, shaken over a band: f = 10 N + k x + b v + m a, read `lag` seconds late."""
    rng = np.random.default_rng(seed)
    time = np.arange(n) / 1000
    exciting = np.random.default_rng(1)
    scale = 2e-3
    x = multisine(time, *band, 25, exciting)[0] * scale
    late = multisine(time - lag, *band, 25, np.random.default_rng(1))
    f = 10 + scale * (k * late[0] + b * late[1] + m * late[2]) + coloured(n, noise, pole, rng)
    return record(time, x + rng.normal(0, position_noise, n), f)


def pressed(
    k: float = 5000.0,
    b: float = 40.0,
    seed: int = 0,
    noise: float = 0.05,
    pole: float = 0.9,
    ramp: float = 0.06,
    n: int = 3000,
    lag: float = 0.0,
) -> Record:
    """A probe that comes down, presses for a second, and leaves: f = max(k d + b d', 0) + noise."""
    time = np.arange(n) / 1000
    x = press_path(time, ramp)
    f = force_of(press_path(time - lag, ramp), lambda d, v: k * d + b * v, 1e-3)
    return record(time, x, f + coloured(n, noise, pole, np.random.default_rng(seed)))


def press_path(time: Array, ramp: float) -> Array:
    """Down from -1 mm to 2 mm, three small dips at the bottom, and up again."""

    def smooth(u: Array) -> Array:
        u = np.clip(u, 0, 1)
        return u**3 * (10 - 15 * u + 6 * u * u)

    down = smooth((time - 0.5) / ramp) - smooth((time - 2.0) / ramp)
    dips = sum(smooth((time - t) / ramp) - smooth((time - t - 0.15) / ramp) for t in (0.8, 1.2, 1.6))
    return -1e-3 + 3e-3 * down + 1e-3 * dips


def force_of(x: Array, law: object, dt: float) -> Array:
    v = np.gradient(x, dt)
    d = np.maximum(x, 0.0)
    return np.where(x > 0, np.maximum(law(d, v), 0.0), 0.0)  # type: ignore[operator]
