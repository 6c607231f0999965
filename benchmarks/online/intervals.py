"""How often the 95 % intervals of the estimators on line hold the truth, and how wide they are.

    python benchmarks/online/intervals.py                  # 1,000 presses each: a minute

Presses of foam with four tones at 1 kHz, phases and noise the seed's; the noise is white, or first-order with a pole of
0.8, of the same variance. Widths are over those of the Cramer-Rao bound of white noise with nothing forgotten.
"""

from __future__ import annotations

import argparse
from typing import Any

import numpy as np
from pressing import NOISE, Array
from scipy.signal import lfilter
from update import START, TRUTH, VAGUE, waves

from palpate.identifiers import RecursiveLeastSquares, RestartingLeastSquares, SIFt

MAKERS = {
    "least squares": lambda: RecursiveLeastSquares(START, VAGUE),
    "exponential 0.995": lambda: RecursiveLeastSquares(START, VAGUE, 0.995),
    "SIFt 0.99": lambda: RecursiveLeastSquares(START, VAGUE, SIFt(0.99)),
    "restarting": lambda: RestartingLeastSquares(START, VAGUE),
}


def noise(random: np.random.Generator, samples: int, pole: float) -> Array:
    """First-order noise of standard deviation `NOISE` [N]."""
    white = random.normal(0.0, NOISE, samples + 100)
    return np.asarray(lfilter([np.sqrt(1.0 - pole**2)], [1.0, -pole], white)[100:])


def trial(estimator: Any, seed: int, samples: int, pole: float) -> tuple[Array, Array]:
    """Whether each interval holds the truth, and its width over the bound's."""
    random = np.random.default_rng(seed)
    phi = waves(random, samples)
    estimator.update_many(phi, phi @ TRUTH + noise(random, samples, pole))
    estimate = estimator.estimate()
    bound = NOISE * np.sqrt(np.diag(np.linalg.inv(phi.T @ phi)))
    return np.abs(estimate.theta - TRUTH) < 1.96 * estimate.std, estimate.std / bound


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--presses", type=int, default=1000)
    presses = parser.parse_args().presses
    print(f"{'':26}{'samples':>8}{'pole':>6}   coverage of M, B, K [%]     width / bound")
    for name, make in MAKERS.items():
        for samples in (1000, 4000):
            for pole in (0.0, 0.8):
                inside, wide = zip(
                    *(trial(make(), seed, samples, pole) for seed in range(presses)), strict=True
                )
                rates = "".join(f"{100 * rate:7.1f}" for rate in np.mean(inside, axis=0))
                widths = "".join(f"{width:7.2f}" for width in np.median(wide, axis=0))
                print(f"{name:26}{samples:8}{pole:6.1f}   {rates}    {widths}")


if __name__ == "__main__":
    main()
