"""Guard and stop conditions of a press over a wire: two stages that look at each tick, and know nothing of each other.

The guard lets no command out that is not finite and within the limits, and ends the press of a process that stood
still. The stop conditions compare each reading with the limits.
"""

import math
import time
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from palpate.arrays import Array
from palpate.wires import ArmReading, Command, EndedError, LostError, SilentError, Wire, unreadable
from palpate_wires.at_rest import AtRest, out_of_step
from palpate_wires.order import Order, PressLimits
from palpate_wires.realtime import CLOCKS

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
        limits: PressLimits,
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

    def read(self) -> ArmReading:
        """The next reading; between two looks at the user's wish there is a tick at most.

        Raises:
            EndedError: no reading for the lag, the user's wish, a halt of this process.
        """
        end = _now() + self._lag
        while True:
            sense, lost = self._wait()
            self._check_halt()
            end_if(self._asked_to_stop())
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
        end_if(unsafe(command, self._limits, self._start))
        self._wire.write(command)
        self._check_halt()

    def stop(self) -> None:
        """Bring the arm to rest."""
        self._wire.stop()

    def _wait(self) -> tuple[ArmReading | None, LostError | None]:
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


def end_if(reason: str | None) -> None:
    """End the press if there is a reason.

    Raises:
        EndedError: with that reason.
    """
    if reason is not None:
        raise EndedError(reason)


def unsafe(command: Command, limits: PressLimits, start: Array) -> str | None:
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


class Moment(NamedTuple):
    """A reading along the press.

    Args:
        sense: as it came.
        force: along the direction, without the bias [N].
        depth: likewise, from the start [m].
        speed: measured, from the position before to this one, by their own stamps [m/s].
        missed: readings that never came, since the one before.
        age: beyond the least that was seen [s].
        since_start: by the arm's clock [s].
        since_touch: likewise [s]; None before it.
    """

    sense: ArmReading
    force: float
    depth: float
    speed: float
    missed: int
    age: float
    since_start: float
    since_touch: float | None


def fault_of(sense: ArmReading, last: ArmReading, rest: AtRest, theta: float) -> str | None:
    """Why a reading is none, in words; None if it is one.

    Args:
        sense: as it came.
        last: the one before.
        rest: the arm before the press, by whose readings the two clocks are compared.
        theta: the loop's lag [s]: no reading that counts is later than that, so that none catches up by more.
    """
    reason = unreadable(sense)
    if reason is not None:
        return reason
    if not sense.stamp > last.stamp:
        return f"the arm's clock went back, from {last.stamp:.6g} to {sense.stamp:.6g} s; has its controller restarted?"
    apart = CLOCKS * (sense.received - rest.last.received)
    ahead = rest.offset - (sense.received - sense.stamp) - apart
    if ahead > theta:
        return (
            f"the arm's clock is {ahead:.3g} s ahead of this computer's since the arm was at rest; does it run too"
            " fast, has it been set, or do two arms speak?"
        )
    return out_of_step(sense, theta)


def reason_to_stop(now: Moment, order: Order, rest: AtRest) -> str | None:
    """The first limit that is passed, in words; None if none is."""
    reasons = (_time(now, order), _force(now, order, rest), _place(now, order, rest), _speed(now, order))
    return next((reason for reason in reasons if reason is not None), _age(now, order))


def _time(now: Moment, order: Order) -> str | None:
    if now.since_start <= order.limits.seconds:
        return None
    what = "" if now.since_touch is not None else ", and nothing was touched"
    return f"the time limit of {order.limits.seconds:g} s is over{what}"


def _force(now: Moment, order: Order, rest: AtRest) -> str | None:
    largest = float(np.abs(np.array(now.sense.force) - rest.bias).max())
    if not largest <= order.limits.force:
        return f"the force is {largest:.3g} N, above the limit of {order.limits.force:g} N"
    if now.force < -max(order.task.force, 8.0 * rest.noise) / 2.0:
        return f"the force is {now.force:.3g} N against the press: is its sign, or --normal, right?"
    return None


def _place(now: Moment, order: Order, rest: AtRest) -> str | None:
    travel = order.limits.travel
    if not abs(now.depth) <= travel:
        return f"the tool is {1e3 * now.depth:.3g} mm from the start, beyond the limit of {1e3 * travel:g} mm"
    aside = np.array(now.sense.position) - rest.position - now.depth * np.array(order.task.direction)
    if not float(np.linalg.norm(aside)) <= travel:
        return "the tool left the line of the press by more than the limit of travel"
    return None


def _speed(now: Moment, order: Order) -> str | None:
    # A quantised position shows speeds that are none from tick to tick: twice the limit over one tick is let pass.
    if abs(now.speed) <= 2.0 * order.limits.speed + 2e-5 / order.loop.gains.arm.tick:
        return None
    return f"the tool moves at {1e3 * now.speed:.3g} mm/s, above the limit of {1e3 * order.limits.speed:g}"


def _age(now: Moment, order: Order) -> str | None:
    theta = order.loop.gains.theta
    if now.age <= theta:
        return None
    return f"a reading came {1e3 * now.age:.3g} ms late, more than the loop's lag of {1e3 * theta:.3g} ms"
