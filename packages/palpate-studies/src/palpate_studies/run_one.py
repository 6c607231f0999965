"""One run of a study, from an experiment to a row of numbers; many on the cores of this machine; the rows as one table.

A run goes to a thread, or to a worker of a cluster: compiled loops release the interpreter, so threads fill the cores.
The rows stand in the order of the runs, not of their completion, with the version of palpate and a hash of the sources
that a run consists of.
"""

from __future__ import annotations

import hashlib
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass
from functools import cache
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import msgspec

import palpate
from palpate.bench.from_experiment import AnyExperiment, build_any
from palpate.bench.speed import cores
from palpate.bench.summary import INTERRUPTED
from palpate.errors import InputError
from palpate.logs.tables.parquet import write_parquet
from palpate.plugins import Plugin
from palpate.records import Record
from palpate_studies.metrics import Window, metric_of
from palpate_studies.parameters import Label
from palpate_studies.plan import RunPlan, RunSetting

if TYPE_CHECKING:
    from polars import DataFrame

REFUSED, FAILED = "refused", "failed"
"""Results beside those that a run ends with: values that are no experiment; an error."""


class Stopped(Exception):
    """The run was given up halfway, because the study was stopped."""


class Row(msgspec.Struct, frozen=True, array_like=True):
    """Result of a run.

    Args:
        run: its number.
        at: the parameters' values.
        result: how it ended, in a stable word.
        why: the same in a sentence.
        metrics: in the study's order; None where the run has no such number.
        seconds: its duration.
    """

    run: int
    at: dict[str, Label]
    result: str
    why: str
    metrics: tuple[float | None, ...]
    seconds: float


@dataclass(frozen=True)
class RunJob:
    """A run to be done, with all that it takes.

    Args:
        setting: which.
        metrics: their names.
        window: from when to when after the first contact the force is judged [s].
        keep: whether the record is wanted too.
    """

    setting: RunSetting
    metrics: tuple[str, ...]
    window: tuple[float, float] | None
    keep: bool
    plugins: tuple[Plugin, ...] = ()
    """The user's own parts and metrics, which a worker has to have as well."""


Done = tuple[Row, Record | None]


def run_one(
    job: RunJob, stopped: Callable[[], bool] = lambda: False, waiting: Callable[[], None] | None = None
) -> Done:
    """Runs a job to a row, for any outcome; with the record if it is to be kept.

    Args:
        job: to be run.
        stopped: asked now and then whether to give up.
        waiting: called when the loop has to be compiled first.

    Raises:
        Stopped: `stopped` said so while it ran.
        KeyboardInterrupt: the run was interrupted.
    """
    begun = time.perf_counter()

    def row(result: str, why: str, metrics: tuple[float | None, ...]) -> Row:
        return Row(setting.run, setting.at, result, why, metrics, time.perf_counter() - begun)

    setting, none = job.setting, (None,) * len(job.metrics)
    if setting.experiment is None:
        return row(REFUSED, setting.refused, none), None
    try:
        record = _record(setting.experiment, setting.seed, stopped, waiting)
        window = Window(record, job.window)
        metrics = tuple(metric_of(name).value_in(window) for name in job.metrics)
    except Stopped:
        raise
    except InputError as error:
        return row(REFUSED, str(error), none), None
    except Exception as error:  # noqa: BLE001 - whatever a run raises is its result, and no other run's trouble
        return row(FAILED, " ".join(f"{type(error).__name__}: {error}".split()), none), None
    return row(record.meta["end"], record.meta["why"], metrics), record if job.keep else None


def _record(
    experiment: AnyExperiment, seed: int, stopped: Callable[[], bool], waiting: Callable[[], None] | None
) -> Record:
    def progress(_: float, __: str) -> None:
        if stopped():
            raise Stopped

    run = experiment.run
    return uninterrupted(
        build_any(experiment).run(run.duration, seed, press=run.press, progress=progress, waiting=waiting)
    )


def uninterrupted(record: Record) -> Record:
    """The record of a run that no Ctrl-C ended; the bench makes an ending of it, and a study stops there.

    Raises:
        KeyboardInterrupt: one did.
    """
    if record.meta["end"] == INTERRUPTED:
        raise KeyboardInterrupt
    return record


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

    def run(self, jobs: Iterable[RunJob]) -> Iterator[Done]:
        """Results of the jobs, in the order of completion.

        Who stops asking stops the runs that are under way.
        """
        stop = threading.Event()
        try:
            yield from map_unordered(lambda job: run_one(job, stop.is_set, self._waiting), jobs, self.threads)
        finally:
            stop.set()


def map_unordered(work: Callable[[A], B], items: Iterable[A], threads: int) -> Iterator[B]:
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


NAME = "results.parquet"
CHUNK = 20_000
"""Rows that are taken at a time from text to columns."""


def table(plan: RunPlan, rows: Iterable[Row]) -> DataFrame:
    """The rows as columns: run, parameters, seed, result, why, metrics; each run once, sorted by its number."""
    import polars

    schema = _schema(plan)
    frames = [polars.DataFrame(columns, schema=schema) for columns in _columns(plan, rows)]
    joined = polars.concat(frames) if frames else polars.DataFrame(schema=schema)
    return joined.unique("run", keep="first", maintain_order=True).sort("run").rechunk()


def write(frame: DataFrame, plan: RunPlan, path: Path) -> None:
    """Writes the table as Parquet, atomically; units and texts of the metrics in the file's own metadata.

    Raises:
        InputError: the disk is full.
    """
    metrics = {
        name: {"unit": metric_of(name).unit, "text": metric_of(name).text} for name in plan.study.metrics
    }
    about = msgspec.json.encode({"title": plan.study.title, "metrics": metrics}).decode()
    try:
        write_parquet(frame, about, path)
    except OSError as error:
        raise InputError(
            f"{path}: {error.strerror}; the runs are saved: free some space, and the same command writes the table"
        ) from error


def _columns(plan: RunPlan, rows: Iterable[Row]) -> Iterator[dict[str, list[Any]]]:
    left, texts = iter(rows), [name for name, kind in plan.columns.items() if kind is str]
    while chunk := list(islice(left, CHUNK)):
        columns: dict[str, list[Any]] = {"run": [r.run for r in chunk]}
        for name in plan.columns:
            values = [r.at.get(name) for r in chunk]
            columns[name] = [None if v is None else str(v) for v in values] if name in texts else values
        columns |= {"result": [r.result for r in chunk], "why": [r.why for r in chunk]}
        columns |= {name: [r.metrics[i] for r in chunk] for i, name in enumerate(plan.study.metrics)}
        yield columns


def _schema(plan: RunPlan) -> dict[str, Any]:
    import polars

    kinds = {int: polars.Int64, float: polars.Float64, bool: polars.Boolean, str: polars.String}
    told = {name: kinds[kind] for name, kind in plan.columns.items()}
    metrics = dict.fromkeys(plan.study.metrics, polars.Float64)
    return {"run": polars.Int64, **told, "result": polars.String, "why": polars.String, **metrics}


OF_A_RUN = (
    "_vector.py",
    "bench",
    "controllers",
    "environments",
    "force",
    "friction.py",
    "identifiers",
    "instruments.py",
    "networks",
    "plugins.py",
    "references.py",
    "robots",
    "signals",
)
"""Files and folders of palpate that a row depends on, beside this file; readers of studies and pages may change."""


@cache
def sources() -> str:
    """A hash of the sources of a run, wherever they are installed."""
    here, digest = Path(palpate.__file__).parent, hashlib.sha256(Path(__file__).read_bytes())
    for place in (here / name for name in OF_A_RUN):
        for file in sorted(place.rglob("*.py")) if place.is_dir() else [place]:
            digest.update(file.relative_to(here).as_posix().encode() + b"\0" + file.read_bytes())
    return digest.hexdigest()[:16]
