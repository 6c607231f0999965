"""The edge of the program: every way that a command can end becomes an exit code."""

from __future__ import annotations

import errno
import os
import sys
import traceback
from collections.abc import Callable
from typing import Any

from cyclopts import CycloptsError

from palpate.errors import PalpateError

DONE = 0
WRONG_INPUT = 2
DEFECT = 70  # EX_SOFTWARE of sysexits.h; not 1, which means "ran, and the answer is no"
INTERRUPTED = 130  # 128 + SIGINT, as a shell reports it
READER_GONE = 141  # 128 + SIGPIPE

_REMEDIES = {
    errno.ENOSPC: "free some space, or choose another place",
    errno.EDQUOT: "free some space, or choose another place",
    errno.EACCES: "check its permissions, or choose another place",
    errno.EPERM: "check its permissions, or choose another place",
    errno.EROFS: "choose another place",
    errno.ENOENT: "check the path",
    errno.ENOTDIR: "check the path: a part of it is a file",
    errno.EISDIR: "name a file, not a folder",
    errno.EEXIST: "choose another name",
}


def guarded(command: Callable[[], Any]) -> int:
    """Run a command and return its exit code; whatever it raises is said on standard error.

    What the user can mend is one line: what is wrong, where, and what to do about it.
    A defect of palpate keeps its traceback, because that is what a report of it needs.
    """
    try:
        code = command()
        sys.stdout.flush()
    except BaseException as error:  # noqa: BLE001 - the last one out: exits and interrupts are codes too
        return _code_of(error)
    return DONE if code is None else int(code)


def _code_of(error: BaseException) -> int:
    match error:
        case SystemExit(__context__=BrokenPipeError()):  # rich's way of saying it
            return READER_GONE
        case SystemExit():
            return error.code if isinstance(error.code, int) else DONE
        case KeyboardInterrupt():
            return _say("interrupted", INTERRUPTED)
        case BrokenPipeError():
            return _reader_gone()
        case CycloptsError():
            return _say(f"{error} {_where_help_is(error)}", WRONG_INPUT)
        case PalpateError():
            return _say(str(error), WRONG_INPUT)
        case OSError():
            return _say(_system_line(error), WRONG_INPUT)
        case MemoryError():
            return _say(f"not enough memory for this input: {error or 'give a shorter one'}", WRONG_INPUT)
        case _:
            traceback.print_exception(error)
            return _say("this is a defect of palpate, please report the lines above", DEFECT)


def _say(text: str, code: int) -> int:
    line = " ".join(text.split())
    print(f"palpate: {line}", file=sys.stderr)  # noqa: T201
    return code


def _where_help_is(error: CycloptsError) -> str:
    words = ["palpate", *(error.command_chain or ()), "--help"]
    return f"(see: {' '.join(words)})"


def _system_line(error: OSError) -> str:
    where = error.filename if error.filename is not None else "standard output or a file"
    what = error.strerror or str(error) or type(error).__name__
    remedy = _REMEDIES.get(error.errno or 0, "check the path and try again")
    return f"{where}: {what}; {remedy}"


def _reader_gone() -> int:
    # Python flushes standard output once more at exit; there is nobody left to read it.
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, sys.stdout.fileno())
    os.close(nowhere)
    return READER_GONE
