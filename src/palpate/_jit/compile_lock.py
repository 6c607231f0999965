"""One process at a time compiles a kernel; the others wait, and take from the cache what it has made."""

from __future__ import annotations

import os
import threading
from contextlib import suppress
from pathlib import Path


class CompileLock:
    """A lock on the file that defines a kernel, from a miss in the cache until the kernel is there.

    Without it, processes that start together each compile the same, and two that save at the same moment may give
    different kernels the same file, since Numba's cache has no lock of its own. The lock ends with its process, however
    that ends. Where a system or a file system has none, each process compiles for itself.
    """

    def __init__(self, source: Path):
        self._source = source
        self._handle: int | None = None
        self._holder: int | None = None

    def wait(self) -> None:
        """Return when no other process compiles a kernel of this file."""
        if self._handle is not None:
            return
        with suppress(ImportError, OSError):  # not on Windows, nor on every file system
            import fcntl

            handle = os.open(self._source, os.O_RDONLY | os.O_CLOEXEC)
            try:
                fcntl.flock(handle, fcntl.LOCK_EX)
            except BaseException:
                os.close(handle)
                raise
            self._handle, self._holder = handle, threading.get_ident()

    def release(self) -> None:
        """Let the next process in, if it is this thread that keeps it out."""
        if self._handle is not None and self._holder == threading.get_ident():
            handle, self._handle = self._handle, None
            os.close(handle)
