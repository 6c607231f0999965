"""Every laboratory that was tried, one line each: what is done is on disk at once, and is not done again."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from io import FileIO
from pathlib import Path

import msgspec

from palpate.errors import InputError
from palpate.files import check_place
from palpate.studies.journal import decoded, line_of


class Head(msgspec.Struct, frozen=True):
    """The first line: of which search.

    Args:
        title: what it is.
        palpate: version.
        search: all that decides it, in words.
        sources: hash of the sources that a trial consists of.
        sentences: their ids, in the order of the verdicts.
    """

    title: str
    palpate: str
    search: str
    sources: str
    sentences: tuple[str, ...]


class Tried(msgspec.Struct, frozen=True):
    """One laboratory.

    Args:
        number: of it in its search.
        shares: of the priors, where it lies.
        verdicts: of the sentences in turn; shorter where it was given up.
    """

    number: int
    shares: tuple[float, ...]
    verdicts: tuple[bool, ...]


@dataclass
class Archive:
    """Open for writing, by this process alone."""

    known: dict[int, Tried]
    _file: FileIO

    def add(self, tried: Tried) -> None:
        """One more.

        Raises:
            InputError: the disk is full, or cannot be written to.
        """
        line, before = line_of(msgspec.json.encode(tried)), os.fstat(self._file.fileno()).st_size
        try:
            written, why = self._file.write(line), "no space is left"
        except OSError as error:
            written, why = 0, str(error.strerror)
        if written < len(line):
            os.ftruncate(self._file.fileno(), before)
            raise InputError(
                f"{self._file.name}: {why}; free some space, and the same command goes on from there"
            )
        self.known[tried.number] = tried


@contextmanager
def opened(path: Path, head: Head) -> Iterator[Archive]:
    """The archive at `path`: begun, or gone on with if it is of the same search and sources.

    Raises:
        InputError: it is another's, or none.
    """
    check_place(path)
    if path.exists():
        there, known, end = read(path)
        if there != head:
            raise InputError(
                f"{path} is of another search, or of other sources; choose another --out, or add --force to begin anew"
            )
        os.truncate(path, end)
    else:
        path.write_bytes(line_of(msgspec.json.encode(head)))
        known = {}
    with path.open("ab", buffering=0) as file:
        yield Archive(known, file)


def read(path: Path) -> tuple[Head, dict[int, Tried], int]:
    """Head, laboratories by number, and where the last whole line ends.

    Raises:
        InputError: it is no archive.
    """
    lines = path.read_bytes().splitlines(keepends=True)
    head = decoded(lines[0], Head) if lines else None
    if head is None:
        raise InputError(f"{path} is no archive of laboratories; choose another --out")
    known, end = {}, len(lines[0])
    for line in lines[1:]:
        tried = decoded(line, Tried)
        if tried is None:
            break
        known[tried.number] = tried
        end += len(line)
    return head, known, end
