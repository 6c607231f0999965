"""One process at a time: a lock that ends with its process, however that ends."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

HIDDEN = ".palpate-part"
"""Ends the name of what is being written."""


def draft_path(path: Path, ending: str = HIDDEN) -> Path:
    """Where a file or a folder stands until it is whole."""
    return path.with_name(f".{path.name}{ending}")


def locked(handle: int) -> bool:
    """Whether the open file or folder could be locked; where there are no such locks, it counts as locked."""
    try:
        import fcntl
    except ImportError:  # two processes at one place are then their user's care
        return True
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:  # a file system without locks
        return True
    return True


@contextmanager
def locking(path: Path, flags: int = os.O_RDONLY) -> Iterator[int | None]:
    """Open and lock a file or a folder, a link excepted; None while another process has it."""
    handle = os.open(path, flags | os.O_CLOEXEC | getattr(os, "O_NOFOLLOW", 0), 0o666)
    try:
        yield handle if locked(handle) and _stands(handle, path) else None
    finally:
        os.close(handle)


def _stands(handle: int, path: Path) -> bool:
    """Whether the opened file is still the one at its path, and was not replaced in the meantime."""
    try:
        there = os.lstat(path)
    except FileNotFoundError:
        return False
    return os.path.samestat(os.fstat(handle), there)
