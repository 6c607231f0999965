"""Standard output and standard error, even if closed, full, or with a limited encoding; and palpate's own alone."""

from __future__ import annotations

import codecs
import faulthandler
import logging
import os
import sys
import threading
import traceback
import warnings
from contextlib import suppress
from io import TextIOWrapper
from typing import TextIO

_PLAIN = {"±": "+-", "–": "-", "—": "-", "…": "...", "µ": "u", "×": "x", "²": "^2", "°": " deg", "√": "sqrt"}
_ERRORS = "palpate"


def prepare() -> None:
    """Make the streams of this process ready for any text.

    A stream that was closed before the program began is opened to the null device: otherwise the next opened file
    would take its descriptor. A letter that the encoding lacks is escaped.
    """
    codecs.register_error(_ERRORS, _plainly)
    for name, number, mode in (("stdin", 0, "r"), ("stdout", 1, "w"), ("stderr", 2, "w")):
        if getattr(sys, name) is None:
            _to_nowhere(number)
            setattr(sys, name, open(number, mode, encoding="utf-8", closefd=False))  # noqa: SIM115
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors=_ERRORS)
    if not (sys.warnoptions or faulthandler.is_enabled()):  # `python -X dev -m palpate` shows all
        _silence_libraries()


def _silence_libraries() -> None:
    """Let nothing reach standard error but what palpate writes there.

    A library warns, logs, writes to the descriptor from compiled code, or dies in a thread of its own: of all that the
    reader of a command can change nothing, and what concerns them palpate says in its own line.
    """
    warnings.showwarning = lambda *_, **__: None
    logging.disable()
    threading.excepthook = _in_a_thread
    own = os.dup(2)
    encoding = getattr(sys.stderr, "encoding", None) or "utf-8"
    sys.stderr = open(own, "w", buffering=1, encoding=encoding, errors=_ERRORS)  # noqa: SIM115, PTH123 - a number
    _to_nowhere(2)


def _in_a_thread(died: threading.ExceptHookArgs) -> None:
    """A thread's error, where it is a defect of palpate."""
    package = os.path.dirname(os.path.dirname(__file__))  # noqa: PTH120 - as frames have it
    frames = traceback.extract_tb(died.exc_traceback)
    if any(frame.filename.startswith(package) for frame in frames):
        threading.__excepthook__(died)


def flush(stream: TextIO) -> None:
    """Write the buffers; if that fails, drop them, so that nothing fails at exit.

    Raises:
        OSError: the stream is full, or its reader has gone.
    """
    try:
        stream.flush()
    except OSError:
        drop(stream)
        raise


def drop(stream: TextIO) -> None:
    """Discard the buffers and all later output."""
    with suppress(OSError):  # a stream without a file has nobody else to fail
        _to_nowhere(stream.fileno())
    with suppress(OSError):
        stream.flush()


def _to_nowhere(number: int) -> None:
    nowhere = os.open(os.devnull, os.O_RDWR)
    if nowhere != number:
        os.dup2(nowhere, number)
        os.close(nowhere)


def _plainly(error: UnicodeError) -> tuple[str | bytes, int]:
    if not isinstance(error, UnicodeEncodeError):
        raise error
    letters = error.object[error.start : error.end]
    return "".join(_PLAIN.get(a) or ascii(a)[1:-1] for a in letters), error.end
