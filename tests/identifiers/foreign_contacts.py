"""Presses by a simulator of its own, NumPy alone: what an estimator on line meets outside the bench.

It shares nothing with `palpate.bench`: the tip's motion is given in closed form, the contact is integrated here, and
the sensor's low-pass is applied by Fourier.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import pi, sin

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

FINE = 16_000
"""Steps a second of the contact [Hz]."""
FAULTS = (
    "none", "dropped", "not a number", "chatter", "saturation", "loss of contact", "begins in air", "coarse encoder",
    "surface changes", "relaxing",
)  # fmt: skip


@dataclass(frozen=True)
class Press:
    """A press as the loop has it.

    Args:
        position, force: a tick each, shape (n,) [m], [N]; NaN where a tick is missing.
        low_pass, rate, lag, sampling: as `ContactIdentifier` takes them.
        truth: for M, B and K, the lowest and highest value that is true.
        recipe: what was drawn.
    """

    position: Array
    force: Array
    low_pass: str
    rate: float
    lag: float
    sampling: float | None
    truth: dict[str, tuple[float, float]]
    recipe: dict[str, float | str] = field(default_factory=dict)


def press(seed: int, fault: str = "none", seconds: float = 4.0) -> Press:
    """The press of a seed, with one fault of `FAULTS`."""
    rng = np.random.default_rng([seed, FAULTS.index(fault)])
    K, B = 10 ** rng.uniform(2.7, 4.3), 0.0
    B = K * 10 ** rng.uniform(-2.7, -1.7)
    M = rng.uniform(0.1, 0.5) if rng.random() < 0.4 else 0.0
    order, cutoff = int(rng.integers(2, 5)), float(rng.uniform(60, 180))
    rate = 1000.0
    sampling = None if rng.random() < 0.5 else float(rng.choice([250.0, 480.0, 500.0]))
    t = np.arange(round(seconds * FINE)) / FINE
    depth = rng.uniform(5, 25) / K
    x, tones = _motion(rng, t, depth, fault)
    arm, tau = (rng.uniform(0.4, 1.5) * K, rng.uniform(0.02, 0.2)) if fault == "relaxing" else (0.0, 1.0)
    K2 = K * 10 ** (rng.choice([-1, 1]) * rng.uniform(0.25, 0.6)) if fault == "surface changes" else K
    turn = rng.uniform(0.4, 0.6) * seconds
    force = _contact(t, x, np.where(t < turn, K, K2), B, M, arm, tau)
    noise = float(10 ** rng.uniform(-2, -0.5)) * float(np.std(force))
    delay = rng.uniform(0, 3e-3)
    felt = _filtered(force, order, cutoff)
    limit = rng.uniform(0.6, 0.85) * float(np.quantile(felt, 0.999)) if fault == "saturation" else np.inf
    ticks = np.arange(round((seconds - 0.05) * rate)) / rate
    samples = np.arange(0, seconds, 1 / (sampling or rate)) + (
        rng.uniform(0, 1 / sampling) if sampling else 0.0
    )
    values = np.interp(samples - delay, t, felt) + rng.normal(0, noise, len(samples))
    bias = rng.uniform(-2, 2)
    step = 10 ** rng.uniform(-4, -2.5) * float(np.ptp(values))
    values = np.minimum(np.round(values / step) * step, np.floor(limit / step) * step) + bias
    latest = np.searchsorted(samples, ticks + 1e-12, side="right") - 1
    read = values[np.maximum(latest, 0)]
    count = (
        float(np.ptp(x)) / rng.uniform(4, 40)
        if fault == "coarse encoder"
        else float(np.ptp(x)) * 10 ** rng.uniform(-5, -3.5)
    )
    position = np.round((np.interp(ticks, t, x) + rng.uniform(0, count)) / count) * count
    if fault in ("dropped", "not a number"):
        _lose(rng, position, read, together=fault == "dropped")
    truth = {"M": (M, M), "B": (B, B), "K": (K2, K2)}
    if arm:
        omega = 2 * pi * np.array([0.8 * min(tones), 1.25 * max(tones)])
        storage = arm * (omega * tau) ** 2 / (1 + (omega * tau) ** 2)
        loss = arm * tau / (1 + (omega * tau) ** 2)
        truth |= {"K": (K, K + float(storage[1])), "B": (B + float(loss[1]), B + float(loss[0]))}
    lag = 1 / (2 * pi * cutoff * sin(pi / (2 * order))) + delay
    recipe = {"K": K, "B": B, "M": M, "noise": noise, "count": count, "depth": depth, "tones": str(tones)}
    return Press(position, read, f"butterworth{order}:{cutoff!r}", rate, lag, sampling, truth, recipe)


def _motion(rng: np.random.Generator, t: Array, depth: float, fault: str) -> tuple[Array, list[float]]:
    """Penetration [m] and the frequencies in it [Hz]; below zero is free space."""
    tones = sorted(
        rng.uniform(0.5, 3, 1).tolist() + rng.uniform(3, 12, 1).tolist() + rng.uniform(12, 35, 1).tolist()
    )
    parts = [
        a * depth * np.sin(2 * pi * f * t + rng.uniform(0, 2 * pi))
        for a, f in zip((0.4, 0.15, 0.05), tones, strict=True)
    ]
    x = depth + sum(parts)
    if fault == "chatter":
        tones = [float(rng.uniform(8, 25))]
        x = 0.3 * depth + depth * np.sin(2 * pi * tones[0] * t)
    if fault == "loss of contact":
        period = rng.uniform(0.8, 1.5)
        away = np.clip(4 * np.sin(2 * pi * t / period + rng.uniform(0, 6)) - 2.0, 0, 1)
        x -= away**2 * (3 - 2 * away) * depth * rng.uniform(2.0, 4.0)
    if fault == "begins in air":
        down = np.clip((t - rng.uniform(0.3, 1.0)) / rng.uniform(0.2, 0.8), 0, 1)
        x -= (1 - down**2 * (3 - 2 * down)) * depth * rng.uniform(2.0, 4.0)
    return x, tones


def _contact(t: Array, x: Array, K: Array, B: float, M: float, arm: float, tau: float) -> Array:
    """Force on a one-sided surface: spring, damper, mass and a relaxing arm; it never pulls."""
    dt = t[1] - t[0]
    v = np.gradient(x, dt)
    a = np.gradient(v, dt)
    pushed = K * x + B * v + M * a + np.concatenate([[0.0], np.cumsum(-np.diff(K) * x[1:])])
    if arm:
        q, keep, behind = max(x[0], 0.0), np.exp(-dt / tau), np.empty_like(x)
        for k, depth in enumerate(np.maximum(x, 0.0).tolist()):
            q = keep * q + (1 - keep) * depth
            behind[k] = q
        pushed += arm * (x - behind)
    return np.where(x > 0, np.maximum(pushed, 0.0), 0.0)


def _filtered(force: Array, order: int, cutoff: float) -> Array:
    """Through a Butterworth low-pass in continuous time."""
    size = 1 << (2 * len(force)).bit_length()
    s = 1j * np.fft.rfftfreq(size, 1 / FINE) / cutoff
    gain = np.ones(len(s), complex)
    for k in range(order):
        gain /= s - np.exp(1j * pi * (2 * k + order + 1) / (2 * order))
    padded = np.concatenate([np.full(size // 2, force[0]), force, np.full(size // 2 - len(force), force[0])])
    return np.fft.irfft(np.fft.rfft(padded) * gain, size)[size // 2 :][: len(force)]


def _lose(rng: np.random.Generator, position: Array, force: Array, *, together: bool) -> None:
    """Five ticks of a hundred, and some gaps of up to 60; of both channels, or of each by itself."""
    for channels in ((position, force),) if together else ((position,), (force,)):
        lost = rng.random(len(position)) < 0.05
        for begin in rng.integers(0, len(position), 3):
            lost[begin : begin + rng.integers(5, 60)] = True
        for channel in channels:
            channel[lost] = np.nan
