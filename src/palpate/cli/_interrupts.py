"""No signal is lost: a Ctrl-C that a library swallows is raised again, and long work notices all that would end it."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

_AGAIN = 0.05
"""Delay until it is raised again [s]."""
_CAUGHT = {signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT}
_OF_TERMINALS = (signal.SIGTTIN, signal.SIGTTOU)
"""Would halt a process in the background that reads or writes; ignored, the call itself fails or succeeds."""
_LEFT = {
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
    *(signal.SIGPIPE, signal.SIGXFSZ, *_OF_TERMINALS),  # of a write, which fails by itself
}


def keep() -> None:
    """Let no Ctrl-C of this process be swallowed.

    An interrupted import turns it into another error, and an interrupted finaliser ignores it with a note: in both
    cases it is raised later.
    """
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, _raise_or_put_off)

    def hook(unraisable: Any) -> None:
        if unraisable.exc_type is KeyboardInterrupt:
            _put_off()
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
        """Its sentence; None if no signal came."""
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
def noticed() -> Iterator[Noticed]:
    """Within the block no signal ends or halts this process; the yielded value returns whether one came, and which.

    For work whose results must not be lost, and which checks it regularly. Those of `_CAUGHT` are always noticed, but
    for a SIGHUP that is ignored (nohup). Of the others those are, whose default would end or halt the process. What no
    program can catch (SIGKILL, SIGSTOP), and faults of the process itself (SIGSEGV), are left.
    """
    came = Noticed()
    if threading.current_thread() is not threading.main_thread():  # no signal gets here
        yield came
        return
    before = {number: signal.getsignal(number) for number in signal.valid_signals()}
    caught = [number for number, handler in before.items() if _ends(number, handler)]
    try:
        for number in caught:
            signal.signal(number, came.notice)
        for number in _OF_TERMINALS:
            signal.signal(number, signal.SIG_IGN)
        yield came
    finally:
        for number in (*caught, *_OF_TERMINALS):
            handler = before[number]
            signal.signal(number, signal.SIG_DFL if handler is None else handler)


def _ends(number: int, handler: Any) -> bool:
    """Whether a signal would end or halt this process, and can be caught."""
    if number in _CAUGHT:
        return number != signal.SIGHUP or handler != signal.SIG_IGN
    return handler == signal.SIG_DFL and number not in _LEFT


def _raise_or_put_off(number: int, frame: FrameType | None) -> None:
    if _importing(frame):
        _put_off()
    else:
        signal.default_int_handler(number, frame)


def _importing(frame: FrameType | None) -> bool:
    while frame is not None:
        if frame.f_code.co_filename == "<frozen importlib._bootstrap>":
            return True
        frame = frame.f_back
    return False


def _put_off() -> None:
    main = threading.main_thread().ident
    assert main is not None
    timer = threading.Timer(_AGAIN, signal.pthread_kill, (main, signal.SIGINT))
    timer.daemon = True
    timer.start()
