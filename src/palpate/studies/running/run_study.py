"""A study from its plan to its table: finished runs are read from the journal, the others are run."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from palpate.files import MADE, check_kept_folder, kept_folder, write_text
from palpate.logs import write_record
from palpate.studies.definition.part_check import check_parts_of
from palpate.studies.definition.plan import Plan, Setting, plan, resolved
from palpate.studies.definition.study import parse
from palpate.studies.running import journal, results, search
from palpate.studies.running.journal import Head, Journal
from palpate.studies.running.local import Local
from palpate.studies.running.run_one import Done, Job
from palpate.studies.running.sources import sources

SOURCE, RECORDS = "study.toml", "records"

if TYPE_CHECKING:
    from polars import DataFrame

Progress = Callable[[int], None]


class Runner(Protocol):
    """Runs jobs: here, or on a cluster."""

    def run(self, jobs: Iterable[Job]) -> Iterator[Done]:
        """Results of the jobs, in any order."""
        ...


@dataclass(frozen=True)
class Work:
    """A study to be done.

    Args:
        plan: its runs.
        source: its text.
        folder: where everything goes.
        runner: of the jobs.
        progress: receives the number of finished runs.
    """

    plan: Plan
    source: str
    folder: Path
    runner: Runner
    progress: Progress = lambda _: None

    def done(self, *, replace: bool = False) -> DataFrame:
        """Does the missing runs, and writes and returns the table.

        Raises:
            InputError: the folder holds something else and `replace` is off; the disk is full; the cluster is gone.
        """
        with (
            kept_folder(self.folder, journal.NAME, replace=replace),
            journal.opened(self.folder / journal.NAME, head(self.plan)) as book,
        ):
            write_text(self.folder / SOURCE, f"{MADE} study, as it was asked for.\n{self.source}")
            self.progress(len(book.finished))
            if self.plan.study.search is None:
                self._run(
                    book, (self.plan.setting(i) for i in range(len(self.plan)) if i not in book.finished)
                )
            else:
                self._search(book)
            frame = results.table(self.plan, book.rows())
            results.write(frame, self.plan, self.folder / results.NAME)
        return frame

    def _run(self, book: Journal, settings: Iterable[Setting]) -> None:
        """Runs these; each row is in the journal as soon as it is done, its record before it."""
        study = self.plan.study
        metrics = tuple(study.metrics)
        for row, record in self.runner.run(
            Job(s, metrics, study.window, study.keep_records, self.plan.plugins) for s in settings
        ):
            if record is not None:
                write_record(record, self.record(row.run))
            book.append(row)
            self.progress(len(book.finished))

    def record(self, run: int) -> Path:
        """Where the record of a run is kept."""
        folder = self.folder / RECORDS
        folder.mkdir(exist_ok=True)
        return folder / f"{run:0{len(str(len(self.plan) - 1))}d}.parquet"

    def _search(self, book: Journal) -> None:
        study = self.plan.study
        assert study.best is not None
        sought = study.metrics.index(study.best.metric)
        name = f"{study.title} {head(self.plan).study}"
        searching = search.Searching(self.plan, self.folder / search.NAME, name)
        found = {row.run: (row.result, row.metrics[sought]) for row in book.rows()}
        for trials in searching.batches():
            settings = [self.plan.trial(number, values) for number, values in trials]
            self._run(book, (s for trial in settings for s in trial if s.run not in book.finished))
            if any(s.run not in found for trial in settings for s in trial):
                found |= {row.run: (row.result, row.metrics[sought]) for row in book.rows()}
            for (number, values), trial in zip(trials, settings, strict=True):
                searching.tell(number, values, search.objective([found[s.run] for s in trial]))


def run(text: str, out: str | Path, *, where: str = "study", runner: Runner | None = None) -> DataFrame:
    """The table of a study: run, parameters, seed, result, why, metrics; what is finished is not run again.

    Args:
        text: the study's file.
        out: folder for the journal and the table.
        where: the file's path, for errors, and for experiments that lie beside it.
        runner: `Local`, on all cores, when left out; or a `palpate.studies.running.cluster.Cluster`.

    Raises:
        InputError: what `palpate study` would refuse.
    """
    planned = plan(parse(text, where), where)
    check_parts_of(planned)
    return Work(planned, text, Path(out), runner or Local()).done()


def begun(folder: Path) -> bool:
    """Whether a study has been begun in this folder."""
    return (folder / journal.NAME).exists()


def check_folder(folder: Path, plan: Plan, *, replace: bool) -> None:
    """Refuse a folder before anything is compiled: it holds other files, or another study.

    Raises:
        InputError: one line says which.
    """
    check_kept_folder(folder, journal.NAME, replace=replace)
    if begun(folder) and not replace:
        with journal.opened(folder / journal.NAME, head(plan)):
            pass


def head(plan: Plan) -> Head:
    """Identity of a study's journal."""
    from palpate import __version__

    study = hashlib.sha256(resolved(plan)).hexdigest()[:16]
    return Head(plan.study.title, study, str(__version__), sources(), len(plan))
