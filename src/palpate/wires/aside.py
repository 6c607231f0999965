"""What a maker's library says on standard output goes to standard error: this program's output may be JSON."""

from __future__ import annotations

import ctypes
import os
import sys
from typing import TextIO


class Aside:
    """From `begin` to `end`, standard output is Python's alone; nothing is done where it is no file of the system's."""

    def __init__(self) -> None:
        self._before: TextIO | None = None

    def begin(self) -> None:
        """Give the library's words another way."""
        try:
            if self._before is not None or sys.stdout.fileno() != 1:
                return
            sys.stdout.flush()
            kept = os.fdopen(os.dup(1), "w", encoding=sys.stdout.encoding, errors=sys.stdout.errors)
            os.dup2(2, 1)
        except (OSError, ValueError, AttributeError):  # closed, or put in place by somebody
            return
        self._before, sys.stdout = sys.stdout, kept

    def end(self) -> None:
        """Give standard output back."""
        if self._before is None:
            return
        ctypes.CDLL(None).fflush(None)  # else it stays in C's buffer until the process ends
        kept = sys.stdout
        kept.flush()
        os.dup2(kept.fileno(), 1)
        sys.stdout, self._before = self._before, None
        kept.close()
