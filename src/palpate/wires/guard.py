"""The last check on the wire's side, which knows neither the law nor the plan of the press.

It lets no command out that is not finite and within the limits, and ends the press of a process that stood still.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable

from palpate.arrays import Array
from palpate.wires.order import Limits
from palpate.wires.protocol import Command, EndedError, LostError, Sense, SilentError, Wire

_ROUNDING = 1e-9
"""Relative, of a speed that is made of three components."""


def _now() -> float:
    """Seconds that go on while the computer sleeps, where the system counts them."""
    return time.clock_gettime(time.CLOCK_BOOTTIME) if hasattr(time, "CLOCK_BOOTTIME") else time.monotonic()


class Guard:
    """Between a press and its wire.

    Args:
        wire: to the arm.
        limits: of the press.
        start: position of the tool before the press [m], shape (3,).
        tick: of the arm [s].
        lag: of the loop [s]: without a reading for so long, or after a halt of this process for so long, it ends.
        asked_to_stop: the reason why the user wants an end; None while he does not.
    """

    def __init__(
        self,
        wire: Wire,
        limits: Limits,
        start: Array,
        tick: float,
        lag: float,
        asked_to_stop: Callable[[], str | None],
    ):
        self._wire, self._limits, self._start = wire, limits, start
        self._tick, self._lag, self._asked_to_stop = tick, lag, asked_to_stop
        self._seen = _now()

    def begin(self) -> None:
        """Take the arm over."""
        self._wire.begin(self._lag)
        self._seen = _now()

    def read(self) -> Sense:
        """The next reading; between two looks at the user's wish there is a tick at most.

        Raises:
            EndedError: no reading for the lag, the user's wish, a halt of this process.
        """
        end = _now() + self._lag
        while True:
            sense, lost = self._wait()
            self._check_halt()
            self._end_if(self._asked_to_stop())
            if sense is not None:
                return sense
            if isinstance(lost, SilentError) and _now() >= end:
                raise SilentError(lost.source, self._lag, lost.seen)
            if lost is not None and not isinstance(lost, SilentError):
                raise lost

    def write(self, command: Command) -> None:
        """Send a command.

        Raises:
            EndedError: it is not finite and within the limits, this process stood still, or it could not be sent.
        """
        self._check_halt()
        self._end_if(unsafe(command, self._limits, self._start))
        self._wire.write(command)
        self._check_halt()

    def _wait(self) -> tuple[Sense | None, LostError | None]:
        """A reading of this tick, or what is wrong."""
        try:
            return self._wire.read(self._tick), None
        except LostError as lost:
            return None, lost

    def _check_halt(self) -> None:
        """Refuse to go on after a halt: between two looks at the clock is a tick of waiting and the loop's work."""
        before, self._seen = self._seen, _now()
        halt = self._seen - before
        if halt > self._lag:
            longer = f"longer than the loop's lag of {1e3 * self._lag:.3g} ms"
            raise EndedError(f"this process stood still for {halt:.3g} s, {longer}")

    def _end_if(self, reason: str | None) -> None:
        if reason is not None:
            raise EndedError(reason)


def unsafe(command: Command, limits: Limits, start: Array) -> str | None:
    """Why a command must not go out, in words; None if it may.

    Args:
        command: as it would go out.
        limits: of the press.
        start: position of the tool before the press [m], shape (3,).
    """
    speed, way = math.hypot(*command.velocity), math.dist(command.position, start)
    if not speed <= limits.speed * (1.0 + _ROUNDING):
        what, most = f"of {1e3 * speed:.3g} mm/s", f"{1e3 * limits.speed:g} mm/s"
    elif not way <= limits.travel:
        what, most = f"to {1e3 * way:.4g} mm from the start", f"{1e3 * limits.travel:.4g} mm"
    else:
        return None
    return f"a command {what} was not sent: it is beyond the limit of {most}"
