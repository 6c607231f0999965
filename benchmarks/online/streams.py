"""Streams of position and force for the on-line identifier, from a simulator of its own: SciPy alone.

A stream has a surface (spring and damper, with a mass, relaxing, curved, rubbed), a motion, a low-pass and a lag, a
sensor that is sampled with the loop or at 480 Hz and held, and a position with white noise or encoder counts. The
surface may become another at half time.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi, sin

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid
from scipy.signal import butter, chirp, lfilter, sosfilt, sosfilt_zi

Array = NDArray[np.float64]
Range = tuple[float, float]

FINE, RATE = 20_000, 1000.0
"""Steps of the simulation and ticks of the loop a second [Hz]."""
SURFACES = ("spring-damper", "mass", "relaxing", "curved", "rubbed")
POSITIONS = ("exact", "white 1", "white 3", "white 10", "counts 1", "counts 2", "counts 5", "counts 10")
"""What is wrong with the position, and by how much [um]."""
SENSORS = ("each tick", "480 Hz")
MOTIONS = ("tones", "sweep", "presses")


@dataclass(frozen=True)
class Stream:
    """Position [m] and force [N] of each tick, shape (n,), and all that the identifier is given about them.

    Args:
        position, force: ticks at `RATE`.
        low_pass: of the force sensor.
        lag, lag_std: of the force behind the position, the low-pass included [s].
        sampling: of the force sensor [Hz], None where each tick has a sample.
        truth: by parameter the lowest and the highest value that is right; the surface's at the end.
        recipe: what was drawn.
    """

    position: Array
    force: Array
    low_pass: str
    lag: float
    lag_std: float
    sampling: float | None
    truth: dict[str, Range]
    recipe: dict[str, float | str]


def stream(
    seed: int, surface: str, position: str, sensor: str, *, changes: bool = False, seconds: float = 6.0
) -> Stream:
    """The stream of a seed."""
    rng = np.random.default_rng(seed)
    t = np.arange(round(seconds * FINE)) / FINE
    K = 10 ** rng.uniform(2.9, 4.2)
    kind = str(rng.choice(MOTIONS))
    middle = rng.uniform(6, 20) / K
    x = middle * (1.0 + 0.8 * _motion(rng, kind, t))
    force, truth = _surface(rng, surface, t, x, K, changes)
    order, cutoff = int(rng.integers(2, 5)), float(rng.uniform(50, 150))
    sos = butter(order, cutoff, fs=FINE, output="sos")
    felt = sosfilt(sos, force, zi=sosfilt_zi(sos) * force[0])[0]
    delay = float(rng.uniform(0, 4e-3))
    noise = 10 ** rng.uniform(-2.2, -1) * float(np.std(force))
    ticks = np.arange(100, round((seconds - 0.01) * RATE)) / RATE
    sampling = None if sensor == "each tick" else 480.0
    period = 1 / (sampling or RATE)
    samples = np.arange(0, seconds, period) + (rng.uniform(0, period) if sampling else 0.0)
    values = np.interp(samples - delay, t, felt) + rng.normal(0, noise, len(samples))
    values = np.round(values / 0.01) * 0.01 + rng.uniform(-2, 2)
    latest = np.searchsorted(samples, ticks + 1e-9, side="right") - 1
    read = np.interp(ticks, t, x) + rng.uniform(-0.5, 0.5)
    name, _, size = position.partition(" ")
    if name == "white":
        read = read + rng.normal(0, float(size) * 1e-6, len(read))
    elif name == "counts":
        count = float(size) * 1e-6
        read = np.round(read / count) * count
    lag = 1 / (2 * pi * cutoff * sin(pi / (2 * order))) + delay
    lag_std = float(rng.choice([0.0, 2e-4, 3e-3]))
    recipe: dict[str, float | str] = {
        "surface": surface, "K": K, "motion": kind, "middle": middle, "noise": noise, "cutoff": cutoff,
    }  # fmt: skip
    return Stream(
        read, values[latest], f"butterworth{order}:{cutoff!r}", max(lag + rng.normal(0, lag_std), 0.0),
        lag_std, sampling, truth, recipe,
    )  # fmt: skip


def _motion(rng: np.random.Generator, kind: str, t: Array) -> Array:
    """Between -1 and 1, shape (n,)."""
    if kind == "tones":
        tones = 10 ** np.sort(rng.uniform([-0.3, 0.3, 0.8], [0.3, 0.8, 1.3]))
        parts = [
            a * np.sin(2 * pi * f * t + rng.uniform(0, 2 * pi))
            for a, f in zip((0.6, 0.25, 0.1), tones, strict=True)
        ]
        return np.sum(parts, axis=0)
    if kind == "sweep":
        return 0.9 * chirp(t, rng.uniform(0.3, 1.0), t[-1], rng.uniform(6, 15), phi=rng.uniform(0, 360))
    # Presses and releases of a hand: a random walk of targets, each reached along a smooth path.
    holds = rng.uniform(-0.9, 0.9, 64)[(t * rng.uniform(2, 4)).astype(int)]
    sos = butter(4, 6.0, fs=FINE, output="sos")
    return np.asarray(np.clip(sosfilt(sos, holds, zi=sosfilt_zi(sos) * holds[0])[0], -1.0, 1.0))


def _surface(
    rng: np.random.Generator, surface: str, t: Array, x: Array, K: float, changes: bool
) -> tuple[Array, dict[str, Range]]:
    """Force [N], shape (n,), and the truth."""
    dt = t[1] - t[0]
    v = np.gradient(x, dt)
    B = K * 10 ** rng.uniform(-2.6, -1.9)
    M = rng.uniform(0.1, 0.6) if surface == "mass" else 0.0
    later = K * 10 ** (rng.choice([-1, 1]) * rng.uniform(0.2, 0.5)) if changes else K
    stiffness = np.where(t < 0.5 * t[-1], K, later)
    bend = 1.0 if surface != "curved" else 1.5
    spring = stiffness * x if bend == 1.0 else stiffness * x * np.sqrt(x / np.mean(x)) / bend
    if changes:  # the force goes on where it was
        spring = cumulative_trapezoid(
            np.gradient(spring, dt) * (np.diff(stiffness, prepend=K) == 0), dx=dt, initial=0
        )
    force = spring + B * v + M * np.gradient(v, dt)
    low = high = later
    if surface == "curved":
        low, high = (later * float(np.sqrt(np.quantile(x, q) / np.mean(x))) for q in (0.3, 0.7))
    lowest, highest = B, B
    if surface == "relaxing":
        arm, tau = rng.uniform(0.2, 0.6) * K, 10 ** rng.uniform(-1.5, -0.3)
        behind = lfilter([dt / tau], [1, dt / tau - 1], x, zi=[x[0] * (1 - dt / tau)])[0]
        force = force + arm * (x - behind)
        high, highest = later + arm, B + arm * tau
    if surface == "rubbed":
        force = force + rng.uniform(0.01, 0.04) * np.std(force) * np.tanh(v / 1e-4)
    truth = {"K": (low, high), "B": (lowest, highest), "M": (M, M)}
    return force - np.min(force) + 2.0, truth
