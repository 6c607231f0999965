"""Many runs on a Dask cluster: batches of runs go to its workers, rows come back in any order."""

import logging
import math
import pickle
import socket
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from itertools import chain, islice
from pathlib import Path
from typing import Any, TypeVar
from urllib.parse import urlsplit

from palpate.errors import InputError
from palpate.plugins import Plugin
from palpate_studies.run_one import FAILED, Done, Row, RunJob, run_one, sources

A = TypeVar("A")
B = TypeVar("B")

UNIT = 0.2
"""Shortest duration of a batch [s]: the scheduler's own work is then some hundredths of it."""
TICK = 2e-6
"""Assumed time of a tick until it is measured [s]."""
LARGEST, LARGEST_KEPT = 1000, 8
"""Runs in a batch; and where their records come back too."""
AHEAD = 2
"""Batches in hand for each of the workers' threads."""
PATIENCE = 30.0
"""How long the cluster may be without any worker [s]."""
CONNECT = 10.0
"""How long a scheduler may take to answer [s]."""
POLL = 1.0
_GREETING, _LARGEST_GREETING = b"pickle-protocol", 4096
"""A word of the first message of a scheduler, and that message's largest size [bytes]; it has some 100."""


def run_batch(packed: bytes, stamp: str, plugins: Sequence[Plugin] = ()) -> list[Done]:
    """Runs some jobs, on a worker.

    Args:
        packed: the jobs, as a pickle.
        stamp: of palpate's sources.
        plugins: that the jobs need; they are imported first, so that a missing one is reported as such.

    Raises:
        InputError: this worker has other sources than the study, or lacks a plug-in.
    """
    if sources() != stamp:
        raise InputError(
            f"a worker of the cluster has another version of palpate (sources {sources()}, here {stamp}); install the "
            "same on all machines"
        )
    for one in plugins:
        try:
            one.value()
        except InputError as error:
            raise InputError(f"a worker of the cluster cannot use a plug-in: {error}") from error
    return [run_one(job) for job in pickle.loads(packed)]  # noqa: S301 - of the client, which it works for


@dataclass(frozen=True)
class Certificates:
    """Files by which a cluster and its client know each other, for tls://.

    Args:
        authority: that signed the certificates of both.
        certificate, key: the client's own.
    """

    authority: Path
    certificate: Path
    key: Path

    def __post_init__(self) -> None:
        for path in (self.authority, self.certificate, self.key):
            if not path.is_file():
                raise InputError(f"there is no file {path}; name the certificates of the cluster")


class Cluster:
    """Runs jobs on the workers of a Dask scheduler.

    The workers' answers are unpickled here, which can execute code: a cluster is trusted like this machine.

    Args:
        address: of the scheduler, such as tcp://192.168.0.10:8786, or tls://.
        patience: how long it may be without any worker [s].
        certificates: for tls://.

    Raises:
        InputError: the extra is not installed, the address is invalid, or there is no scheduler at it.
    """

    def __init__(self, address: str, patience: float = PATIENCE, certificates: Certificates | None = None):
        host, port = _parse(address, certificates)
        try:
            import distributed
        except ImportError as error:
            raise InputError("a cluster needs the extra: pip install 'palpate[cluster]'") from error
        logging.getLogger("distributed").setLevel(
            logging.CRITICAL + 1
        )  # what is lost is told once, in our words
        self.address, self._patience = address, patience
        self._client: Any
        security = _security(certificates)
        try:
            _check_greeting(host, port, security)
            self._client = _without_types(distributed).Client(
                address, timeout=CONNECT, set_as_default=False, security=security
            )
        except Exception as error:
            raise InputError(
                f"no Dask scheduler answers at {address} ({_line(error)}); check the address"
            ) from error

    def close(self) -> None:
        """Takes leave of the scheduler."""
        self._client.close(timeout=2)

    def map(self, work: Callable[[A], B], items: Iterable[A]) -> Iterator[B]:
        """`work` of each item, in the order in which it is done; a function that the workers can import.

        Raises:
            InputError: the scheduler went away, or the workers cannot do it.
        """
        import distributed

        futures = self._client.map(work, list(items), pure=False)
        try:
            for _, found in _without_types(distributed).as_completed(
                futures, loop=self._client.loop, with_results=True
            ):
                yield found
        except (InputError, KeyboardInterrupt, GeneratorExit):
            raise
        except Exception as error:
            raise InputError(
                f"the workers of {self.address} did not finish: {_line(error)}; the finished runs are saved, and the "
                "same command resumes"
            ) from error
        finally:
            if self._client.status == "running":
                self._client.cancel(futures, force=True)

    def run(self, jobs: Iterable[RunJob]) -> Iterator[Done]:
        """Results of the jobs, in the order of completion.

        Raises:
            InputError: the scheduler went away, no worker is left, or the workers cannot run palpate.
        """
        hand = Dispatcher(self._client, self.address, self._patience)
        try:
            yield from hand.all(Batches(jobs))
        finally:
            hand.drop()


def _parse(address: str, certificates: Certificates | None) -> tuple[str, int]:
    """Host and port of an address."""
    wrong = InputError(f"{address!r} is no address of a scheduler; give tcp://HOST:PORT or tls://HOST:PORT")
    try:
        parts = urlsplit(address if "://" in address else f"tcp://{address}")
        host, port = parts.hostname, parts.port
    except ValueError:
        raise wrong from None
    if parts.scheme not in {"tcp", "tls"} or not host or not port or parts.path or parts.query:
        raise wrong
    if (parts.scheme == "tls") != (certificates is not None):
        raise InputError(
            "tls:// needs --tls-ca, --tls-cert and --tls-key"
            if certificates is None
            else f"certificates are for tls://HOST:PORT, not for {address}"
        )
    return host, port


def _check_greeting(host: str, port: int, security: Any) -> None:
    """A scheduler speaks first, and says which pickles it takes; Dask would wait for that for ever, and at any length.

    Raises:
        OSError: nothing there, or not in time.
        ValueError: something else is there.
    """
    latest = time.monotonic() + CONNECT
    with ExitStack() as held:
        stream = held.enter_context(socket.create_connection((host, port), CONNECT))
        if security is not None:
            context = security.get_connection_args("client")["ssl_context"]
            stream = held.enter_context(context.wrap_socket(stream, server_hostname=host))
        said = b""
        while _GREETING not in said:
            stream.settimeout(max(1e-3, latest - time.monotonic()))
            piece = stream.recv(4096)
            said += piece
            size = int.from_bytes(said[:8], "little") if len(said) >= 8 else 0  # it begins with its size
            if not piece or max(size, len(said)) > _LARGEST_GREETING:
                raise ValueError("another program is there")


def _security(certificates: Certificates | None) -> Any:
    if certificates is None:
        return None
    import distributed

    return _without_types(distributed).Security(
        tls_ca_file=str(certificates.authority),
        tls_client_cert=str(certificates.certificate),
        tls_client_key=str(certificates.key),
        require_encryption=True,
    )


class Batches:
    """Jobs in batches that take long enough, by what the runs so far took."""

    def __init__(self, jobs: Iterable[RunJob]):
        self._jobs = iter(jobs)
        self._again: list[list[RunJob]] = []
        self.seconds: float | None = None

    def __next__(self) -> list[RunJob]:
        if self._again:
            return self._again.pop()
        first = next(self._jobs)
        seconds = self.seconds if self.seconds is not None else _guess(first)
        count = min(math.ceil(UNIT / max(seconds, 1e-9)), LARGEST_KEPT if first.keep else LARGEST)
        return list(chain([first], islice(self._jobs, count - 1)))

    def took(self, done: Sequence[Done]) -> None:
        """Updates the mean time of a run from a finished batch."""
        mean = sum(row.seconds for row, _ in done) / len(done)
        self.seconds = mean if self.seconds is None else 0.8 * self.seconds + 0.2 * mean

    def again(self, jobs: list[RunJob]) -> None:
        """Runs that a worker died of are tried one by one."""
        self._again += [[job] for job in jobs]


def _guess(job: RunJob) -> float:
    if job.setting.experiment is None:
        return 1e-5
    run = job.setting.experiment.run
    rate = getattr(
        run, "rate", 1000
    )  # of one direction the arm has it, and a run is a matter of milliseconds
    return TICK * rate * min(run.press, run.duration)


@dataclass
class Dispatcher:
    """The batches that are with the cluster."""

    client: Any
    address: str
    patience: float

    def __post_init__(self) -> None:
        self._pending: dict[Any, list[RunJob]] = {}
        self._room, self._looked, self._alone = 0, -math.inf, time.monotonic()

    def all(self, batches: Batches) -> Iterator[Done]:
        """Sends the batches, and receives their results."""
        more = True
        while more or self._pending:
            self._look()
            more = more and self._send(batches)
            for future in self._completed_batches():
                jobs = self._pending.pop(future)
                done = self.take(future, jobs)
                if done is None:
                    batches.again(jobs)
                    more = True
                    continue
                batches.took(done)
                yield from done

    def drop(self) -> None:
        """Cancels the remaining batches."""
        if self._pending and self.client.status == "running":
            self.client.cancel(list(self._pending), force=True)
        self._pending.clear()

    def _send(self, batches: Batches) -> bool:
        """Fills the cluster's hands; whether there may be more."""
        while len(self._pending) < self._room:
            try:
                jobs = next(batches)
            except StopIteration:
                return False
            try:
                self._pending[self._submit(jobs)] = jobs
            except Exception as error:
                raise self._lost_error(error) from error
        return True

    def _submit(self, jobs: list[RunJob]) -> Any:
        return self.client.submit(run_batch, pickle.dumps(jobs), sources(), jobs[0].plugins, pure=False)

    def _completed_batches(self) -> list[Any]:
        """The batches that are done, after a while of waiting."""
        import distributed

        if not self._pending:
            time.sleep(0.0 if self._room else POLL)
            return []
        try:
            with self.client.as_current():
                found = _without_types(distributed).wait(
                    list(self._pending), timeout=POLL, return_when="FIRST_COMPLETED"
                )
            return list(found.done)
        except TimeoutError:
            return []
        except Exception as error:
            raise self._lost_error(error) from error

    def _look(self) -> None:
        """Now and then, how many workers there are: some come, some go; none for too long is an error."""
        if time.monotonic() - self._looked < POLL:
            return
        self._looked = time.monotonic()
        if self.client.status != "running":
            raise self._lost_error(None)
        try:
            asked = self.client.sync(self.client.scheduler.ncores, callback_timeout=CONNECT)
            threads = sum(asked.values())
        except Exception as error:
            raise self._lost_error(error) from error
        self._room = AHEAD * threads
        if threads:
            self._alone = time.monotonic()
        elif time.monotonic() - self._alone > self.patience:
            raise InputError(
                f"the cluster at {self.address} has had no worker for {self.patience:g} s; start some: the finished "
                "runs are saved, and the same command resumes"
            )

    def take(self, future: Any, jobs: list[RunJob]) -> list[Done] | None:
        """Result of a batch; None if a worker died of one of several runs."""
        from distributed import KilledWorker

        try:
            return list(future.result())
        except InputError:
            raise
        except KilledWorker as error:
            if len(jobs) > 1:
                return None
            setting = jobs[0].setting
            none = (None,) * len(jobs[0].metrics)
            why = f"workers died of it, the last at {getattr(error.last_worker, 'address', 'an unknown address')}"
            return [(Row(setting.run, setting.at, FAILED, why, none, 0.0), None)]
        except Exception as error:
            if self.client.status != "running":
                raise self._lost_error(error) from error
            raise InputError(
                f"the workers of {self.address} cannot run palpate: {_line(error)}; install the same version on all "
                "machines"
            ) from error

    def _lost_error(self, error: Exception | None) -> InputError:
        what = f" ({_line(error)})" if isinstance(error, OSError) else ""
        return InputError(
            f"the cluster at {self.address} disappeared{what}; the finished runs are saved, and the same "
            "command resumes"
        )


def _without_types(module: Any) -> Any:
    """The library's functions carry no types."""
    return module


def _line(error: BaseException) -> str:
    return (str(error).splitlines() or [type(error).__name__])[0] or type(error).__name__
