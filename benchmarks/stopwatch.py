"""The best of several times: the cost itself, without what else the machine was doing."""

import time
from collections.abc import Callable
from typing import Any


def best(work: Callable[[], Any], repeats: int = 7) -> float:
    """Seconds of the fastest of several calls; one before them warms up."""
    work()
    times = []
    for _ in range(repeats):
        begun = time.perf_counter()
        work()
        times.append(time.perf_counter() - begun)
    return min(times)
