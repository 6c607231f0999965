"""Hostile streams into the force loop: does a speed leave that is not finite, or beyond the arm's limit.

    python benchmarks/force/hostile.py [--samples 20000000] [--arms ur5e fr3] [--seed 0]

A tenth of the readings and a twentieth of the positions are one of fifteen values from NaN to 1e300, and the ticks
missed may be anything; the rest is noise about a press, or a walk of any pace.
"""

from __future__ import annotations

import argparse

import numpy as np
from rich.progress import track

from palpate.force import ForceLoop, load_arm
from palpate.force.gains import gains_for

HOSTILE = np.array(
    [0.0, -0.0, 1e-300, 1e77, -1e77, 1e154, 1e300, np.nan, np.inf, -np.inf, 5.0, 99.5, 101.0, 999.0, -999.0]
)
CHUNK = 100_000


def stream(rng, n):
    """Force [N], position [m] and missed ticks, shape (n,) each."""
    force = rng.normal(rng.uniform(-10.0, 40.0), 10.0 ** rng.uniform(-2.0, 2.0), n)
    place = np.cumsum(rng.normal(0.0, 10.0 ** rng.uniform(-9.0, 0.0), n))
    spoiled = rng.random(n) < rng.choice([0.0, 0.001, 0.1])
    force[spoiled] = rng.choice(HOSTILE, spoiled.sum())
    elsewhere = rng.random(n) < rng.choice([0.0, 0.001, 0.05])
    place[elsewhere] = rng.choice(HOSTILE, elsewhere.sum())
    return force, place, rng.choice([0.0, 0.0, 0.0, 1.0, 50.0, np.nan, -1.0], n)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--samples", type=int, default=20_000_000)
    parser.add_argument("--arms", nargs="+", default=["ur5e", "fr3"])
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    for name in options.arms:
        gains = gains_for(load_arm(name), 20.0)
        limit, bad, rng = gains.arm.limits.speed, 0, np.random.default_rng(options.seed)
        for _ in track(range(options.samples // CHUNK), name, transient=True):
            loop = ForceLoop(gains)
            update = loop.update
            for row in zip(*stream(rng, CHUNK), strict=True):
                bad += not abs(update(*map(float, row))) <= limit
        print(f"{gains.arm.title}: {bad} of {options.samples} speeds not finite or beyond the limit")


if __name__ == "__main__":
    main()
