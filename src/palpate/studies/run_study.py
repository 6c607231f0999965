"""A study from its plan to its table: finished runs are read from the journal, the others are run."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import msgspec

from palpate.bench import Experiment, build
from palpate.bench.from_experiment import check_parts
from palpate.errors import InputError, PluginError
from palpate.files import MADE, check_kept_folder, kept_folder, write_text
from palpate.logs.tables.parquet import write_parquet
from palpate.plugins import is_plugin
from palpate.studies import journal
from palpate.studies.journal import Row, head_of, open_journal
from palpate.studies.metrics import Window, metric_of
from palpate.studies.metrics.verdicts import try_metric
from palpate.studies.plan import MAX_TRIED, RunPlan, corner_values, plan_runs
from palpate.studies.run_one import Local, RunJob
from palpate.studies.study import parse

if TYPE_CHECKING:
    from polars import DataFrame

SOURCE, TABLE = "study.toml", "results.parquet"
TRIAL_PRESS = 0.1
"""Contact after which a run is long enough to try a metric on it [s]."""


class StudyRunner(Protocol):
    """Runs jobs: here, or on a cluster."""

    def run(self, jobs: Iterable[RunJob]) -> Iterator[Row]:
        """Results of the jobs, in any order."""
        ...


@dataclass(frozen=True)
class Work:
    """A study to be done.

    Args:
        plan: its runs.
        source: its text.
        folder: for the journal and the table.
        runner: of the jobs.
        progress: receives the number of finished runs.
    """

    plan: RunPlan
    source: str
    folder: Path
    runner: StudyRunner
    progress: Callable[[int], None] = lambda _: None

    def run(self, *, replace: bool = False) -> DataFrame:
        """Do the missing runs, and write and return the table.

        Raises:
            InputError: the folder holds something else and `replace` is off; the disk is full; the cluster is gone.
        """
        path, study = self.folder / journal.NAME, self.plan.study
        with (
            kept_folder(self.folder, journal.NAME, replace=replace),
            open_journal(path, head_of(self.plan)) as book,
        ):
            write_text(self.folder / SOURCE, f"{MADE} study, as it was asked for.\n{self.source}")
            self.progress(len(book.finished))
            missing = (self.plan.setting(i) for i in range(len(self.plan)) if i not in book.finished)
            jobs = (
                RunJob(setting, tuple(study.metrics), study.window, self.plan.plugins) for setting in missing
            )
            for row in self.runner.run(jobs):
                book.append(row)
                self.progress(len(book.finished))
            frame = table(self.plan, book.rows())
            _write_table(frame, self.plan, self.folder / TABLE)
        return frame


def run(text: str, out: str | Path, *, where: str = "study", runner: StudyRunner | None = None) -> DataFrame:
    """The table of a study: run, parameters, seed, result, why, metrics; finished runs are not run again.

    Args:
        text: the study's file.
        out: folder for the journal and the table.
        where: the file's path, for errors, and for experiments that lie beside it.
        runner: `Local`, on all cores, when left out; or a `palpate.studies.run_one.Cluster`.

    Raises:
        InputError: what `palpate study` would refuse.
    """
    planned = plan_runs(parse(text, where), where)
    check_parts_of(planned)
    return Work(planned, text, Path(out), runner or Local()).run()


def check_folder(folder: Path, plan: RunPlan, *, replace: bool) -> None:
    """Refuse a folder before anything is compiled: it holds other files, or another study.

    Raises:
        InputError: one line says which.
    """
    check_kept_folder(folder, journal.NAME, replace=replace)
    if (folder / journal.NAME).exists() and not replace:
        with open_journal(folder / journal.NAME, head_of(plan)):
            pass


def check_parts_of(plan: RunPlan, waiting: Callable[[], None] | None = None) -> None:
    """Try every combination of the user's parts once, and every metric of theirs on a short press.

    Args:
        plan: of the study.
        waiting: called when a loop has to be compiled first.

    Raises:
        InputError: one of them cannot do what the study asks of it; one line says which and why.
    """
    if not plan.plugins:
        return
    metrics = [metric_of(name) for name in plan.study.metrics if is_plugin(name)]
    for number, experiment in enumerate(_combinations(plan)):
        bench = build(experiment)
        check_parts(bench, waiting)
        if number == 0 and metrics:
            run = experiment.run
            record = bench.run(run.duration, press=min(TRIAL_PRESS, run.press), waiting=waiting)
            for metric in metrics:
                try_metric(metric, Window(record))


def _combinations(plan: RunPlan) -> Iterator[Experiment]:
    """An experiment for each combination of parts among the study's values."""
    known = set()
    for values in islice(corner_values(plan), MAX_TRIED):
        try:
            experiment = plan.experiment(values)
            build(experiment)
        except PluginError:
            raise
        except InputError:  # a value that is refused is a row of its own
            continue
        kinds = tuple(map(type, (experiment.controller, experiment.surface, experiment.identifier)))
        if kinds not in known:
            known.add(kinds)
            yield experiment


def table(plan: RunPlan, rows: Iterable[Row]) -> DataFrame:
    """The rows as columns: run, parameters, seed, result, why, metrics; each run once, sorted by its number."""
    import polars

    types = {int: polars.Int64, float: polars.Float64, bool: polars.Boolean, str: polars.String}
    schema: dict[str, Any] = {"run": polars.Int64}
    schema |= {name: types[kind] for name, kind in plan.columns.items()}
    schema |= {"result": polars.String, "why": polars.String}
    schema |= dict.fromkeys(plan.study.metrics, polars.Float64)

    def values(row: Row) -> tuple[Any, ...]:
        at = (kind(row.at[name]) for name, kind in plan.columns.items())
        return (row.run, *at, row.result, row.why, *row.metrics)

    frame = polars.DataFrame(list(map(values, rows)), schema=schema, orient="row")
    return frame.unique("run", keep="first", maintain_order=True).sort("run").rechunk()


def _write_table(frame: DataFrame, plan: RunPlan, path: Path) -> None:
    """Write the table as Parquet, with units and texts of the metrics in the file's metadata."""
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
