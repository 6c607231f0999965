"""A day of stillness at 1 kHz: does the covariance stay bounded, and is the next press identified as fast as the first?

    python benchmarks/online/stillness.py                 # 24 h, two kinds of stillness: minutes
    python benchmarks/online/stillness.py --hours 0.5

Every estimator presses, rests for so long with the tip at 10 mm, and presses again: on the same surface, and on
another, nine times as stiff. "still" is exact, "restless" has noise of 5 um and 0.1 mm/s in the regressor.
"""

from __future__ import annotations

import argparse
import copy
from typing import Any

import numpy as np
from pressing import NOISE, REST, START, STIFFEST, VAGUE, motion, press, regressors

from palpate.identifiers import (
    Exponential,
    RecursiveLeastSquares,
    RestartingLeastSquares,
    SIFt,
)

SOFT, HARD = (60.0, 7e3), (150.0, 62e3)  # B [N s/m], K [N/m]
FORCE = SOFT[1] * REST  # at rest [N]
CHUNK = 1_000_000
PRESSES = 25
MAKERS = {
    "exponential 0.998": lambda: RecursiveLeastSquares(START, VAGUE, Exponential(0.998)),
    "SIFt 0.994": lambda: RecursiveLeastSquares(START, VAGUE, SIFt(0.994)),
    "restarting": lambda: RestartingLeastSquares(START, VAGUE),
    "restarting, SIFt 0.994": lambda: RestartingLeastSquares(START, VAGUE, SIFt(0.994)),
    "no forgetting": lambda: RecursiveLeastSquares(START, VAGUE),
}


def pressed(estimator: Any) -> Any:
    """The estimator after two seconds of the first surface."""
    random = np.random.default_rng(0)
    phi = regressors(*motion(random, "four tones", 2000, 1000.0, STIFFEST / SOFT[1]))
    estimator.update_many(phi, phi @ [*SOFT, 0.0] + random.normal(0.0, NOISE, len(phi)))
    return estimator


def rest(estimators: dict[str, Any], hours: float, restless: bool) -> dict[str, float]:
    """Largest variance of each, over the initial one, in a rest of so many hours."""
    random = np.random.default_rng(1)
    widest = dict.fromkeys(estimators, 0.0)
    left = round(hours * 3.6e6)
    while left > 0:
        samples = min(CHUNK, left)
        left -= samples
        x, v = np.full(samples, REST), np.zeros(samples)
        if restless:
            x += random.normal(0.0, 5e-6, samples)
            v += random.normal(0.0, 1e-4, samples)
        phi = regressors(x, v)
        force = phi @ [*SOFT, 0.0] + random.normal(0.0, NOISE, samples)
        for name, estimator in estimators.items():
            estimator.update_many(phi, force)
            P = estimator.covariance
            if not (np.isfinite(P).all() and np.linalg.eigvalsh(P)[0] > 0.0):
                widest[name] = np.inf
            widest[name] = max(widest[name], float((np.diag(P) / np.diag(VAGUE)).max()))
    return widest


def median(estimator: Any, surface: tuple[float, float]) -> float:
    """Median over presses of the samples needed."""
    return float(np.median([press(estimator, seed, *surface, FORCE) for seed in range(PRESSES)]))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--hours", type=float, default=24.0)
    hours = parser.parse_args().hours
    fresh = {name: make() for name, make in MAKERS.items()}
    first = {name: median(e, SOFT) for name, e in fresh.items()}
    anew = {name: median(e, HARD) for name, e in fresh.items()}
    for restless in (False, True):
        estimators = {name: pressed(copy.deepcopy(e)) for name, e in fresh.items()}
        widest = rest(estimators, hours, restless)
        kind = "restless" if restless else "still"
        print(f"\n{kind} for {hours:g} h; samples until K is within 2 %, median of {PRESSES} presses")
        print(f"{'':34}{'variance':>10}{'first':>8}{'again':>8}{'harder':>8}{'(fresh)':>8}{'std of K':>10}")
        for name, e in estimators.items():
            again, harder = median(e, SOFT), median(e, HARD)
            print(
                f"{name:34}{widest[name]:10.2g}{first[name]:8.0f}{again:8.0f}{harder:8.0f}{anew[name]:8.0f}"
                f"{e.estimate().std[1]:10.3g}"
            )
    print("variance: the largest of P over the initial one; harder: nine times as stiff as before the rest")


if __name__ == "__main__":
    main()
