"""What one update from Python costs, three parameters, and what it buys: ours and others' on the same samples.

    python benchmarks/online/update.py

Times are medians over rounds in which all take their turn, ratios medians of each round's own, so that what else the
machine does weighs on all alike. Errors are rms over seeds, over the Cramer-Rao bound of the same samples.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np
from others import Filterpy, Network, Padasip, Thesis
from pressing import NOISE, TONES, Array

from palpate.identifiers import RecursiveLeastSquares, RestartingLeastSquares, SIFt

TRUTH = np.array([0.1, 200.0, 5200.0])  # M [kg], B [N s/m], K [N/m]: the thesis' foam
START, VAGUE = np.zeros(3), np.diag([1e2, 1e6, 1e10])
SAMPLES, ROUNDS, SEEDS = 400, 61, 60
NONE = (0.0, 0.0, 0.0)
MAKERS: dict[str, Callable[[], Any]] = {
    "RecursiveLeastSquares": lambda: RecursiveLeastSquares(START, VAGUE),
    "  exponential 0.999": lambda: RecursiveLeastSquares(START, VAGUE, 0.999),
    "  SIFt 0.999": lambda: RecursiveLeastSquares(START, VAGUE, SIFt(0.999)),
    "RestartingLeastSquares": lambda: RestartingLeastSquares(START, VAGUE),
    "padasip FilterRLS": lambda: Padasip(START, VAGUE, 1.0),
    "filterpy KalmanFilter": lambda: Filterpy(START, VAGUE, NONE, 1e-3, NOISE),
    "thesis, eq. 5.7-5.10": lambda: Thesis(START, VAGUE, 1.0),
    "thesis, network": Network,
}


def waves(random: np.random.Generator, samples: int) -> Array:
    """Acceleration, rate and penetration of four tones at 1 kHz, shape (samples, 3)."""
    t = np.arange(samples) / 1000.0
    phi = np.zeros((samples, 3))
    phi[:, 2] = 5e-3
    for frequency, _ in TONES["four tones"]:
        omega = 2 * np.pi * frequency
        z = omega * t + random.uniform(0.0, 2 * np.pi)
        phi += 4e-4 * np.column_stack([-(omega**2) * np.sin(z), omega * np.cos(z), np.sin(z)])
    return phi


def press(seed: int, samples: int) -> tuple[Array, Array]:
    """Regressors and forces of a press of foam."""
    random = np.random.default_rng(seed)
    phi = waves(random, samples)
    return phi, phi @ TRUTH + random.normal(0.0, NOISE, samples)


def times() -> dict[str, Array]:
    """Seconds an update takes, in each round."""
    phi, force = press(0, SAMPLES)
    rows, forces = list(phi), force.tolist()
    estimators = {name: make() for name, make in MAKERS.items()}
    taken: dict[str, list[float]] = {name: [] for name in MAKERS}
    for _ in range(ROUNDS):
        for name, estimator in estimators.items():
            update = estimator.update
            begun = time.perf_counter()
            for row, f in zip(rows, forces, strict=True):
                update(row, f)
            taken[name].append((time.perf_counter() - begun) / SAMPLES)
    return {name: np.array(seconds) for name, seconds in taken.items()}


def errors() -> dict[str, Array]:
    """Rms error of M, B and K after one second, over the bound."""
    scaled: dict[str, list[Array]] = {name: [] for name in MAKERS}
    for seed in range(SEEDS):
        phi, force = press(seed, 1000)
        bound = NOISE * np.sqrt(np.diag(np.linalg.inv(phi.T @ phi)))
        for name, make in MAKERS.items():
            estimator = make()
            estimator.update_many(phi, force)
            scaled[name].append((estimator.theta - TRUTH) / bound)
    return {name: np.sqrt(np.mean(np.square(rows), axis=0)) for name, rows in scaled.items()}


def main() -> None:
    taken, wrong = times(), errors()
    filterpy, padasip = taken["filterpy KalmanFilter"], taken["padasip FilterRLS"]
    print(f"{'':24}{'update':>10}{'/ filterpy':>12}{'/ padasip':>12}   rms error over the bound: M, B, K")
    for name, seconds in taken.items():
        M, B, K = wrong[name]
        print(
            f"{name:24}{1e6 * np.median(seconds):7.2f} us{np.median(seconds / filterpy):12.3f}"
            f"{np.median(seconds / padasip):12.3f}   {M:10.3g}{B:10.3g}{K:10.3g}"
        )


if __name__ == "__main__":
    main()
