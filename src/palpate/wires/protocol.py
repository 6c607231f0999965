"""Interface of a wire to an arm: one reading at a time, one command at a time, and rest."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple, Protocol

from palpate.errors import PalpateError

Triple = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]


def triple(vector: Sequence[float] | Any) -> Triple:
    """Three numbers of an array as plain floats."""
    x, y, z = vector
    return float(x), float(y), float(z)


class Sense(NamedTuple):
    """One reading of an arm.

    Args:
        received: when it came, by `time.monotonic` [s].
        stamp: when it was taken, by the arm's own clock [s].
        force: that the tool exerts on the surface, in the base's axes [N].
        torque: likewise, about the point that `position` is of [N m].
        position: of the tool in the base [m].
        quaternion: of the tool in the base, x, y, z, w.
    """

    received: float
    stamp: float
    force: Triple
    torque: Triple
    position: Triple
    quaternion: Quaternion


class Command(NamedTuple):
    """One command: a wire takes the speed or the position, as its arm does.

    Args:
        velocity: of the tool in the base [m/s]; it does not turn.
        position: that this speed has led to, from where the tool was at the start [m].
    """

    velocity: Triple
    position: Triple


class LostError(PalpateError):
    """The wire gave no reading, or took no command; the text says what was seen."""


class Wire(Protocol):
    """A wire to an arm that is switched on and at rest.

    A wire is opened by its constructor or by `open_wire`, which refuse an address that does not answer with an
    InputError. Whoever opened it closes it. Nothing moves before the first `write`.
    """

    @property
    def title(self) -> str:
        """Its far end, in words."""
        ...

    @property
    def watchdog(self) -> str:
        """The arm's own stop if this process dies, in words."""
        ...

    def read(self, timeout: float) -> Sense:
        """The next fresh reading.

        Args:
            timeout: for how long to wait [s].

        Raises:
            LostError: none came, or what came was no reading.
        """
        ...

    def tare(self) -> None:
        """Let the arm's driver take its sensor's present reading for zero, if it can; the arm is in the air."""
        ...

    def begin(self) -> None:
        """Take the arm over: from here on commands move it.

        Raises:
            InputError: another master has it, or it may not be moved.
        """
        ...

    def write(self, command: Command) -> None:
        """Send a command.

        Raises:
            LostError: it could not be sent.
        """
        ...

    def stop(self) -> None:
        """Bring the arm to rest and let go of it; never raises, and may be called again."""
        ...

    def close(self) -> None:
        """Let go of the wire; never raises."""
        ...
