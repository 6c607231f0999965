"""What one tick of the closed loop costs on this machine."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from time import perf_counter

from palpate.bench.bench import Bench

REPEATS = 5


def measure(
    bench: Bench, duration: float = 15.0, waiting: Callable[[], None] | None = None
) -> dict[str, float]:
    """Times whole runs, recording included.

    Args:
        bench: the loop to time.
        duration: of one run [s of simulated time].
        waiting: called when the loop has to be compiled first.

    Returns:
        ``ns_per_tick`` of one run on one core, the best of five; ``times_real_time``, how much faster than the
        arm that run is; ``ticks_per_s`` of runs on all cores together; and ``cores``, how many that are.
    """
    bench.run(bench.loop.tick, waiting=waiting)
    ticks, alone = min((_timed(bench, duration) for _ in range(REPEATS)), key=lambda run: run[1] / run[0])
    cores = _cores()
    start = perf_counter()
    with ThreadPoolExecutor(cores) as pool:
        done = sum(count for count, _ in pool.map(lambda _: _timed(bench, duration), range(2 * cores)))
    together = perf_counter() - start
    return {
        "ns_per_tick": 1e9 * alone / ticks,
        "ticks_per_s": done / together,
        "cores": cores,
        "times_real_time": ticks * bench.loop.tick / alone,
    }


def _timed(bench: Bench, duration: float) -> tuple[int, float]:
    """Ticks of one run, and the seconds that it took."""
    start = perf_counter()
    record = bench.run(duration)
    return len(record), perf_counter() - start


def _cores() -> int:
    """Cores that this process may use, which can be fewer than the machine has."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
