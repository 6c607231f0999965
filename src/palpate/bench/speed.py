"""How fast the loop runs here."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from palpate.bench.build import build
from palpate.bench.experiment import load
from palpate.bench.row import COLUMNS
from palpate.bench.tick import compiled_march, start_at

EXPERIMENT = "foam-hybrid"
STEPS = 20
"""Of the physics, in each of its ticks."""
TICKS, CHUNKS, REPEATS = 500, 40, 5


def cores() -> int:
    """How many this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def measure(waiting: Callable[[], None] | None = None) -> dict[str, float | int]:
    """Cost of a tick: on one core (the best of a few), and with a run on each core at the same time.

    `waiting` is called if the loop has to be compiled first.
    """
    bench = build(load(EXPERIMENT))
    noise = np.random.default_rng(0).standard_normal((CHUNKS, TICKS))

    def march(_: int) -> float:
        out = np.empty((TICKS, len(COLUMNS)))
        state = start_at(bench.loop, bench.q)
        begun = time.perf_counter()
        for i, numbers in enumerate(noise):
            state = compiled_march.run(waiting, bench.loop, state, i * TICKS, numbers, out)
        return time.perf_counter() - begun

    march(0)
    ticks = TICKS * CHUNKS
    alone = min(march(i) for i in range(REPEATS)) / ticks
    with ThreadPoolExecutor(cores()) as pool:
        begun = time.perf_counter()
        list(pool.map(march, range(REPEATS * cores())))
        together = (time.perf_counter() - begun) / (REPEATS * cores() * ticks)
    return {
        "ns_per_tick": 1e9 * alone,
        "ticks_per_s": 1.0 / together,
        "cores": cores(),
        "times_real_time": bench.loop.tick / alone,
    }
