"""How often white noise in the air is taken for a contact by the lines through the readings.

    python benchmarks/force/false_alarms.py [--hours 100] [--seed 0]

A UR5e's sensor, 480 readings a second, for which starts are eight readings apart.
"""

from __future__ import annotations

import argparse

import numpy as np
from rich.progress import track

from palpate._jit import kernel, law
from palpate.force.onset import NO_STARTS, explained, later

EVERY, SAMPLING, PART = 8.0, 480, 360
"""Readings between starts; a second [Hz]; length of a run [s]."""
LEVELS = np.arange(14.0, 33.0, 2.0)


@law
def alarms(noise, every, levels, counts, armed):
    """How often what is explained comes to each level, from half of it."""
    starts = NO_STARTS
    for k in range(len(noise)):
        starts = later(starts, every, 1e-5 * k, noise[k])
        if starts.readings > 2.0 * every:
            found = explained(starts)
            for i in range(len(levels)):
                if found > levels[i]:
                    counts[i] += armed[i]
                    armed[i] = 0.0
                elif found < 0.5 * levels[i]:
                    armed[i] = 1.0
    return counts


count = kernel(alarms)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--hours", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    told = parser.parse_args()
    rng, counts, armed = np.random.default_rng(told.seed), np.zeros(len(LEVELS)), np.ones(len(LEVELS))
    for _ in track(range(told.hours * 3600 // PART), "air", transient=True):
        count(rng.standard_normal(PART * SAMPLING), EVERY, LEVELS, counts, armed)
    for level, alarm in zip(LEVELS, counts, strict=True):
        print(f"explained {level:4.0f} variances: {int(alarm):6d} times in {told.hours} h")


if __name__ == "__main__":
    main()
