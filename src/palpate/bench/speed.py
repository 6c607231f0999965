"""Speed of the loop on this machine."""

import os
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from palpate.bench.force_input import COLUMNS
from palpate.bench.from_experiment import build
from palpate.bench.plant import compiled_march, start_at
from palpate.bench.tables import load, with_values

EXPERIMENT = "foam-neural"
PRESSING = {
    "robot.start": (0.464, 0.0, 0.0),
    "approach.hold": 0.1,
    "approach.first": 0.47,
}
"""An approach so short that nearly all ticks press and learn, which costs most."""
STEPS = 20
"""Steps of the physics in a tick."""
TICKS, CHUNKS, REPEATS = 500, 40, 5


def cores() -> int:
    """Number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def measure(waiting: Callable[[], None] | None = None) -> dict[str, float | int]:
    """Cost of a tick on one core, and with a run on each core at the same time; the best of a few of both.

    `waiting` is called if the loop has to be compiled first.
    """
    bench = build(with_values(load(EXPERIMENT), PRESSING))
    noise = np.random.default_rng(0).standard_normal((CHUNKS, TICKS))
    ticks = TICKS * CHUNKS

    def march(_: int) -> None:
        out = np.empty((TICKS, len(COLUMNS)))
        state = start_at(bench.loop, bench.q)
        for i, numbers in enumerate(noise):
            state = compiled_march.run(waiting, bench.loop, state, i * TICKS, numbers, out)

    def seconds(work: Callable[[], object]) -> float:
        start = time.perf_counter()
        work()
        return time.perf_counter() - start

    march(0)
    alone = min(seconds(lambda: march(0)) for _ in range(REPEATS)) / ticks
    with ThreadPoolExecutor(cores()) as pool:
        together = min(seconds(lambda: list(pool.map(march, range(cores())))) for _ in range(REPEATS))
    return {
        "ns_per_tick": 1e9 * alone,
        "ticks_per_s": cores() * ticks / together,
        "cores": cores(),
        "times_real_time": bench.loop.tick / alone,
    }
