"""Interface of a wire to an arm: one reading at a time, one command at a time, and rest."""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple, Protocol

from palpate.errors import PalpateError

Triple = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]


def triple(vector: Sequence[float] | Any) -> Triple:
    """Three numbers of an array as plain floats."""
    x, y, z = vector
    return float(x), float(y), float(z)


class ArmReading(NamedTuple):
    """One reading of an arm.

    Args:
        received: when it came, by `time.monotonic` [s].
        stamp: when it was taken, by the arm's own clock [s].
        force: that the tool exerts on the surface, in the base's axes [N].
        torque: likewise, about the point that `position` is of [N m].
        position: of the tool in the base [m].
        quaternion: of the tool in the base, x, y, z, w.
        position_lag: by which the position was taken before `stamp`, by the same clock [s]; positive when it is late.
    """

    received: float
    stamp: float
    force: Triple
    torque: Triple
    position: Triple
    quaternion: Quaternion
    position_lag: float = 0.0


_MAX_LENGTH_ERROR = 0.01
"""Largest error of a quaternion's squared length, that of ROS 2's tf2; a force turned by it is wrong by 2 % at most."""


def unreadable(sense: ArmReading) -> str | None:
    """Reason why a reading by itself is invalid; None if it is valid."""
    numbers = (sense.stamp, sense.position_lag, *sense.force, *sense.position, *sense.quaternion)
    if not all(map(math.isfinite, numbers)):
        return "the arm gives a reading that is no number"
    size = math.hypot(*sense.quaternion)
    if not abs(size * size - 1.0) <= _MAX_LENGTH_ERROR:
        return f"the arm gives a quaternion of length {size:.3g}, which is no orientation"
    return None


class Command(NamedTuple):
    """One command: a wire takes the speed or the position, as its arm does.

    Args:
        velocity: of the tool in the base [m/s]; it does not turn.
        position: that this speed has led to, from where the tool was at the start [m].
    """

    velocity: Triple
    position: Triple


SILENCE = 0.1
"""Usual time without a command after which an arm is to stop by itself [s]."""


class PressEndedError(PalpateError):
    """The press ends, and the arm is to rest; the text says why."""


class ConnectionLostError(PressEndedError):
    """The wire gave no reading, or took no command; the text says what was seen."""


class NoReadingError(ConnectionLostError):
    """No reading came in time, and the wire may yet give one.

    Args:
        source: of the readings, as ` at /wrench`; may be empty.
        seconds: for how long none came [s].
        seen: something that came instead, in words; may be empty.
    """

    def __init__(self, source: str, seconds: float, seen: str = ""):
        super().__init__(f"no reading{source} for {1e3 * seconds:.3g} ms{seen}")
        self.source, self.seen = source, seen


class WatchdogStopError(ConnectionLostError):
    """The arm was brought to rest, as no command came for too long; `begin` takes it over again."""


class Wire(Protocol):
    """A wire to an arm that is switched on and at rest.

    A wire is opened by its constructor or by `open_wire`, which refuse an address that does not answer with an
    InputError. Whoever opened it closes it. Nothing moves before the first `write`.
    """

    @property
    def title(self) -> str:
        """Name of the arm at the far end, in words."""
        ...

    @property
    def watchdog(self) -> str:
        """The arm's own stop if this process dies, in words."""
        ...

    def read(self, timeout: float) -> ArmReading:
        """The next fresh reading.

        Args:
            timeout: for how long to wait [s].

        Raises:
            NoReadingError: none came in time.
            ConnectionLostError: none will come, or what came was no reading.
        """
        ...

    def tare(self) -> None:
        """Let the arm's driver take its sensor's present reading for zero, if it can; the arm is in free motion."""
        ...

    def begin(self, silence: float = SILENCE) -> None:
        """Take the arm over: from here on commands move it.

        Args:
            silence: without a command, after which the arm is to stop by itself, if it can [s].

        Raises:
            InputError: another master has it, or it may not be moved.
        """
        ...

    def write(self, command: Command) -> None:
        """Send a command.

        Raises:
            ConnectionLostError: it could not be sent.
        """
        ...

    def stop(self) -> None:
        """Bring the arm to rest and let go of it; never raises, and may be called again."""
        ...

    def close(self) -> None:
        """Let go of the wire; never raises."""
        ...
