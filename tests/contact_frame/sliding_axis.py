"""Simulated logs of a joint or an axis that slides: its friction is known, and nothing is shared with the estimator."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from palpate.records import Record

MOTIONS = ("steps", "sine", "two sines", "trapezia", "triangle")


@dataclass(frozen=True)
class Truth:
    """Friction of an axis in SI: Coulomb Fc, viscous B, offset F0, static Fs, Stribeck speed vs; its kind of motion."""

    Fc: float
    B: float
    F0: float
    Fs: float
    vs: float
    motion: str


def speed_of(motion: str, time: np.ndarray, fastest: float, rng: np.random.Generator) -> np.ndarray:
    """A motion in both directions at several speeds."""
    seconds, dt = time[-1], time[1]
    if motion == "steps":
        levels = fastest * rng.permutation(np.geomspace(0.05, 1.0, rng.integers(4, 8)))
        signed = np.column_stack([levels, -levels]).ravel()
        stairs = signed[np.minimum((time / seconds * len(signed)).astype(int), len(signed) - 1)]
        width = int(0.05 / dt)
        return np.convolve(stairs, np.ones(width) / width, "same")
    if motion == "sine":
        return fastest * np.sin(2 * np.pi * rng.uniform(0.2, 1.0) * time)
    if motion == "two sines":
        return fastest * (0.6 * np.sin(2 * np.pi * 0.23 * time) + 0.4 * np.sin(2 * np.pi * 0.71 * time + 1))
    if motion == "trapezia":
        period = rng.uniform(2.0, 4.0)
        heights = fastest * rng.permuted(np.resize([0.25, 0.5, 1.0], int(seconds / period) + 1))
        return heights[(time / period).astype(int)] * np.clip(4 * np.sin(2 * np.pi * time / period), -1, 1)
    return fastest * (4 * abs((3 * time / seconds) % 1 - 0.5) - 1)


def coloured_noise(rng: np.random.Generator, count: int, dt: float, memory: float, std: float) -> np.ndarray:
    """Noise that is correlated over a time [s]."""
    keep = np.exp(-dt / memory)
    white = std * np.sqrt(1 - keep**2) * rng.standard_normal(count)
    return lfilter([1.0], [1.0, -keep], white)


def simulate(seed: int, motion: str = "", position: bool | None = None) -> tuple[Record, Truth]:
    """A log with white and coloured noise, an offset, inertia, and in two of three a Stribeck effect.

    Args:
        seed: of everything that is random.
        motion: one of `MOTIONS`; random if empty.
        position: whether the log has an angle, noisy or in counts, in place of a noisy speed; random if None.
    """
    rng = np.random.default_rng(seed)
    dt = rng.choice([1e-3, 2e-3, 8e-3])
    time = dt * np.arange(int(rng.uniform(15.0, 40.0) / dt))
    fastest = 10 ** rng.uniform(-2.0, 0.3)
    motion = motion or str(rng.choice(MOTIONS))
    speed = speed_of(motion, time, fastest, rng)
    Fc = 10 ** rng.uniform(-1.0, 1.0)
    B = Fc / fastest * rng.uniform(0.2, 1.5)
    truth = Truth(
        Fc, B, Fc * rng.normal(), Fc * rng.choice([1.0, 1.2, 1.5]), fastest * rng.uniform(0.03, 0.2), motion
    )
    inertia = Fc / (20.0 * fastest) * rng.uniform()
    level = truth.Fc + (truth.Fs - truth.Fc) * np.exp(-((speed / truth.vs) ** 2))
    torque = truth.F0 + np.sign(speed) * level + B * speed + inertia * np.gradient(speed, dt)
    noise = Fc * 10 ** rng.uniform(-2.0, -0.5)
    torque += noise * rng.standard_normal(len(time))
    torque += coloured_noise(rng, len(time), dt, 10 ** rng.uniform(-2.0, 0.7), noise * rng.uniform(0.0, 1.5))
    columns, units = {"time": time, "force": torque}, {"time": "s", "force": "N m"}
    if rng.random() < 0.6 if position is None else position:
        angle = dt * np.cumsum(speed)
        count = np.ptp(angle) * 10 ** rng.uniform(-5.0, -3.3)
        exact = rng.random() < 0.5
        columns["position"] = (
            count * np.round(angle / count) if exact else angle + count * rng.standard_normal(len(time))
        )
        units["position"] = "rad"
    else:
        columns["velocity"] = speed + 0.01 * fastest * rng.standard_normal(len(time))
        units["velocity"] = "rad/s"
    return Record(columns, units, {}), truth
