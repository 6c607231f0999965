"""The runs of a study on a Dask cluster: each run is a task, and Dask repeats the tasks of a worker that dies."""

from __future__ import annotations

import logging
import pickle
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import islice
from typing import Any, NamedTuple

from palpate.errors import InputError, how_to_install
from palpate.plugins import Plugin
from palpate.studies.journal import Row, differences, sources
from palpate.studies.run_one import FAILED, RunJob, run_one

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
