"""A study from its plan to its table: finished runs are read from the journal, the others are run.

Every finished run is one appended line of the journal; runs of damaged lines are repeated.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from io import FileIO
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

import msgspec

from palpate.errors import InputError
from palpate.files import MADE, check_kept_folder, check_place, kept_folder, write_text
from palpate.logs import write_record
from palpate_studies import journal, run_one, search
from palpate_studies.plan import RunPlan, RunSetting, plan, resolve
from palpate_studies.preview import check_parts_of
from palpate_studies.run_one import Done, Local, Row, RunJob, sources
from palpate_studies.study import parse

if TYPE_CHECKING:
    from polars import DataFrame

NAME = "runs.jsonl"


class JournalHead(msgspec.Struct, frozen=True):
    """The first line: which study this is, and whose numbers.

    Args:
        title: the study's.
        study: hash of all that decides its rows.
        palpate: version.
        sources: hash of the sources that a run consists of.
        runs: how many there are.
        format: of the journal.
    """

    title: str
    study: str
    palpate: str
    sources: str
    runs: int
    format: int = 1


@dataclass
class Finished:
    """Which runs are finished, in little memory: all below `below`, and some."""

    below: int = 0
    above: set[int] | None = None

    def __contains__(self, run: int) -> bool:
        return run < self.below or run in (self.above or ())

    def __len__(self) -> int:
        return self.below + len(self.above or ())

    def add(self, run: int) -> None:
        """Takes one more run as finished."""
        above = self.above = self.above if self.above is not None else set()
        if run >= self.below:
            above.add(run)
        while self.below in above:
            above.remove(self.below)
            self.below += 1


class RunJournal(journal.Journal):
    """A journal of runs, of `opened`."""

    def __init__(self, path: Path, file: FileIO, finished: Finished):
        super().__init__(path, file)
        self.finished = finished

    def append(self, row: Row) -> None:
        """Adds a finished run, once.

        Raises:
            InputError: the disk is full, or cannot be written to; the lines before stay whole.
        """
        if row.run not in self.finished:
            self.write(row, f"{len(self.finished)} runs are saved: ")
            self.finished.add(row.run)

    def rows(self) -> Iterator[Row]:
        """All finished runs, in the order in which they were finished."""
        return rows(self.path)


@contextmanager
def open_journal(path: Path, head: JournalHead) -> Iterator[RunJournal]:
    """The journal of a study at `path`: begun, or gone on with if it is the same study's.

    The folder has to be this process's alone (`kept_folder`).

    Raises:
        InputError: it is another study's, or of another version; it cannot be written.
    """
    check_place(path)
    if path.exists():
        _check(path, head)
    else:
        journal.begin(path, head)
    finished, end = Finished(), journal.end_of_head(path)
    for row, at in journal.entries(path, Row):
        end = at
        if 0 <= row.run < head.runs:
            finished.add(row.run)
    with journal.open_end(path, end) as file:
        yield RunJournal(path, file, finished)


def rows(path: Path) -> Iterator[Row]:
    """All whole lines of a journal, as the runs were finished."""
    return (row for row, _ in journal.entries(path, Row))


def _check(path: Path, head: JournalHead) -> None:
    """Refuse a journal that is not of this study and version."""
    there = journal.head_of(path, JournalHead)
    if there is None:
        raise InputError(f"{path} is no journal of a study; choose another --out")
    if there == head:
        return
    other = "another study" if there.study != head.study else "another version of palpate"
    which = (
        f"{there.title!r}, {there.runs} runs"
        if there.study != head.study
        else f"{there.palpate} {there.sources}"
    )
    raise InputError(
        f"{path.parent} holds the results of {other} ({which}); choose another --out, or add --replace to start again"
    )


SOURCE, RECORDS = "study.toml", "records"


Progress = Callable[[int], None]


class StudyRunner(Protocol):
    """Runs jobs: here, or on a cluster."""

    def run(self, jobs: Iterable[RunJob]) -> Iterator[Done]:
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

    plan: RunPlan
    source: str
    folder: Path
    runner: StudyRunner
    progress: Progress = lambda _: None

    def run(self, *, replace: bool = False) -> DataFrame:
        """Does the missing runs, and writes and returns the table.

        Raises:
            InputError: the folder holds something else and `replace` is off; the disk is full; the cluster is gone.
        """
        with (
            kept_folder(self.folder, NAME, replace=replace),
            open_journal(self.folder / NAME, head(self.plan)) as book,
        ):
            write_text(self.folder / SOURCE, f"{MADE} study, as it was asked for.\n{self.source}")
            self.progress(len(book.finished))
            if self.plan.study.search is None:
                self._run(
                    book, (self.plan.setting(i) for i in range(len(self.plan)) if i not in book.finished)
                )
            else:
                self._search(book)
            frame = run_one.table(self.plan, book.rows())
            run_one.write(frame, self.plan, self.folder / run_one.NAME)
        return frame

    def _run(self, book: RunJournal, settings: Iterable[RunSetting]) -> None:
        """Runs these; each row is in the journal as soon as it is done, its record before it."""
        study = self.plan.study
        metrics = tuple(study.metrics)
        for row, record in self.runner.run(
            RunJob(s, metrics, study.window, study.keep_records, self.plan.plugins) for s in settings
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

    def _search(self, book: RunJournal) -> None:
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


def run(text: str, out: str | Path, *, where: str = "study", runner: StudyRunner | None = None) -> DataFrame:
    """The table of a study: run, parameters, seed, result, why, metrics; what is finished is not run again.

    Args:
        text: the study's file.
        out: folder for the journal and the table.
        where: the file's path, for errors, and for experiments that lie beside it.
        runner: `Local`, on all cores, when left out; or a `palpate_studies.cluster.Cluster`.

    Raises:
        InputError: what `palpate study` would refuse.
    """
    planned = plan(parse(text, where), where)
    check_parts_of(planned)
    return Work(planned, text, Path(out), runner or Local()).run()


def begun(folder: Path) -> bool:
    """Whether a study has been begun in this folder."""
    return (folder / NAME).exists()


def check_folder(folder: Path, plan: RunPlan, *, replace: bool) -> None:
    """Refuse a folder before anything is compiled: it holds other files, or another study.

    Raises:
        InputError: one line says which.
    """
    check_kept_folder(folder, NAME, replace=replace)
    if begun(folder) and not replace:
        with open_journal(folder / NAME, head(plan)):
            pass


def head(plan: RunPlan) -> JournalHead:
    """Identity of a study's journal."""
    from palpate import __version__

    study = hashlib.sha256(resolve(plan)).hexdigest()[:16]
    return JournalHead(plan.study.title, study, str(__version__), sources(), len(plan))
