"""Redirects a maker's library from standard output to standard error: this program's output may be JSON."""

from __future__ import annotations

import os
import sys


def libraries_aside() -> None:
    """From now on standard output is Python's alone; nothing is done where it is no file of the system's.

    Never taken back: a library's thread that a lost connection holds up speaks when it likes.
    """
    try:
        if sys.stdout.fileno() != 1:
            return
        sys.stdout.flush()
        kept = os.fdopen(os.dup(1), "w", encoding=sys.stdout.encoding, errors=sys.stdout.errors)
        os.dup2(2, 1)
    except (OSError, ValueError, AttributeError):  # closed, or put in place by somebody
        return
    sys.stdout = kept
