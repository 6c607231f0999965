"""How fast the loop runs here."""

from __future__ import annotations

import os
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from palpate.bench.build import build
from palpate.bench.experiment import load
from palpate.bench.row import COLUMNS
from palpate.bench.tick import compiled_march, start_at

TICKS = 20_000
REPEATS = 5


def measure() -> dict[str, float | int]:
    """Cost of a tick of foam-hybrid: on one core (the best of a few), and with a run a core side by side."""
    bench = build(load("foam-hybrid"))
    noise = np.random.default_rng(0).standard_normal(TICKS)
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1

    def march(_: int) -> float:
        out = np.empty((TICKS, len(COLUMNS)))
        begun = time.perf_counter()
        compiled_march(bench.loop, start_at(bench.loop, bench.q), 0, noise, out)
        return time.perf_counter() - begun

    march(0)
    alone = min(march(i) for i in range(REPEATS)) / TICKS
    with ThreadPoolExecutor(cores) as pool:
        begun = time.perf_counter()
        list(pool.map(march, range(REPEATS * cores)))
        together = (time.perf_counter() - begun) / (REPEATS * cores * TICKS)
    return {
        "ns_per_tick": 1e9 * alone,
        "ticks_per_s": 1.0 / together,
        "cores": cores,
        "times_real_time": bench.loop.tick / alone,
        "steps_per_tick": bench.loop.steps,
    }
