"""Many runs at a time: what a second core adds, and whether memory grows with the number of runs.

A run is what a study does with it: a bench of its own, its record reduced to a number and dropped.
"""

from __future__ import annotations

import resource
import sys
import time
from concurrent.futures import ThreadPoolExecutor

from palpate.bench import build, load
from palpate.bench.speed import cores
from palpate.bench.tables import with_values

SHORT = {"approach.hold": 0.2, "approach.first": 0.464, "run.duration": 6.0, "run.press": 5.0}
RUNS, ROUNDS = 12, 5


def one(seed: int) -> int:
    """A run, reduced to its number of ticks."""
    return len(build(with_values(load("foam-neural"), SHORT)).run(6.0, seed, press=5.0))


def ticks_per_second(pool: ThreadPoolExecutor) -> float:
    """The best of a few rounds."""
    found = []
    for _ in range(ROUNDS):
        begun = time.perf_counter()
        ticks = sum(pool.map(one, range(RUNS)))
        found.append(ticks / (time.perf_counter() - begun))
    return max(found)


def peak() -> float:
    """Of this process so far [MB]."""
    unit = 1e6 if sys.platform == "darwin" else 1e3
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / unit


def main() -> None:
    one(0)
    with ThreadPoolExecutor(1) as pool:
        alone = ticks_per_second(pool)
    with ThreadPoolExecutor(cores()) as pool:
        together, before = ticks_per_second(pool), peak()
        ticks_per_second(pool)
        after = peak()
    print(
        f"one thread: {alone:.3g} ticks a second; {cores()} threads: {together:.3g}, {together / alone:.2f} times"
    )
    print(
        f"memory at its peak: {before:.0f} MB after {RUNS * ROUNDS} runs, {after:.0f} MB after {2 * RUNS * ROUNDS}"
    )


if __name__ == "__main__":
    main()
