"""Presses by force control in steps: whether each slope by force holds.

    python benchmarks/identification/force_steps.py --worlds 60 --seed 100

A probe approaches, and the velocity follows the error of the force, to one to four levels a press, up or up and down,
one press or three. The surface is a spring or a power law beside one, with a damper; the log has a lag that is told in
half of the worlds, noise on both channels, and 125 to 1000 rows a second. The truth of a slope is the derivative of the
surface's force without the damper, at the force that the answer names.

The table says how many slopes there are, the share of 95 % intervals that hold the truth, the median half-width, and
which part of the force lies between the lowest and the highest slope.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from palpate.identification import identify
from palpate.records import Record

Array = NDArray[np.float64]
_STEP = 5e-4


@dataclass(frozen=True)
class World:
    """A log and its truth.

    Args:
        record: the log.
        lag: of the force, where it is told [s].
        slope: of the surface [N/m] at a force [N].
        most: highest force asked for [N].
    """

    record: Record
    lag: float | None
    slope: Callable[[float], float]
    most: float


def world_of(seed: int) -> World:
    """Draw a surface, a press and a log."""
    random = np.random.default_rng(seed)
    rate, presses = float(random.choice([125, 250, 500, 1000])), int(random.choice([1, 3]))
    levels = random.uniform(4, 30, random.integers(1, 5))
    levels = np.sort(levels) if random.random() < 0.6 else levels
    most, hold, stiffness = float(levels.max()), random.uniform(0.5, 4), 10 ** random.uniform(2.7, 4.5)
    power, deepest = float(random.choice([1.0, 1.5, 2.0])), most / stiffness
    bent = 0.6 if power > 1 else 0.0
    depth = np.linspace(0, 2 * deepest, 4000)
    law = stiffness * ((1 - bent) * depth + bent * deepest * (depth / deepest) ** power)
    slopes = np.gradient(law, depth)
    damping = stiffness * 10 ** random.uniform(-3.5, -2.2)
    gain, fastest = random.uniform(1.2, 4.8) / stiffness, float(random.choice([0.005, 0.02]))
    steps = [(hold, float(level)) for level in levels] + [(1.0, 0.0)]
    x, v, positions, forces = -0.004, 0.0, [], []
    for duration, asked in steps * presses:
        left = duration
        while left > 0:
            f = max(float(np.interp(x, depth, law)) + damping * v, 0.0) if x > 0 else 0.0
            left = duration if asked and f < 0.05 else left - _STEP
            fall = -fastest if x > -0.004 else 0.0
            v += 60 * _STEP * ((float(np.clip(gain * (asked - f), -fastest, fastest)) if asked else fall) - v)
            x += _STEP * v
            positions.append(x)
            forces.append(f)
    lag, told = random.uniform(0, 0.006), random.random() < 0.5
    every = np.arange(len(positions)) * _STEP
    time = np.arange(0.02, every[-1], 1 / rate)
    position = np.interp(time, every, positions) + random.normal(0, random.choice([5e-7, 3e-6]), len(time))
    force = np.interp(time - lag, every, forces) + random.normal(0, 0.002 * most, len(time))
    record = Record(
        {"time": time, "position": position, "force": force}, {"time": "s", "position": "m", "force": "N"}
    )
    return World(record, lag if told else None, lambda f: float(np.interp(f, law, slopes)), most)


def main() -> None:
    """Print how many slopes hold."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--worlds", type=int, default=60)
    parser.add_argument("--seed", type=int, default=100)
    asked = parser.parse_args()
    holds, widths, reaches = [], [], []
    for seed in range(asked.seed, asked.seed + asked.worlds):
        world = world_of(seed)
        found = identify(world.record, **({} if world.lag is None else {"lag": world.lag}))
        tangents = () if found.press is None else found.press.tangent
        for own in tangents:
            truth = world.slope(own.force)
            holds.append(abs(own.stiffness - truth) <= own.half)
            widths.append(own.half / truth)
        reaches.append(np.ptp([own.force for own in tangents]) / world.most if tangents else 0.0)
    print(f"{'logs':26}{asked.worlds:6}")
    print(f"{'slopes by force':26}{len(holds):6}")
    print(f"{'hold':26}{100 * np.mean(holds):6.1f} %")
    print(f"{'half-width, median':26}{100 * np.median(widths):6.1f} %")
    print(f"{'part of the force between':26}{100 * np.mean(reaches):6.1f} %")


if __name__ == "__main__":
    main()
