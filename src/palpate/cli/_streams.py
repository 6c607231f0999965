"""Standard output and standard error, even if closed, full, or with a limited encoding."""

from __future__ import annotations

import codecs
import logging
import os
import sys
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
    logging.getLogger("matplotlib").setLevel(logging.ERROR)  # a home that cannot be written is no trouble
    codecs.register_error(_ERRORS, _plainly)
    for name, number, mode in (("stdin", 0, "r"), ("stdout", 1, "w"), ("stderr", 2, "w")):
        if getattr(sys, name) is None:
            _to_nowhere(number)
            setattr(sys, name, open(number, mode, encoding="utf-8", closefd=False))  # noqa: SIM115
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors=_ERRORS)


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
