"""Real-time priority of a loop, the clocks of this computer, and the lateness of readings."""

import gc
import os
import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

_PRIORITY = 40
_MCL_CURRENT_AND_FUTURE = 3  # MCL_CURRENT | MCL_FUTURE


@contextmanager
def realtime_priority(wanted: bool) -> Iterator[str]:
    """Within the block this process goes before others, stays in memory and collects no garbage; yields what was given.

    Args:
        wanted: otherwise only the garbage waits.
    """
    gc.collect()
    gc.disable()
    # Memory first: to lock it takes up to a second, in which an equal priority would let nobody else run.
    locked, fifo = (_lock_memory(), _set_fifo()) if wanted else (False, False)
    try:
        yield _describe(wanted, fifo, locked)
    finally:
        if fifo:
            schedule(os.getpid(), os.SCHED_OTHER, 0)
        if locked:
            _libc().munlockall()
        gc.enable()


@contextmanager
def defer_interrupts() -> Iterator[None]:
    """Within the block Ctrl-C and SIGTERM wait; they come when it is over."""
    if threading.current_thread() is not threading.main_thread():  # no signal gets here
        yield
        return
    signals: list[int] = []
    numbers = (signal.SIGINT, signal.SIGTERM)
    before = {number: signal.signal(number, lambda number, _: signals.append(number)) for number in numbers}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, signal.SIG_DFL if handler is None else handler)
        for late in dict.fromkeys(signals):
            signal.raise_signal(late)


def _describe(wanted: bool, fifo: bool, locked: bool) -> str:
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


def _set_fifo() -> bool:
    try:
        schedule(os.getpid(), os.SCHED_FIFO, _PRIORITY)
    except (OSError, AttributeError):
        return False
    return True


def _lock_memory() -> bool:
    try:
        return bool(_libc().mlockall(_MCL_CURRENT_AND_FUTURE) == 0)
    except (OSError, AttributeError):
        return False


def _libc() -> Any:
    import ctypes

    return ctypes.CDLL(None, use_errno=True)


class Clock(NamedTuple):
    """The clocks of this computer [s]; a press with a simulated arm may be given others.

    Args:
        monotonic: by which readings are received.
        since_boot: which goes on while the computer sleeps, where the system counts that time.
        sleep: waits for a time [s].
    """

    monotonic: Callable[[], float] = time.monotonic
    since_boot: Callable[[], float] = partial(
        time.clock_gettime, getattr(time, "CLOCK_BOOTTIME", time.CLOCK_MONOTONIC)
    )
    sleep: Callable[[float], None] = time.sleep


CLOCK = Clock()
MAX_CLOCK_DRIFT = 1e-4
"""Largest relative drift of two clocks [s/s]: twice that of quartz."""
PERCENTILES = (50.0, 99.0, 99.9)


@dataclass(frozen=True)
class Lateness:
    """Age of the readings when their command had gone out, beyond the least that was seen.

    Args:
        ticks: how many there were.
        late: at 50, 99 and 99.9 % and the most [s].
        missed: readings that never came.
        jumps: ticks whose reading was later than the certificate allows.
        allowed: by which it may be [s]; None without a certificate.
    """

    ticks: int
    late: tuple[float, float, float, float]
    missed: int
    jumps: int
    allowed: float | None

    def sentences(self) -> list[str]:
        """Warnings about lateness, as sentences."""
        a, b, c, worst = (1e3 * v for v in self.late)
        late = f"late by {a:.3g} ms (50 %), {b:.3g} (99 %), {c:.3g} (99.9 %), {worst:.3g} at most"
        lines = [f"{late}, in {self.ticks} ticks; {self.missed} readings missed"]
        if self.allowed is None:
            lines.append(
                "no certificate was given (palpate certify makes one): nothing is proved of this loop"
            )
        elif self.jumps or self.missed:
            lines.append(
                f"the certificate does not cover this run: it allows a reading to be late by"
                f" {1e3 * self.allowed:.3g} ms; {self.jumps} ticks exceeded that, {self.missed} readings were missed"
            )
        else:
            lines.append(f"within the {1e3 * self.allowed:.3g} ms of jitter that the certificate allows")
        return lines

    def to_json(self) -> dict[str, Any]:
        """The lateness as plain JSON values."""
        names = ("p50_s", "p99_s", "p99.9_s", "most_s")
        return {
            "ticks": self.ticks,
            **dict(zip(names, self.late, strict=True)),
            "missed": self.missed,
            "jumps": self.jumps,
            "allowed_s": self.allowed,
        }


class Stopwatch:
    """The age of each reading, by two clocks that nobody has set to each other.

    Args:
        tick: nominal [s].
        allowed: jitter of the certificate [s]; None without one.
        max_rows: ticks that there may be.
    """

    def __init__(self, tick: float, allowed: float | None, max_rows: int):
        self._tick, self._allowed = tick, allowed
        self._ages = np.zeros(max_rows)
        self._n, self._missed, self._jumps = 0, 0, 0
        self._offset, self._at = np.inf, 0.0

    def age(self, stamp: float, now: float) -> float:
        """Age of a reading of this stamp, beyond the smallest age so far [s]."""
        self._offset = min(self._offset + MAX_CLOCK_DRIFT * max(now - self._at, 0.0), now - stamp)
        self._at = now
        return now - stamp - self._offset

    def note_sent(self, stamp: float, now: float, missed: int) -> None:
        """The command of a reading has gone out."""
        age = self.age(stamp, now)
        if self._allowed is not None and age > self._allowed:
            self._jumps += 1
        self._missed += missed
        if self._n < len(self._ages):
            self._ages[self._n] = age
            self._n += 1

    def summary(self) -> Lateness:
        """Measured lateness, for the summary."""
        ages = self._ages[: self._n] if self._n else np.zeros(1)
        a, b, c = (float(v) for v in np.percentile(ages, PERCENTILES))
        return Lateness(self._n, (a, b, c, float(ages.max())), self._missed, self._jumps, self._allowed)
