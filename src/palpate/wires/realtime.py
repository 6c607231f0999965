"""Priority for a loop or a simulated controller, where the system gives one, and a word where it does not."""

from __future__ import annotations

import gc
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

_PRIORITY = 40
_BOTH = 3  # MCL_CURRENT | MCL_FUTURE


@contextmanager
def hurried(wanted: bool) -> Iterator[str]:
    """Within the block this process goes before others, stays in memory and collects no garbage; yields what was given.

    Args:
        wanted: otherwise only the garbage waits.
    """
    gc.collect()
    gc.disable()
    # Memory first: to lock it takes up to a second, in which an equal priority would let nobody else run.
    locked, fifo = (_locked(), _fifo()) if wanted else (False, False)
    try:
        yield _told(wanted, fifo, locked)
    finally:
        if fifo:
            schedule(os.getpid(), os.SCHED_OTHER, 0)
        if locked:
            _libc().munlockall()
        gc.enable()


def _told(wanted: bool, fifo: bool, locked: bool) -> str:
    if not wanted:
        return "ordinary priority, as asked"
    if fifo and locked:
        return f"real-time priority {_PRIORITY} (SCHED_FIFO), memory locked"
    lacking = [word for word, given in (("real-time priority", fifo), ("locked memory", locked)) if not given]
    return (
        f"the system gives no {' and no '.join(lacking)}: the loop may be late; allow rtprio and memlock in"
        " /etc/security/limits.conf"
    )


def schedule(process: int, policy: int, priority: int) -> None:
    """Give a policy and a priority to all threads of a process: makers' libraries receive in threads of their own.

    Raises:
        OSError: the system does not give it.
    """
    for thread in Path(f"/proc/{process}/task").iterdir():
        with suppress(ProcessLookupError):  # it has ended meanwhile
            os.sched_setscheduler(int(thread.name), policy, os.sched_param(priority))


def _fifo() -> bool:
    try:
        schedule(os.getpid(), os.SCHED_FIFO, _PRIORITY)
    except (OSError, AttributeError):
        return False
    return True


def _locked() -> bool:
    try:
        return bool(_libc().mlockall(_BOTH) == 0)
    except (OSError, AttributeError):
        return False


def _libc() -> Any:
    import ctypes

    return ctypes.CDLL(None, use_errno=True)
