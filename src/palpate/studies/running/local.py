"""Many runs on the cores of this machine: compiled loops release the interpreter, so threads fill the cores."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from typing import TypeVar

from palpate.bench.speed import cores
from palpate.studies.running.run_one import Done, Job, run_one

A = TypeVar("A")
B = TypeVar("B")

AHEAD = 2
"""Items in hand for each thread, so that none of them waits for the next."""


class Local:
    """Runs jobs on all cores; never more of them in memory than a few a core.

    Args:
        threads: as many as there are cores when left out.
        waiting: called when a loop has to be compiled first.
    """

    def __init__(self, threads: int | None = None, waiting: Callable[[], None] | None = None):
        self.threads, self._waiting = threads or cores(), waiting

    def run(self, jobs: Iterable[Job]) -> Iterator[Done]:
        """Results of the jobs, in the order of completion.

        Who stops asking stops the runs that are under way.
        """
        stop = threading.Event()
        try:
            yield from unordered(lambda job: run_one(job, stop.is_set, self._waiting), jobs, self.threads)
        finally:
            stop.set()


def unordered(work: Callable[[A], B], items: Iterable[A], threads: int) -> Iterator[B]:
    """`work` of each item, on so many threads, in the order in which it is done; items are taken as they are needed."""
    pool = ThreadPoolExecutor(threads)
    pending: set[Future[B]] = set()
    try:
        for item in items:
            pending.add(pool.submit(work, item))
            if len(pending) >= AHEAD * threads:
                done, pending = wait(pending, return_when=FIRST_COMPLETED)
                yield from (one.result() for one in done)
        while pending:
            done, pending = wait(pending, return_when=FIRST_COMPLETED)
            yield from (one.result() for one in done)
    finally:
        pool.shutdown(wait=False, cancel_futures=True)
