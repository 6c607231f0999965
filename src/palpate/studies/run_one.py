"""One run of a study, from an experiment to a row of numbers; many runs here, or on a Dask cluster.

Compiled loops release the interpreter, so threads fill the cores. On a cluster each run is a task, and Dask repeats the
tasks of a worker that dies.
"""

from __future__ import annotations

import logging
import pickle
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass
from itertools import islice
from typing import Any, NamedTuple, TypeVar

from palpate.bench import Experiment, build
from palpate.bench.speed import cores
from palpate.bench.summary import INTERRUPTED
from palpate.errors import InputError, how_to_install
from palpate.plugins import Plugin
from palpate.records import Record
from palpate.studies.journal import Row, differences, sources
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


MAX_SENT = 1000
"""Tasks at the cluster at most: enough for hundreds of workers, little memory."""
PATIENCE = 30.0
"""Time within which a cluster must have a worker [s]."""
CONNECT = 10.0
"""Time within which a scheduler must answer [s]."""


class PackedJob(NamedTuple):
    """A job on its way to a worker.

    Args:
        pickled: the job.
        plugins: of the job; they are imported before it is unpacked, so that a missing one is reported as such.
    """

    pickled: bytes
    plugins: Sequence[Plugin]

    def job(self) -> RunJob:
        """Job as it was before it was packed."""
        job: RunJob = pickle.loads(self.pickled)  # noqa: S301 - from the client, which the worker trusts
        return job


def pack(job: RunJob) -> PackedJob:
    """Job in a form that can be sent to another process."""
    return PackedJob(pickle.dumps(job), job.plugins)


def run_on_worker(packed: PackedJob, stamp: Mapping[str, str]) -> Row:
    """Run a job on a worker.

    Args:
        packed: the job.
        stamp: `sources()` of the study.

    Raises:
        InputError: this worker has other sources than the study, or lacks a plug-in.
    """
    if changed := differences(sources(), stamp):
        raise InputError(
            f"a worker of the cluster has other sources than the study: {changed}; install the same on all machines"
        )
    for plugin in packed.plugins:
        try:
            plugin.value()
        except InputError as error:
            raise InputError(f"a worker of the cluster cannot use a plug-in: {error}") from error
    return run_one(packed.job())


class Cluster:
    """The workers of a Dask scheduler.

    Their answers are unpickled here, which can execute code: a cluster is trusted like this machine. The
    certificates of tls:// are those of Dask's own configuration (`distributed.comm.tls`).

    Args:
        address: of the scheduler, such as tcp://192.168.0.10:8786, or tls://.
        patience: time within which it must have a worker [s].

    Raises:
        InputError: the extra is not installed, no scheduler answers at the address, or it has no worker.
    """

    def __init__(self, address: str, patience: float = PATIENCE):
        try:
            import distributed
        except ImportError as error:
            raise InputError(f"a cluster needs the extra: {how_to_install('palpate[cluster]')}") from error
        # A lost cluster is reported once, by an error of palpate's.
        logging.getLogger("distributed").setLevel(logging.CRITICAL + 1)
        self.address = address
        self._dask: Any = distributed  # which has no types
        try:
            self._client = self._dask.Client(address, timeout=CONNECT, set_as_default=False)
        except Exception as error:
            raise InputError(
                f"no Dask scheduler answers at {address} ({_first_line(error)}); check the address"
            ) from error
        try:
            self._client.wait_for_workers(1, timeout=patience)
        except Exception as error:
            self.close()
            raise InputError(f"the cluster at {address} has no worker; start some") from error

    def close(self) -> None:
        """Disconnect from the scheduler."""
        self._client.close(timeout=2)

    def run(self, jobs: Iterable[RunJob]) -> Iterator[Row]:
        """Results of the jobs, in the order of completion; a run of which several workers died is a failed row.

        Raises:
            InputError: the scheduler went away, or the workers cannot run palpate.
        """
        waiting, stamp, sent = iter(jobs), sources(), {}

        def send(count: int) -> list[Any]:
            futures = []
            for job in islice(waiting, count):
                futures.append(self._client.submit(run_on_worker, pack(job), stamp, pure=False))
                sent[futures[-1]] = job
            return futures

        try:
            completed = self._dask.as_completed(send(MAX_SENT), loop=self._client.loop)
            for future in completed:
                job = sent.pop(future)
                try:
                    row: Row = future.result()
                except self._dask.KilledWorker as error:
                    row = job.row(FAILED, f"workers died of it: {_first_line(error)}")
                yield row
                completed.update(send(1))
        except InputError:
            raise
        except Exception as error:
            raise InputError(
                f"the cluster at {self.address} failed ({_first_line(error)}); the finished runs are saved, and the "
                "same command resumes"
            ) from error
        finally:
            if sent and self._client.status == "running":
                self._client.cancel(list(sent), force=True)


def _first_line(error: BaseException) -> str:
    return (str(error).splitlines() or [""])[0] or type(error).__name__
