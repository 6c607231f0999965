"""Guard and stop conditions of a press over a wire: two stages that look at each tick, and know nothing of each other.

The guard lets no command out that is not finite and within the limits, and ends the press of a process that stood
still. The stop conditions compare each reading with the limits.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from palpate.arrays import Array
from palpate.errors import PalpateError
from palpate.wires.at_rest import AtRest, position_lag_fault
from palpate.wires.order import Order, PressLimits
from palpate.wires.realtime import CLOCK, MAX_CLOCK_DRIFT, Clock
from palpate.wires.wire import (
    ArmReading,
    Command,
    ConnectionLostError,
    NoReadingError,
    PressEndedError,
    WatchdogStopError,
    Wire,
    unreadable,
)

_ROUNDING = 1e-9
"""Relative rounding error of a speed that is made of three components."""


class Guard:
    """Between a press and its wire.

    Args:
        wire: to the arm.
        limits: of the press.
        start: position of the tool before the press [m], shape (3,).
        tick: of the arm [s].
        lag: of the loop [s]: without a reading for so long, or after a halt of this process for so long, it ends.
        asked_to_stop: the reason why the user wants an end; None while he does not.
        clock: by which silence and halts are measured.
    """

    def __init__(
        self,
        wire: Wire,
        limits: PressLimits,
        start: Array,
        tick: float,
        lag: float,
        asked_to_stop: Callable[[], str | None],
        clock: Clock = CLOCK,
    ):
        self._wire, self._limits, self._start = wire, limits, start
        self._tick, self._lag, self._asked_to_stop = tick, lag, asked_to_stop
        self._now, self._sleep = clock.since_boot, clock.sleep
        self._seen = self._now()

    def begin(self) -> None:
        """Take the arm over."""
        self._wire.begin(self._lag)
        self._seen = self._now()

    def read(self) -> ArmReading:
        """The next reading; between two looks at the user's wish there is a tick at most.

        Raises:
            PressEndedError: no reading for the lag, the user's wish, a halt of this process.
        """
        end = self._now() + self._lag
        while True:
            sense, lost = self._wait()
            self._check_halt()
            end_if(self._asked_to_stop())
            if sense is not None:
                return sense
            if isinstance(lost, NoReadingError) and self._now() >= end:
                raise NoReadingError(lost.source, self._lag, lost.seen)
            if lost is not None and not isinstance(lost, NoReadingError):
                raise lost

    def write(self, command: Command) -> None:
        """Send a command.

        Raises:
            PressEndedError: it is not finite and within the limits, this process stood still, or it could not be sent.
        """
        self._check_halt()
        end_if(command_fault(command, self._limits, self._start))
        self._wire.write(command)
        self._check_halt()

    def glimpse(self) -> ArmReading | None:
        """The reading of this tick while the arm retreats, which no wish and no halt ends; None if there is none."""
        start = self._now()
        sense, lost = self._wait()
        self._seen = self._now()
        if lost is not None and not isinstance(lost, NoReadingError):  # said at once: the tick goes on
            self._sleep(max(self._tick - (self._seen - start), 0.0))
        return sense

    def retreat(self, command: Command, into: Array) -> str | None:
        """Send a command that leads out of the surface, or rests; the reason if it did not go out.

        Limits of force, travel and time do not hold it back. An arm whose own watchdog has stopped it, as this process
        was late or stood still, is taken over again while it gives readings.

        Args:
            command: as it is to go out.
            into: direction into the surface, of unit length, shape (3,).
        """
        reason = retreat_fault(command, self._limits, into)
        if reason is not None:
            return reason
        try:
            try:
                self._wire.write(command)
            except WatchdogStopError:
                self._wire.read(self._lag)
                self._wire.begin(self._lag)
                self._wire.write(command)
        except PalpateError as error:
            reason = str(error)
        self._seen = self._now()
        return reason

    def stop(self) -> None:
        """Bring the arm to rest."""
        self._wire.stop()

    def _wait(self) -> tuple[ArmReading | None, ConnectionLostError | None]:
        """A reading of this tick, or the error."""
        try:
            return self._wire.read(self._tick), None
        except ConnectionLostError as lost:
            return None, lost

    def _check_halt(self) -> None:
        """Refuse to go on after a halt: between two looks at the clock is a tick of waiting and the loop's work."""
        before, self._seen = self._seen, self._now()
        halt = self._seen - before
        if halt > self._lag:
            longer = f"longer than the loop's lag of {1e3 * self._lag:.3g} ms"
            raise PressEndedError(f"this process stood still for {halt:.3g} s, {longer}")


def end_if(reason: str | None) -> None:
    """End the press if there is a reason.

    Raises:
        PressEndedError: with that reason.
    """
    if reason is not None:
        raise PressEndedError(reason)


def command_fault(command: Command, limits: PressLimits, start: Array) -> str | None:
    """Reason why a command must not go out; None if it may.

    Args:
        command: as it would go out.
        limits: of the press.
        start: position of the tool before the press [m], shape (3,).
    """
    speed, distance = math.hypot(*command.velocity), math.dist(command.position, start)
    if not speed <= limits.speed * (1.0 + _ROUNDING):
        excess, limit = f"of {1e3 * speed:.3g} mm/s", f"{1e3 * limits.speed:g} mm/s"
    elif not distance <= limits.travel:
        excess, limit = f"to {1e3 * distance:.4g} mm from the start", f"{1e3 * limits.travel:.4g} mm"
    else:
        return None
    return f"a command {excess} was not sent: it is beyond the limit of {limit}"


def retreat_fault(command: Command, limits: PressLimits, into: Array) -> str | None:
    """Reason why a command must not go out in a retreat; None if it leads out of the surface, or rests.

    Args:
        command: as it would go out.
        limits: of the press; that of speed holds for its retreat.
        into: direction into the surface, of unit length, shape (3,).
    """
    speed, inwards = math.hypot(*command.velocity), float(np.array(command.velocity) @ into)
    outwards = inwards <= -speed * (1.0 - _ROUNDING) and speed <= limits.speed * (1.0 + _ROUNDING)
    if outwards and all(map(math.isfinite, command.position)):
        return None
    return f"a retreat of {1e3 * speed:.3g} mm/s, {1e3 * inwards:.3g} into the surface, was not sent"


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
    """

    sense: ArmReading
    force: float
    depth: float
    speed: float
    missed: int
    age: float
    since_start: float


def reading_fault(sense: ArmReading, last: ArmReading, rest: AtRest, theta: float) -> str | None:
    """Reason why a reading is invalid; None if it is valid.

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
    apart = MAX_CLOCK_DRIFT * (sense.received - rest.last.received)
    ahead = rest.offset - (sense.received - sense.stamp) - apart
    if ahead > theta:
        return (
            f"the arm's clock is {ahead:.3g} s ahead of this computer's since the arm was at rest; does it run too"
            " fast, has it been set, or do two arms speak?"
        )
    return position_lag_fault(sense, theta)


def reason_to_stop(now: Moment, order: Order, rest: AtRest) -> str | None:
    """The first passed limit, in words; None if no limit is passed."""
    reasons = (_time(now, order), _force(now, order, rest), _place(now, order, rest), _speed(now, order))
    return next((reason for reason in reasons if reason is not None), _age(now, order))


def _time(now: Moment, order: Order) -> str | None:
    if now.since_start <= order.limits.seconds:
        return None
    return f"the time limit of {order.limits.seconds:g} s is over"


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
    deviation = np.array(now.sense.position) - rest.position - now.depth * np.array(order.task.direction)
    if not float(np.linalg.norm(deviation)) <= travel:
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
