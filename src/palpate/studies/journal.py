"""The journal of a study: every finished run is one line, appended; whatever is torn or spoiled is run again."""

from __future__ import annotations

import errno
import os
import time
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from io import FileIO
from pathlib import Path
from typing import TypeVar

import msgspec

from palpate.errors import InputError
from palpate.files import check_place, whole
from palpate.studies.run_one import Row

NAME = "runs.jsonl"
SYNC = 1.0
"""How often at least what is written is made to reach the disk [s]; a process that is killed loses nothing of it."""


S = TypeVar("S")


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


class Journal:
    """A journal open for writing, by this process alone.

    Use `opened`.
    """

    def __init__(self, path: Path, file: FileIO, finished: Finished):
        self.path, self.finished = path, finished
        self._file, self._synced = file, time.monotonic()

    def append(self, row: Row) -> None:
        """Adds a finished run.

        Raises:
            InputError: the disk is full, or cannot be written to; the lines before stay whole.
        """
        if row.run in self.finished:
            return
        before = os.fstat(self._file.fileno()).st_size
        try:
            self._write(line_of(msgspec.json.encode(row)))
        except OSError as error:
            _cut(self.path, before)
            raise InputError(
                f"{self.path}: {error.strerror}; {len(self.finished)} runs are saved: free some space, and the same "
                f"command goes on from there"
            ) from error
        self.finished.add(row.run)

    def _write(self, line: bytes) -> None:
        # Not buffered: what does not fit now is not tried again when the file is closed.
        if self._file.write(line) < len(line):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        if time.monotonic() - self._synced > SYNC:
            os.fsync(self._file.fileno())
            self._synced = time.monotonic()

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
        _begin(path, head)
    finished = Finished()
    end = _end_of_head(path)
    for row, at in _read(path):
        end = at
        if 0 <= row.run < head.runs:
            finished.add(row.run)
    _cut(path, end)
    with path.open("ab", buffering=0) as file:
        yield Journal(path, file, finished)


def rows(path: Path) -> Iterator[Row]:
    """All whole lines of a journal, as the runs were finished."""
    return (row for row, _ in _read(path))


def head_of(path: Path) -> Head | None:
    """The head of a journal; None where there is none, or a spoiled one."""
    try:
        with path.open("rb") as file:
            return decoded(file.readline(), Head)
    except OSError:
        return None


def _check(path: Path, head: Head) -> None:
    """Refuse a journal that is not of this study and version."""
    there = head_of(path)
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
        f"{path.parent} holds the results of {other} ({which}); choose another --out, or add --force to begin anew"
    )


def _begin(path: Path, head: Head) -> None:
    try:
        with whole(path) as draft, draft.open("wb") as file:
            file.write(line_of(msgspec.json.encode(head)))
            file.flush()
            os.fsync(file.fileno())
    except OSError as error:
        raise InputError(f"{path}: {error.strerror}; free some space, or choose another --out") from error


def line_of(text: bytes) -> bytes:
    """A line of a journal: the text behind its checksum."""
    return b"%08x %s\n" % (zlib.crc32(text), text)


def decoded(line: bytes, kind: type[S]) -> S | None:
    """What a line holds; None where it is torn or its checksum is another."""
    checksum, _, text = line.rstrip(b"\n").partition(b" ")
    if not line.endswith(b"\n") or checksum != b"%08x" % zlib.crc32(text):
        return None
    try:
        return msgspec.json.decode(text, type=kind)
    except msgspec.DecodeError:
        return None


def _end_of_head(path: Path) -> int:
    with path.open("rb") as file:
        return len(file.readline())


def _read(path: Path) -> Iterator[tuple[Row, int]]:
    """Each whole line after the head, and where it ends."""
    with path.open("rb") as file:
        end = len(file.readline())
        for line in file:
            end += len(line)
            row = decoded(line, Row)
            if row is not None:
                yield row, end


def _cut(path: Path, size: int) -> None:
    """Takes off what stands behind the last whole line."""
    try:
        os.truncate(path, size)
    except OSError:  # a torn line at the end is passed over when it is read
        return
