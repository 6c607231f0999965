"""Standard output and standard error, even if closed, full, or with a limited encoding; and palpate's own alone."""

import codecs
import errno
import faulthandler
import logging
import os
import re
import signal
import sys
import threading
import traceback
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from io import TextIOWrapper
from types import FrameType
from typing import Any, TextIO

from cyclopts import CycloptsError

from palpate.errors import LONGEST, PalpateError
from palpate.text import printable, shorten

_PLAIN = {"±": "+-", "–": "-", "—": "-", "…": "...", "µ": "u", "×": "x", "²": "^2", "°": " deg", "√": "sqrt"}
_ERRORS = "palpate"


def prepare() -> None:
    """Make the streams of this process ready for any text.

    A stream that was closed before the program began is opened to the null device: otherwise the next opened file
    would take its descriptor. Standard output then takes nothing, so that no answer is lost without a word. A letter
    that the encoding lacks is escaped.
    """
    codecs.register_error(_ERRORS, _replace_letters)
    for name, number, mode in (("stdin", 0, "r"), ("stdout", 1, "w"), ("stderr", 2, "w")):
        if getattr(sys, name) is None:
            _redirect_to_null(number, os.O_RDONLY if name == "stdout" else os.O_RDWR)
            setattr(sys, name, open(number, mode, encoding="utf-8", closefd=False))  # noqa: SIM115
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors=_ERRORS)
    if not (sys.warnoptions or faulthandler.is_enabled()):  # `python -X dev -m palpate` shows all
        _silence_libraries()


MIN_WIDTH = 20
"""Narrowest terminal that is believed [columns]: narrower, a table has no room for one number and its unit."""


def forget_impossible_numbers() -> None:
    """Remove from the environment a size that no terminal has, and a number of threads that no library takes."""
    for name, least in (("COLUMNS", MIN_WIDTH), ("LINES", 1), ("POLARS_MAX_THREADS", 1)):
        number = os.environ.get(name, "")
        if not (number.isdecimal() and int(number[:9]) >= least):
            os.environ.pop(name, None)


def _silence_libraries() -> None:
    """Let nothing reach standard error but what palpate writes there.

    A library warns, logs, writes to the descriptor from compiled code, or fails in its own thread. The user can change
    none of that; palpate reports what concerns the user in its own line.
    """
    warnings.showwarning = lambda *_, **__: None
    logging.disable()
    threading.excepthook = _report_thread_error
    descriptor = os.dup(2)
    encoding = getattr(sys.stderr, "encoding", None) or "utf-8"
    sys.stderr = open(descriptor, "w", buffering=1, encoding=encoding, errors=_ERRORS)  # noqa: SIM115, PTH123 - a number
    _redirect_to_null(2)


def _report_thread_error(died: threading.ExceptHookArgs) -> None:
    """A thread's error, where it is a defect of palpate."""
    package = os.path.dirname(os.path.dirname(__file__))  # noqa: PTH120 - as frames have it
    frames = traceback.extract_tb(died.exc_traceback)
    if any(frame.filename.startswith(package) for frame in frames):
        threading.__excepthook__(died)


def flush(stream: TextIO | None) -> None:
    """Write the buffers; if that fails, drop them, so that nothing fails at exit. A closed stream is None.

    Raises:
        OSError: the stream is full, or its reader has gone.
    """
    if stream is None:
        return
    try:
        stream.flush()
    except OSError:
        drop(stream)
        raise


def drop(stream: TextIO) -> None:
    """Discard the buffers and all later output."""
    with suppress(OSError):  # a stream without a file has nobody else to fail
        _redirect_to_null(stream.fileno())
    with suppress(OSError):
        stream.flush()


def _redirect_to_null(number: int, mode: int = os.O_RDWR) -> None:
    nowhere = os.open(os.devnull, mode)
    if nowhere != number:
        os.dup2(nowhere, number)
        os.close(nowhere)


def _replace_letters(error: UnicodeError) -> tuple[str | bytes, int]:
    if not isinstance(error, UnicodeEncodeError):
        raise error
    letters = error.object[error.start : error.end]
    return "".join(_PLAIN.get(a) or ascii(a)[1:-1] for a in letters), error.end


_RETRY_DELAY = 0.05
"""Delay until a postponed Ctrl-C is raised again [s]."""
_CAUGHT = {signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT}
_TERMINAL_SIGNALS = (signal.SIGTTIN, signal.SIGTTOU)
"""Signals that halt a process in the background when it reads or writes; if ignored, the call itself fails."""
_NOT_NOTICED = {
    *(signal.SIGKILL, signal.SIGSTOP),  # no program can catch them
    *(
        signal.SIGSEGV,
        signal.SIGBUS,
        signal.SIGFPE,
        signal.SIGILL,
        signal.SIGTRAP,
        signal.SIGSYS,
        signal.SIGABRT,
    ),
    *(signal.SIGCHLD, signal.SIGCONT, signal.SIGURG, signal.SIGWINCH),  # they end nothing
    *(signal.SIGPIPE, signal.SIGXFSZ, *_TERMINAL_SIGNALS),  # of a write, which fails by itself
}


def keep() -> None:
    """Let no Ctrl-C of this process be swallowed.

    An interrupted import turns it into another error, and an interrupted finaliser ignores it with a note: in both
    cases it is raised later.
    """
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, _raise_or_postpone)

    def hook(unraisable: Any) -> None:
        if unraisable.exc_type is KeyboardInterrupt:
            _postpone_interrupt()
        elif sys.warnoptions:  # else a finaliser's trouble is a library's, and concerns no reader
            sys.__unraisablehook__(unraisable)

    sys.unraisablehook = hook


class Noticed:
    """Signal that came within a `noticed` block; called, it returns whether one came."""

    number = 0

    def __call__(self) -> bool:
        return self.number != 0

    @property
    def reason(self) -> str | None:
        """Sentence about the signal; None if no signal came."""
        if not self.number:
            return None
        names = {int(known): known.name for known in signal.Signals} | {int(signal.SIGINT): "Ctrl-C"}
        return f"stopped by the user ({names.get(self.number, f'signal {self.number}')})"

    @property
    def code(self) -> int:
        """Exit code of a command that a signal ended, as a shell reports it: 130 for Ctrl-C, and where none came."""
        return 128 + (self.number or signal.SIGINT)

    def notice(self, number: int, _: FrameType | None) -> None:
        """Handle a signal: the first one counts."""
        self.number = self.number or number


@contextmanager
def notice_signals() -> Iterator[Noticed]:
    """Within the block no signal ends or halts this process; the yielded value returns whether one came, and which.

    For work whose results must not be lost, and which checks it regularly. Those of `_CAUGHT` are always noticed, but
    for a SIGHUP that is ignored (nohup). Of the others those are, whose default would end or halt the process. What no
    program can catch (SIGKILL, SIGSTOP), and faults of the process itself (SIGSEGV), are left.
    """
    noticed = Noticed()
    if threading.current_thread() is not threading.main_thread():  # no signal gets here
        yield noticed
        return
    before = {number: signal.getsignal(number) for number in signal.valid_signals()}
    caught = [number for number, handler in before.items() if _ends(number, handler)]
    try:
        for number in caught:
            signal.signal(number, noticed.notice)
        for number in _TERMINAL_SIGNALS:
            signal.signal(number, signal.SIG_IGN)
        yield noticed
    finally:
        for number in (*caught, *_TERMINAL_SIGNALS):
            handler = before[number]
            signal.signal(number, signal.SIG_DFL if handler is None else handler)


def _ends(number: int, handler: Any) -> bool:
    """True if a signal would end or halt this process, and can be caught."""
    if number in _CAUGHT:
        return number != signal.SIGHUP or handler != signal.SIG_IGN
    return handler == signal.SIG_DFL and number not in _NOT_NOTICED


def _raise_or_postpone(number: int, frame: FrameType | None) -> None:
    if _is_importing(frame):
        _postpone_interrupt()
    else:
        signal.default_int_handler(number, frame)


def _is_importing(frame: FrameType | None) -> bool:
    while frame is not None:
        if frame.f_code.co_filename == "<frozen importlib._bootstrap>":
            return True
        frame = frame.f_back
    return False


def _postpone_interrupt() -> None:
    main = threading.main_thread().ident
    assert main is not None
    timer = threading.Timer(_RETRY_DELAY, signal.pthread_kill, (main, signal.SIGINT))
    timer.daemon = True
    timer.start()


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
    errno.EMFILE: "allow this process more open files, as with: ulimit -n 1024",
    errno.ENFILE: "end other programs: this machine has no more open files",
    errno.EACCES: "check its permissions, or choose another place",
    errno.EPERM: "check its permissions, or choose another place",
    errno.EROFS: "choose another place",
    errno.ENOENT: "check the path",
    errno.ENOTDIR: "check the path: one of its folders is a file",
    errno.EISDIR: "name a file, not a folder",
    errno.EEXIST: "choose another name",
    errno.EBADF: "standard output is closed: redirect it, as with: > FILE",
}


def run_guarded(command: Callable[[], Any]) -> int:
    """Run a command and return its exit code; exceptions are reported on standard error.

    An error that the user can correct is one line: the fault, the place, and the remedy.
    A defect of palpate keeps its traceback, for the report.
    """
    try:
        code = command()
        flush(sys.stdout)
    except BaseException as error:  # noqa: BLE001 - the last one out: exits and interrupts are codes too
        return _settle(_exit_code(error))
    return _settle(DONE if code is None else int(code))


def _settle(code: int) -> int:
    """The code, after the streams are flushed, so that Python's own flush at exit cannot fail."""
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError):
            flush(stream)
    return code


def _exit_code(error: BaseException) -> int:
    match error:
        case SystemExit(__context__=BrokenPipeError()):  # rich's way of saying it
            return READER_GONE
        case SystemExit() if not _own_code_fails(error):
            return error.code if isinstance(error.code, int) else DONE
        case KeyboardInterrupt():
            return _say("interrupted", INTERRUPTED)
        case BrokenPipeError():
            drop(sys.stdout)
            return READER_GONE
        case CycloptsError():
            return _say(f"{_drop_dangerous_hint(error)} {_help_hint(error)}", WRONG_INPUT)
        case PalpateError():
            return _say(str(error), WRONG_INPUT, error.longest)
        case OSError():
            return _say(_system_line(error), WRONG_INPUT)
        case MemoryError():
            return _say(f"not enough memory for this input: {error or 'give a shorter one'}", WRONG_INPUT)
        case _:
            return _report_defect(error)


def _report_defect(error: BaseException) -> int:
    """Print the traceback of a defect; what the user's own code raises beside Exceptions is one line."""
    if _own_code_fails(error):
        from palpate.plugins import reason

        return _say(f"{reason(error)}; let your code raise an Exception, or end by itself", WRONG_INPUT)
    with suppress(OSError):
        sys.stderr.write(printable("".join(traceback.format_exception(error))))
    return _say("this is a defect of palpate; please report the lines above", DEFECT)


def _own_code_fails(error: BaseException) -> bool:
    """True for an exit, or another error beside Exceptions, that the user's own code raised."""
    from palpate.plugins import where_it_fails

    return not isinstance(error, Exception) and where_it_fails(error) != ""


def _say(text: str, code: int, longest: int = LONGEST) -> int:
    line = printable(shorten(" ".join(text.split()), longest))
    with suppress(OSError):  # standard error is full or closed: the code still tells
        print(f"palpate: {line}", file=sys.stderr)  # noqa: T201
    return code


def _drop_dangerous_hint(error: CycloptsError) -> str:
    """The error, without a suggestion of a flag that removes results or skips a question.

    A typing error must not suggest a destructive flag.
    """
    text = str(error).replace("Unused Tokens", "Words that the command does not take")
    guess = re.search(r" ?Did you mean \"?(--[\w-]+)\"?\??", text)
    if guess is None or guess[1].replace("--no-", "--") not in _DANGEROUS:
        return text
    return text.replace(guess[0], "")


def _help_hint(error: CycloptsError) -> str:
    words = ["palpate", *(error.command_chain or ()), "--help"]
    return f"(see: {' '.join(words)})"


def _system_line(error: OSError) -> str:
    where = error.filename if error.filename is not None else "standard output or a file"
    fault = error.strerror or str(error) or type(error).__name__
    remedy = _REMEDIES.get(error.errno or 0, "check the path and try again")
    return f"{where}: {fault}; {remedy}"
