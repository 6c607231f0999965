"""The edge of the program: every end of a command becomes an exit code."""

from __future__ import annotations

import errno
import re
import sys
import traceback
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from cyclopts import CycloptsError

from palpate.cli import _streams
from palpate.errors import LONGEST, PalpateError
from palpate.text import printable, shorten

DONE = 0
WRONG_INPUT = 2
DEFECT = 70  # EX_SOFTWARE of sysexits.h; not 1, which means "ran, and the answer is no"
INTERRUPTED = 130  # 128 + SIGINT, as a shell reports it
READER_GONE = 141  # 128 + SIGPIPE

_DANGEROUS = {"--replace", "--yes"}
"""Flags that remove results, or start an arm or a long run without a question."""
_REMEDIES = {
    errno.ENOSPC: "free some space, or choose another place",
    errno.EDQUOT: "free some space, or choose another place",
    errno.EACCES: "check its permissions, or choose another place",
    errno.EPERM: "check its permissions, or choose another place",
    errno.EROFS: "choose another place",
    errno.ENOENT: "check the path",
    errno.ENOTDIR: "check the path: one of its folders is a file",
    errno.EISDIR: "name a file, not a folder",
    errno.EEXIST: "choose another name",
}


def guarded(command: Callable[[], Any]) -> int:
    """Run a command and return its exit code; exceptions are reported on standard error.

    An error that the user can correct is one line: the fault, the place, and the remedy.
    A defect of palpate keeps its traceback, for the report.
    """
    try:
        code = command()
        _streams.flush(sys.stdout)
    except BaseException as error:  # noqa: BLE001 - the last one out: exits and interrupts are codes too
        return _settle(_code_of(error))
    return _settle(DONE if code is None else int(code))


def _settle(code: int) -> int:
    """The code, after the streams are flushed, so that Python's own flush at exit cannot fail."""
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError):
            _streams.flush(stream)
    return code


def _code_of(error: BaseException) -> int:
    match error:
        case SystemExit(__context__=BrokenPipeError()):  # rich's way of saying it
            return READER_GONE
        case SystemExit():
            return error.code if isinstance(error.code, int) else DONE
        case KeyboardInterrupt():
            return _say("interrupted", INTERRUPTED)
        case BrokenPipeError():
            _streams.drop(sys.stdout)
            return READER_GONE
        case CycloptsError():
            return _say(f"{_without_danger(error)} {_where_help_is(error)}", WRONG_INPUT)
        case PalpateError():
            return _say(str(error), WRONG_INPUT)
        case OSError():
            return _say(_system_line(error), WRONG_INPUT)
        case MemoryError():
            return _say(f"not enough memory for this input: {error or 'give a shorter one'}", WRONG_INPUT)
        case _:
            with suppress(OSError):
                traceback.print_exception(error)
            return _say("this is a defect of palpate; please report the lines above", DEFECT)


def _say(text: str, code: int) -> int:
    line = printable(shorten(" ".join(text.split()), LONGEST))
    with suppress(OSError):  # standard error is full or closed: the code still tells
        print(f"palpate: {line}", file=sys.stderr)  # noqa: T201
    return code


def _without_danger(error: CycloptsError) -> str:
    """The error, without a suggestion of a flag that removes results or skips a question.

    A typing error must not suggest a destructive flag.
    """
    text = str(error)
    guess = re.search(r" ?Did you mean \"?(--[\w-]+)\"?\??", text)
    if guess is None or guess[1].replace("--no-", "--") not in _DANGEROUS:
        return text
    return text.replace(guess[0], "")


def _where_help_is(error: CycloptsError) -> str:
    words = ["palpate", *(error.command_chain or ()), "--help"]
    return f"(see: {' '.join(words)})"


def _system_line(error: OSError) -> str:
    where = error.filename if error.filename is not None else "standard output or a file"
    what = error.strerror or str(error) or type(error).__name__
    remedy = _REMEDIES.get(error.errno or 0, "check the path and try again")
    return f"{where}: {what}; {remedy}"
