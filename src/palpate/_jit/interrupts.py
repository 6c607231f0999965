"""Ctrl-C waits until a compiled call has come back."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

_Call = tuple[int, FrameType | None]


@contextmanager
def interrupts_later() -> Iterator[None]:
    """Keep a Ctrl-C back until the block is done, then hand it to who would have had it.

    Numba makes a kernel's result by calling the classes of its NamedTuples, where Python would raise KeyboardInterrupt;
    Numba does not look whether they raised, and the process ends with a segmentation fault.
    """
    if threading.current_thread() is not threading.main_thread():  # no signal gets here
        yield
        return
    held: list[_Call] = []
    before = signal.signal(signal.SIGINT, lambda *call: held.append(call))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.SIG_DFL if before is None else before)
    if held and callable(before):
        before(*held[-1])
