"""Logs of a tip on a given path before the force sensor of the bench, for the tests of what knows the sensor."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from palpate.bench import ForceSensorTable, GivenMotion, given_motion
from palpate.environments import KelvinVoigt
from palpate.records import Record
from palpate.signals.low_pass import LowPass

Array = NDArray[np.float64]

FOAM = KelvinVoigt(5200.0, 60.0, 0.3)
TRUTH = {"K": 5200.0, "B": 60.0, "M": 0.3}
SAMPLING = 480.0


@dataclass(frozen=True)
class SensorLog:
    """A log, with what its force sensor states of itself.

    Args:
        record: time [s], position [m], force [N].
        low_pass: of the sensor.
        lag: of a fresh reading, low-pass included [s].
        true_position: at the rows, shape (n,) [m].
    """

    record: Record
    low_pass: LowPass
    lag: float
    true_position: Array


def press_and_chirp(t: Array, duration: float = 3.0) -> Array:
    """From 1 mm above the surface 3 mm into it, then sines of equal velocity swept from 0.5 to 40 Hz [m]."""
    u = np.clip((t - 0.3) / 0.2, 0, 1)
    down = u**3 * (10 - 15 * u + 6 * u * u)
    s = np.clip(t - 0.5, 0, None)
    growth = np.log(80.0) / (duration - 0.5)
    phase = 2 * np.pi * 0.5 * (np.exp(growth * s) - 1) / growth
    speed = 0.5 * np.exp(growth * s)
    ease = 1 - np.exp(-((s / 0.2) ** 2))
    return -1e-3 + 4e-3 * down + ease * 1e-3 * np.sin(phase) / (1 + speed / 2)


def press_in_steps(t: Array) -> Array:
    """From 1 mm above the surface into it, and there from depth to depth in 60 ms each [m]."""
    x = np.full_like(t, -1e-3)
    for begin, depth in ((0.3, 3e-3), (0.8, 1e-3), (1.2, -1.2e-3), (1.7, 0.8e-3), (2.2, -0.9e-3)):
        u = np.clip((t - begin) / 0.06, 0, 1)
        x += depth * u**3 * (10 - 15 * u + 6 * u * u)
    return x


PATHS = {"chirp": press_and_chirp, "steps": press_in_steps}


def rig(seed: int = 0, surface: KelvinVoigt = FOAM, resolution: float = 0.0, **sensor: float) -> GivenMotion:
    """True position, the sensor's noise of 0.6 N, and a phase of the sensor's clock that goes with the seed."""
    phase = float(np.random.default_rng([seed, 7]).uniform(0, 1 / SAMPLING))
    return given_motion(surface, resolution=resolution, sensor=ForceSensorTable(**{"phase": phase, **sensor}))


def sensor_log(
    path: str = "chirp", seed: int = 0, noise_of_position: float = 0.0, **changes: float
) -> SensorLog:
    """3 s of a path; `changes` of the rig; the position with white noise [m] if asked."""
    run = rig(seed, **changes).run(PATHS[path], 3.0, seed=seed)
    told = run.meta["instruments"]["force"]
    low_pass = LowPass.parse(told["filter"])
    position = run["x_measured"]
    if noise_of_position:
        position = position + np.random.default_rng([seed, 8]).normal(0, noise_of_position, len(position))
    return SensorLog(
        log(run["t"], position, run["force_sampled"]), low_pass, low_pass.lag + told["delay_s"], run["x"]
    )


def log(time: Array, position: Array, force: Array) -> Record:
    """A record with the three columns of a log."""
    return Record(
        {"time": time, "position": position, "force": force}, {"time": "s", "position": "m", "force": "N"}
    )
