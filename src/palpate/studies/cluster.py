"""The runs of a study on a Dask cluster: short runs share a task, and Dask repeats the tasks of a worker that dies."""

from __future__ import annotations

import logging
import pickle
import socket
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial
from itertools import count, islice
from typing import Any, NamedTuple, TypeVar

from palpate.errors import InputError, how_to_install
from palpate.plugins import Plugin
from palpate.studies.journal import Row, differences, sources
from palpate.studies.run_one import FAILED, RunJob, run_one

A = TypeVar("A")
B = TypeVar("B")

MAX_SENT = 200
"""Tasks at the cluster at most: enough for a hundred workers, little memory."""
TASK, MAX_RUNS = 0.5, 100
"""Time that a task takes, unless one run takes longer [s], and its runs at most. A task costs the scheduler and the
client 4 ms each (`benchmarks/cluster.py`): as tasks of one run, runs of 5 ms would be no faster on many machines."""
PATIENCE = 30.0
"""Time within which a cluster must have a worker [s]."""
QUIET, QUIET_FACTOR = 5.0, 3.0
"""Time without a result [s], and its multiple of the longest one before, after which a task that a worker has is sent
again: the worker may be frozen. A task gives the same result wherever it runs, and the first one counts."""
POLL = 0.01
"""Time between two looks for a result [s]."""
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
            _check_listens(address)
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
        return self.map(
            partial(run_on_worker, stamp=sources()),
            map(pack, jobs),
            lambda packed, error: packed.job().row(FAILED, f"workers died of it: {error}"),
        )

    def map(
        self, work: Callable[[A], B], items: Iterable[A], killed: Callable[[A, str], B] | None = None
    ) -> Iterator[B]:
        """Results of `work`, a function that the workers can import, in the order of completion.

        Args:
            work: of an item.
            items: taken as they are needed.
            killed: the result of an item of which several workers died, with the last error; an error if left out.

        Raises:
            InputError: the scheduler went away, or the workers cannot do it.
        """
        waiting, tasks = iter(items), _Tasks(partial(self._client.submit, _run_all, work, pure=False))
        try:
            first = tasks.send([item] for item in islice(waiting, MAX_SENT))
            completed = self._dask.as_completed(first, loop=self._client.loop)
            longest = 0.0
            while tasks.unfinished:
                begin = time.monotonic()
                limit = max(QUIET, QUIET_FACTOR * longest)
                _wait(completed, limit, lambda: completed.update(tasks.send_again()))
                longest = max(longest, time.monotonic() - begin)
                future = next(completed)
                batch = tasks.take(future)
                try:
                    results, seconds = future.result() if batch else ([], TASK)
                except self._dask.KilledWorker as error:
                    if killed is None:
                        raise
                    if len(batch) > 1:  # one of them did it
                        completed.update(tasks.send([item] for item in batch))
                        continue
                    results, seconds = [killed(batch[0], _first_line(error))], TASK
                yield from results
                size = int(min(MAX_RUNS, 1 + TASK * len(batch) / seconds))
                completed.update(tasks.send([list(islice(waiting, size))] if batch else []))
        except InputError:
            raise
        except Exception as error:
            raise InputError(
                f"the cluster at {self.address} failed ({_first_line(error)}); the finished runs are saved, and the "
                "same command resumes"
            ) from error
        finally:
            if tasks.futures and self._client.status == "running":
                self._client.cancel(list(tasks.futures), force=True)


class _Tasks:
    """The tasks at the cluster; one that was sent twice is done with its first result.

    Args:
        submit: sends a batch of items, and returns its future.
    """

    def __init__(self, submit: Callable[[list[Any]], Any]):
        self.unfinished: dict[int, list[Any]] = {}
        self.futures: dict[Any, int] = {}
        self._submit, self._numbers = submit, count()

    def send(self, batches: Iterable[list[Any]]) -> list[Any]:
        """Futures of these batches; an empty one is none."""
        return self._send((next(self._numbers), batch) for batch in batches if batch)

    def send_again(self) -> list[Any]:
        """Further futures of all that is not finished."""
        return self._send(list(self.unfinished.items()))

    def take(self, future: Any) -> list[Any]:
        """Batch of a future that is done; empty if another was done first."""
        return self.unfinished.pop(self.futures.pop(future), [])

    def _send(self, tasks: Iterable[tuple[int, list[Any]]]) -> list[Any]:
        futures = []
        for number, batch in tasks:
            future = self._submit(batch)
            self.unfinished[number], self.futures[future] = batch, number
            futures.append(future)
        return futures


def _run_all(work: Callable[[A], B], items: Sequence[A]) -> tuple[list[B], float]:
    """Results of `work` for each item, and the time that all took [s]; a task of a worker."""
    begin = time.perf_counter()
    return [work(item) for item in items], time.perf_counter() - begin


def _wait(completed: Any, limit: float, send_again: Callable[[], None]) -> None:
    """Wait for a result; after each time without one [s], ever longer ones, the tasks are sent again."""
    begin = time.monotonic()
    while not completed.has_ready():
        if time.monotonic() - begin > limit:
            send_again()
            limit *= QUIET_FACTOR
        time.sleep(POLL)


def _check_listens(address: str) -> None:
    """Fail where nothing listens, before there is a client: one that never connected can block when it is collected."""
    from distributed.comm.addressing import get_address_host_port

    socket.create_connection(get_address_host_port(address), CONNECT).close()


def _first_line(error: BaseException) -> str:
    return (str(error).splitlines() or [""])[0] or type(error).__name__
