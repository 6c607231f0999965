"""Every tried laboratory, one line each, on disk at once, so that none is computed twice."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from io import FileIO
from pathlib import Path

import msgspec

from palpate.errors import InputError
from palpate.files import check_place, journal


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


class Archive(journal.Journal):
    """Open for writing, by this process alone: of `opened`."""

    def __init__(self, path: Path, file: FileIO, known: dict[int, Tried]):
        super().__init__(path, file)
        self.known = known

    def add(self, tried: Tried) -> None:
        """One more.

        Raises:
            InputError: the disk is full, or cannot be written to.
        """
        self.write(tried)
        self.known[tried.number] = tried


@contextmanager
def opened(path: Path, head: Head) -> Iterator[Archive]:
    """The archive at `path`: begun, or gone on with if it is of the same search and sources.

    Raises:
        InputError: it is another's, or none.
    """
    check_place(path)
    if not path.exists():
        journal.begin(path, head)
    there, known = read(path)
    if there != head:
        raise InputError(
            f"{path} is of another search, or of other sources; choose another --out, or add --force to start again"
        )
    end = max((at for _, at in journal.entries(path, Tried)), default=journal.end_of_head(path))
    with journal.opened(path, end) as file:
        yield Archive(path, file, known)


def read(path: Path) -> tuple[Head, dict[int, Tried]]:
    """Head, and laboratories by number.

    Raises:
        InputError: it is no archive.
    """
    head = journal.head_of(path, Head)
    if head is None:
        raise InputError(f"{path} is no archive of laboratories; choose another --out")
    return head, {tried.number: tried for tried, _ in journal.entries(path, Tried)}
