"""Given motion on a spring and damper, and how long an estimator needs to know the spring."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

NOISE = 0.6  # standard deviation of a force sample [N]
START = np.zeros(3)
VAGUE = np.diag([1e6, 1e10, 1e6])  # covariance of B [N s/m], K [N/m] and offset [N] before anything is known
TOLERANCE = 0.02
REST = 1e-2  # penetration about which it moves [m]
TONES = {  # [Hz], [m]: no more than the stiffest lets move within contact and the sensor's range
    "one tone": ((2.0, 3e-4),),
    "four tones": ((0.7, 9e-5), (2.0, 9e-5), (5.0, 9e-5), (11.0, 9e-5)),
    "slow": ((0.2, 3e-4),),
}


def motion(random: np.random.Generator, kind: str, samples: int, rate: float) -> tuple[Array, Array]:
    """Penetration [m] about `REST` and its rate [m/s]: tones whose amplitude, frequency and phase are the seed's."""
    t = np.arange(samples) / rate
    x, v = np.full(samples, REST), np.zeros(samples)
    for frequency, amplitude in TONES[kind]:
        omega = 2 * np.pi * frequency * random.uniform(0.8, 1.2)
        A, phase = amplitude * random.uniform(0.5, 1.5), random.uniform(0.0, 2 * np.pi)
        x += A * np.sin(omega * t + phase)
        v += A * omega * np.cos(omega * t + phase)
    return x, v


def regressors(x: Array, v: Array) -> Array:
    """Rate, penetration and one, for B, K and the offset, shape (samples, 3)."""
    return np.column_stack([v, x, np.ones_like(x)])


def followed(estimator: Any, phi: Array, force: Array) -> Array:
    """The stiffness after each sample, by updates one at a time."""
    K = np.empty(len(force))
    for k, (row, f) in enumerate(zip(phi, force.tolist(), strict=True)):
        estimator.update(row, f)
        K[k] = estimator.theta[1]
    return K


def samples_to_know(K: Array, truth: float) -> int:
    """How many samples it takes until the stiffness is within 2 % and stays there."""
    outside = np.flatnonzero(np.abs(K / truth - 1.0) > TOLERANCE)
    return int(outside[-1]) + 2 if len(outside) else 1
