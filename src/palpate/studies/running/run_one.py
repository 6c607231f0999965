"""One run of a study: from an experiment to a row of numbers. It goes to a thread, or to a worker of a cluster."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import msgspec

from palpate.bench.any_experiment import AnyExperiment, build_any
from palpate.bench.metrics import Look, metric_of
from palpate.errors import InputError
from palpate.plugins import Plugin
from palpate.records import Record
from palpate.studies.definition.parameters import Label
from palpate.studies.definition.plan import Setting

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
class Job:
    """A run to be done, with all that it takes.

    Args:
        setting: which.
        metrics: their names.
        window: from when to when after the first contact the force is judged [s].
        keep: whether the record is wanted too.
    """

    setting: Setting
    metrics: tuple[str, ...]
    window: tuple[float, float] | None
    keep: bool
    plugins: tuple[Plugin, ...] = ()
    """The user's own parts and metrics, which a worker has to have as well."""


Done = tuple[Row, Record | None]


def run_one(
    job: Job, stopped: Callable[[], bool] = lambda: False, waiting: Callable[[], None] | None = None
) -> Done:
    """Runs a job to a row, for any outcome; with the record if it is to be kept.

    Args:
        job: to be run.
        stopped: asked now and then whether to give up.
        waiting: called when the loop has to be compiled first.

    Raises:
        Stopped: `stopped` said so while it ran.
    """
    begun = time.perf_counter()

    def row(result: str, why: str, metrics: tuple[float | None, ...]) -> Row:
        return Row(setting.run, setting.at, result, why, metrics, time.perf_counter() - begun)

    setting, none = job.setting, (None,) * len(job.metrics)
    if setting.experiment is None:
        return row(REFUSED, setting.refused, none), None
    try:
        record = _record(setting.experiment, setting.seed, stopped, waiting)
        look = Look(record, job.window)
        metrics = tuple(metric_of(name).measured(look) for name in job.metrics)
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
    return build_any(experiment).run(run.duration, seed, press=run.press, progress=progress, waiting=waiting)
