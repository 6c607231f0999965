"""Priority for a loop or a simulated controller, where the system gives one, and a word where it does not."""

import gc
import os
import struct
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from palpate.wires import ArmReading, Command

_PRIORITY = 40
_BOTH = 3  # MCL_CURRENT | MCL_FUTURE


@contextmanager
def realtime_priority(wanted: bool) -> Iterator[str]:
    """Within the block this process goes before others, stays in memory and collects no garbage; yields what was given.

    Args:
        wanted: otherwise only the garbage waits.
    """
    gc.collect()
    gc.disable()
    # Memory first: to lock it takes up to a second, in which an equal priority would let nobody else run.
    locked, fifo = (_locked(), _fifo()) if wanted else (False, False)
    try:
        yield _describe(wanted, fifo, locked)
    finally:
        if fifo:
            schedule(os.getpid(), os.SCHED_OTHER, 0)
        if locked:
            _libc().munlockall()
        gc.enable()


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


CLOCKS = 1e-4
"""Rate at which two clocks may run apart [s/s]: twice what quartz does."""
SHARES = (50.0, 99.0, 99.9)


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
        a, b, c, most = (1e3 * v for v in self.late)
        late = f"late by {a:.3g} ms (50 %), {b:.3g} (99 %), {c:.3g} (99.9 %), {most:.3g} at most"
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
        """As plain JSON values."""
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
        most: ticks that there may be.
    """

    def __init__(self, tick: float, allowed: float | None, most: int):
        self._tick, self._allowed = tick, allowed
        self._ages = np.zeros(most)
        self._n, self._missed, self._jumps = 0, 0, 0
        self._offset, self._at = np.inf, 0.0

    def age(self, stamp: float, now: float) -> float:
        """Of a reading of this stamp, beyond the least that was seen [s]."""
        self._offset = min(self._offset + CLOCKS * max(now - self._at, 0.0), now - stamp)
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
        a, b, c = (float(v) for v in np.percentile(ages, SHARES))
        return Lateness(self._n, (a, b, c, float(ages.max())), self._missed, self._jumps, self._allowed)


STARTED, READY, STATE, FAILED, REFUSED, BEGUN, TARED, RESTED = b"arsfxbtq"
TARE, BEGIN, MOVE, REST = b"TBMR"
LARGEST = 4096

_STATE = struct.Struct("<B16d")
_MOVE = struct.Struct("<B6d")
_BEGIN = struct.Struct("<Bd")


def state(sense: ArmReading) -> bytes:
    """Message that carries a reading."""
    s = sense
    return _STATE.pack(
        STATE, s.received, s.stamp, *s.force, *s.torque, *s.position, *s.quaternion, s.position_lag
    )


def read_state(message: bytes) -> ArmReading:
    """The reading of a message of that kind."""
    _, received, stamp, *v = _STATE.unpack(message)
    return ArmReading(received, stamp, tuple(v[0:3]), tuple(v[3:6]), tuple(v[6:9]), tuple(v[9:13]), v[13])


def move(command: Command) -> bytes:
    """Message that carries a command."""
    return _MOVE.pack(MOVE, *command.velocity, *command.position)


def read_move(message: bytes) -> Command:
    """The command of a message of that kind."""
    _, a, b, c, x, y, z = _MOVE.unpack(message)
    return Command((a, b, c), (x, y, z))


def begin(silence: float) -> bytes:
    """The wish to move, and the silence after which the arm is to stop by itself [s]."""
    return _BEGIN.pack(BEGIN, silence)


def read_begin(message: bytes) -> float:
    """The silence of a message of that kind [s]."""
    return float(_BEGIN.unpack(message)[1])


def text(kind: int, words: str = "") -> bytes:
    """A word or a reason."""
    return bytes([kind]) + words.encode(errors="replace")[: LARGEST - 1]


def read_text(message: bytes) -> str:
    """The words of a message."""
    return message[1:].decode(errors="replace")
