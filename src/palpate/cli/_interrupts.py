"""Ctrl-C is never lost: if Python or a library swallows it, it is raised again a moment later."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

_AGAIN = 0.05
"""Delay until it is raised again [s]."""


def keep() -> None:
    """Let no Ctrl-C of this process be swallowed.

    An interrupted import turns it into another error, and an interrupted finaliser ignores it with a note: in both
    cases it is raised later.
    """
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, _raise_or_put_off)
    told = sys.unraisablehook

    def hook(unraisable: Any) -> None:
        if unraisable.exc_type is KeyboardInterrupt:
            _put_off()
        else:
            told(unraisable)

    sys.unraisablehook = hook


@contextmanager
def noticed() -> Iterator[Callable[[], bool]]:
    """Within the block a Ctrl-C raises nothing; the yielded function returns whether one came.

    For work whose results must not be lost, and which checks the flag regularly.
    """
    came = threading.Event()
    if threading.current_thread() is not threading.main_thread():  # no signal gets here
        yield came.is_set
        return
    before = signal.signal(signal.SIGINT, lambda *_: came.set())
    try:
        yield came.is_set
    finally:
        signal.signal(signal.SIGINT, signal.SIG_DFL if before is None else before)


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
