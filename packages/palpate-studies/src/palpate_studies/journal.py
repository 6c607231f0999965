"""A journal: one value per line with its checksum, on disk at once; damaged lines are skipped.

Text, no database: a damaged line costs one value, and a damaged page of SQLite the file.
"""

import errno
import os
import time
import zlib
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from io import FileIO
from pathlib import Path
from typing import Any, TypeVar

from palpate.errors import InputError
from palpate.files import check_place, whole

_SYNC = 1.0
"""How often at least what is written is made to reach the disk [s]; a process that is killed loses nothing of it."""

T = TypeVar("T")


class Journal:
    """A journal open for writing, by this process alone: of `open_end`."""

    def __init__(self, path: Path, file: FileIO):
        self.path = path
        self._file, self._synced = file, time.monotonic()

    def write(self, value: Any, saved: str = "") -> None:
        """Adds a value; `saved` says in an error what is safe.

        Raises:
            InputError: the disk is full, or cannot be written to; the lines before stay whole.
        """
        before = os.fstat(self._file.fileno()).st_size
        try:
            self._append(_line_of(value))
        except OSError as error:
            _cut(self.path, before)
            raise InputError(
                f"{self.path}: {error.strerror}; {saved}free some space, and the same command resumes"
            ) from error

    def _append(self, line: bytes) -> None:
        # Not buffered: what does not fit now is not tried again when the file is closed.
        if self._file.write(line) < len(line):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        if time.monotonic() - self._synced > _SYNC:
            os.fsync(self._file.fileno())
            self._synced = time.monotonic()


def begin(path: Path, head: Any) -> None:
    """Begins a journal, atomically.

    Raises:
        InputError: palpate may not write there, or the disk is full.
    """
    try:
        with whole(path) as draft, draft.open("wb") as file:
            file.write(_line_of(head))
            file.flush()
            os.fsync(file.fileno())
    except OSError as error:
        raise InputError(f"{path}: {error.strerror}; free some space, or choose another --out") from error


@contextmanager
def open_end(path: Path, end: int) -> Iterator[FileIO]:
    """The file of a journal, to be appended to behind its last whole line; the folder is this process's alone."""
    check_place(path)
    _cut(path, end)
    with path.open("ab", buffering=0) as file:
        yield file


def head_of(path: Path, kind: type[T]) -> T | None:
    """The head of a journal; None where there is none, or a spoiled one."""
    try:
        with path.open("rb") as file:
            return _decode(file.readline(), kind)
    except OSError:
        return None


def entries(path: Path, kind: type[T]) -> Iterator[tuple[T, int]]:
    """Each whole value after the head, and where its line ends."""
    with path.open("rb") as file:
        end = len(file.readline())
        for line in file:
            end += len(line)
            value = _decode(line, kind)
            if value is not None:
                yield value, end


def end_of_head(path: Path) -> int:
    """Where the first line ends."""
    with path.open("rb") as file:
        return len(file.readline())


def _line_of(value: Any) -> bytes:
    import msgspec

    text = msgspec.json.encode(value)
    return b"%08x %s\n" % (zlib.crc32(text), text)


def _decode(line: bytes, kind: type[T]) -> T | None:
    """Content of a line; None if it is truncated or its checksum differs."""
    import msgspec

    checksum, _, text = line.rstrip(b"\n").partition(b" ")
    if not line.endswith(b"\n") or checksum != b"%08x" % zlib.crc32(text):
        return None
    try:
        return msgspec.json.decode(text, type=kind)
    except msgspec.DecodeError:
        return None


def _cut(path: Path, size: int) -> None:
    """Removes the text after the last complete line; a damaged line that remains is skipped when read."""
    with suppress(OSError):
        os.truncate(path, size)
