"""The journal of a study: a head, then one line per finished run with its checksum, on disk at once.

The head says of which study the rows are and by which sources they were made: a journal of another study or of other
sources is refused. Damaged lines are skipped, and their runs repeated.
"""

from __future__ import annotations

import errno
import hashlib
import os
import platform
import time
import zlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from functools import cache
from importlib.metadata import version
from io import FileIO
from pathlib import Path
from typing import TypeVar

import msgspec

import palpate
from palpate.errors import InputError
from palpate.files import check_place, whole
from palpate.studies.parameters import Label
from palpate.studies.plan import RunPlan, decisive_bytes

NAME = "runs.jsonl"
LIBRARIES = ("numba", "numpy", "scipy")
SYNC_PERIOD = 1.0
"""Longest time between two syncs to disk [s]; a killed process loses nothing that it has written."""

T = TypeVar("T")


class Row(msgspec.Struct, frozen=True, array_like=True):
    """Result of a run.

    Args:
        run: its number.
        at: the parameters' values.
        result: how it ended, in a stable word.
        why: the reason, in a sentence.
        metrics: in the study's order; None where the run has no such number.
        seconds: its duration.
    """

    run: int
    at: dict[str, Label]
    result: str
    why: str
    metrics: tuple[float | None, ...]
    seconds: float


class JournalHead(msgspec.Struct, frozen=True):
    """The first line.

    Args:
        title: the study's.
        study: hash of everything in the study's file that decides its rows.
        palpate: version.
        stamp: versions and hashes of everything else that decides them, by name: `sources()` and the user's plug-ins.
        runs: number of runs.
    """

    title: str
    study: str
    palpate: str
    stamp: dict[str, str]
    runs: int


class Journal:
    """A journal open for writing, by this process alone; `open_journal` makes it."""

    def __init__(self, path: Path, file: FileIO, finished: set[int]):
        self.path, self.finished = path, finished
        self._file, self._last_sync = file, time.monotonic()

    def append(self, row: Row) -> None:
        """Add a finished run, once.

        Raises:
            InputError: the disk is full, or cannot be written to; the lines before stay whole.
        """
        if row.run in self.finished:
            return
        size = os.fstat(self._file.fileno()).st_size
        try:
            self._write(_encode(row))
        except OSError as error:
            with suppress(OSError):
                os.truncate(self.path, size)
            raise InputError(
                f"{self.path}: {error.strerror}; {len(self.finished)} runs are saved: free some space, and the same "
                "command resumes"
            ) from error
        self.finished.add(row.run)

    def rows(self) -> Iterator[Row]:
        """All finished runs, in the order in which they were finished."""
        with self.path.open("rb") as file:
            file.readline()
            for line in file:
                row = _decode(line, Row)
                if row is not None:
                    yield row

    def _write(self, line: bytes) -> None:
        # The file has no buffer: a line that does not fit now is not written again when the file is closed.
        if self._file.write(line) < len(line):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        if time.monotonic() - self._last_sync > SYNC_PERIOD:
            os.fsync(self._file.fileno())
            self._last_sync = time.monotonic()


@contextmanager
def open_journal(path: Path, head: JournalHead) -> Iterator[Journal]:
    """Begin a journal, or resume it after its last whole line.

    The folder has to be this process's alone (`kept_folder`).

    Raises:
        InputError: it is another study's, or of other sources; it cannot be written.
    """
    check_place(path)
    if path.exists():
        _check_head(path, head)
    else:
        _begin(path, head)
    finished, end = _scan(path)
    os.truncate(path, end)
    with path.open("ab", buffering=0) as file:
        yield Journal(path, file, finished)


def head_of(plan: RunPlan) -> JournalHead:
    """The head of a study's journal."""
    study = hashlib.sha256(decisive_bytes(plan)).hexdigest()[:16]
    stamp = sources() | {plugin.name: plugin.stamp for plugin in plan.plugins}
    return JournalHead(plan.study.title, study, str(palpate.__version__), stamp, len(plan))


@cache
def sources() -> dict[str, str]:
    """Versions of Python and the libraries, and a hash of palpate's own sources, wherever they are installed."""
    stamp = {"Python": ".".join(platform.python_version_tuple()[:2])}
    stamp |= {name: version(name) for name in LIBRARIES}
    folder = Path(palpate.__file__).parent
    digest = hashlib.sha256()
    for file in sorted(folder.rglob("*.py")):
        digest.update(file.relative_to(folder).as_posix().encode() + b"\0" + file.read_bytes())
    return stamp | {"palpate's sources": digest.hexdigest()[:16]}


def differences(there: Mapping[str, str], here: Mapping[str, str]) -> str:
    """The entries that differ between two stamps; "" if none does."""
    names = [name for name in {**there, **here} if there.get(name) != here.get(name)]
    return ", ".join(f"{name} {there.get(name, 'none')} (here {here.get(name, 'none')})" for name in names)


def _check_head(path: Path, head: JournalHead) -> None:
    """Refuse a journal that is not of this study and these sources."""
    with path.open("rb") as file:
        existing = _decode(file.readline(), JournalHead)
    if existing is None:
        raise InputError(f"{path} is no journal of a study of this version; choose another --out")
    if existing == head:
        return
    other = f"another study ({existing.title!r}, {existing.runs} runs)"
    if existing.study == head.study:
        stamps = ({"palpate": h.palpate, **h.stamp} for h in (existing, head))
        other = f"other sources than those here: {differences(*stamps)}"
    raise InputError(
        f"{path.parent} holds the results of {other}; choose another --out, or add --replace to start again"
    )


def _begin(path: Path, head: JournalHead) -> None:
    try:
        with whole(path) as draft, draft.open("wb") as file:
            file.write(_encode(head))
            file.flush()
            os.fsync(file.fileno())
    except OSError as error:
        raise InputError(f"{path}: {error.strerror}; free some space, or choose another --out") from error


def _scan(path: Path) -> tuple[set[int], int]:
    """Numbers of the finished runs, and the position after the last whole line [bytes]."""
    finished: set[int] = set()
    with path.open("rb") as file:
        position = end = len(file.readline())
        for line in file:
            position += len(line)
            row = _decode(line, Row)
            if row is not None:
                finished.add(row.run)
                end = position
    return finished, end


def _encode(value: msgspec.Struct) -> bytes:
    text = msgspec.json.encode(value)
    return b"%08x %s\n" % (zlib.crc32(text), text)


def _decode(line: bytes, kind: type[T]) -> T | None:
    """Content of a line; None if it is truncated or its checksum differs."""
    checksum, _, text = line.rstrip(b"\n").partition(b" ")
    if not line.endswith(b"\n") or checksum != b"%08x" % zlib.crc32(text):
        return None
    try:
        return msgspec.json.decode(text, type=kind)
    except msgspec.DecodeError:
        return None
