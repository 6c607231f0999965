"""The journal of a study: every finished run is one appended line; runs of damaged lines are repeated."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from io import FileIO
from pathlib import Path

import msgspec

from palpate.errors import InputError
from palpate.files import check_place, journal
from palpate.studies.running.run_one import Row

NAME = "runs.jsonl"


class Head(msgspec.Struct, frozen=True):
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
        """One more."""
        above = self.above = self.above if self.above is not None else set()
        if run >= self.below:
            above.add(run)
        while self.below in above:
            above.remove(self.below)
            self.below += 1


class Journal(journal.Journal):
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
def opened(path: Path, head: Head) -> Iterator[Journal]:
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
        yield Journal(path, file, finished)


def rows(path: Path) -> Iterator[Row]:
    """All whole lines of a journal, as the runs were finished."""
    return (row for row, _ in journal.entries(path, Row))


def _check(path: Path, head: Head) -> None:
    """Refuse a journal that is not of this study and version."""
    there = journal.head_of(path, Head)
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
