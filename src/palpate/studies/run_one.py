"""One run of a study, from an experiment to a row of numbers; many runs on all cores.

Compiled loops release the interpreter, so threads fill the cores.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass
from typing import TypeVar

from palpate.bench import Experiment, build
from palpate.bench.speed import cores
from palpate.bench.summary import INTERRUPTED
from palpate.errors import InputError
from palpate.plugins import Plugin
from palpate.records import Record
from palpate.studies.journal import Row
from palpate.studies.metrics import Window, metric_of
from palpate.studies.plan import RunSetting

REFUSED, FAILED = "refused", "failed"
"""Results beside those that a run ends with: values that are no experiment; an error."""
AHEAD = 2
"""Items in hand for each thread, so that no thread waits for the next one."""

A = TypeVar("A")
B = TypeVar("B")


class Stopped(Exception):
    """The run was given up halfway, because the study was stopped."""


@dataclass(frozen=True)
class RunJob:
    """A run to be done, with all that it takes.

    Args:
        setting: the run.
        metrics: their names.
        window: begin and end of the evaluation of the force, after the first contact [s].
        plugins: the user's own parts and metrics, which a worker needs as well.
    """

    setting: RunSetting
    metrics: tuple[str, ...]
    window: tuple[float, float] | None
    plugins: tuple[Plugin, ...] = ()

    def row(self, result: str, why: str, metrics: tuple[float | None, ...] = (), seconds: float = 0.0) -> Row:
        """The result of the run; without metrics all of them are None."""
        numbers = metrics or (None,) * len(self.metrics)
        return Row(self.setting.run, self.setting.at, result, why, numbers, seconds)


def run_one(
    job: RunJob, stopped: Callable[[], bool] = lambda: False, waiting: Callable[[], None] | None = None
) -> Row:
    """Run a job; every outcome, an error too, is a row.

    Args:
        job: to be run.
        stopped: asked now and then whether to give up.
        waiting: called when the loop has to be compiled first.

    Raises:
        Stopped: `stopped` said so while it ran.
        KeyboardInterrupt: the run was interrupted.
    """
    begin, setting = time.perf_counter(), job.setting
    if setting.experiment is None:
        return job.row(REFUSED, setting.refused)
    try:
        record = _record(setting.experiment, setting.seed, stopped, waiting)
        window = Window(record, job.window)
        metrics = tuple(metric_of(name).value_in(window) for name in job.metrics)
    except Stopped:
        raise
    except InputError as error:
        return job.row(REFUSED, str(error))
    except Exception as error:  # noqa: BLE001 - an error is the result of this run, and the others go on
        return job.row(FAILED, " ".join(f"{type(error).__name__}: {error}".split()))
    return job.row(record.meta["end"], record.meta["why"], metrics, time.perf_counter() - begin)


def _record(
    experiment: Experiment, seed: int, stopped: Callable[[], bool], waiting: Callable[[], None] | None
) -> Record:
    def progress(_: float, __: str) -> None:
        if stopped():
            raise Stopped

    run = experiment.run
    bench = build(experiment)
    record = bench.run(run.duration, seed, press=run.press, progress=progress, waiting=waiting)
    if record.meta["end"] == INTERRUPTED:  # the bench ends a run at Ctrl-C; a study stops there
        raise KeyboardInterrupt
    return record


class Local:
    """Runs jobs on all cores; never more of them in memory than a few a core.

    Args:
        threads: as many as there are cores when left out.
        waiting: called when a loop has to be compiled first.
    """

    def __init__(self, threads: int | None = None, waiting: Callable[[], None] | None = None):
        self.threads, self._waiting = threads or cores(), waiting

    def run(self, jobs: Iterable[RunJob]) -> Iterator[Row]:
        """Results of the jobs, in the order of completion; closing the iterator stops the runs under way."""
        stop = threading.Event()
        try:
            yield from map_unordered(lambda job: run_one(job, stop.is_set, self._waiting), jobs, self.threads)
        finally:
            stop.set()


def map_unordered(work: Callable[[A], B], items: Iterable[A], threads: int) -> Iterator[B]:
    """Results of `work` for each item, in the order of completion; items are taken as they are needed."""
    pool = ThreadPoolExecutor(threads)
    pending: set[Future[B]] = set()
    try:
        for item in items:
            pending.add(pool.submit(work, item))
            if len(pending) >= AHEAD * threads:
                done, pending = wait(pending, return_when=FIRST_COMPLETED)
                yield from (future.result() for future in done)
        while pending:
            done, pending = wait(pending, return_when=FIRST_COMPLETED)
            yield from (future.result() for future in done)
    finally:
        pool.shutdown(wait=False, cancel_futures=True)
