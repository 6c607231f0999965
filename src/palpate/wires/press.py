"""A press over a wire, or a slide: tare in free motion, approach, `ForceLoop` or `SlidingLoop`, withdraw, rest.

The loop is driven by the arm's own readings. In each tick a reading comes through the guard, is compared with all stop
conditions, and goes through the law; its speed goes out through the guard. Whatever ends the press, the arm is told to
rest, and all that came is kept.

It lets no command out that is not finite and within the limits, and ends the press of a process that stood still.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from palpate.arrays import Array
from palpate.force import ForceLoop, SlidingLoop
from palpate.press.sequence import Troubles
from palpate.wires.at_rest import AtRest, look, with_noise_of
from palpate.wires.order import Limits, Order
from palpate.wires.outcome import Outcome, Rows, force_reached, settling_time, surface_of
from palpate.wires.protocol import (
    Command,
    EndedError,
    LostError,
    Sense,
    SilentError,
    Wire,
    triple,
    unreadable,
)
from palpate.wires.realtime import CLOCKS, Stopwatch

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


class Moment(NamedTuple):
    """A reading along the press.

    Args:
        sense: as it came.
        force: along the direction, without the bias [N].
        depth: likewise, from the start [m].
        speed: measured, since the reading before [m/s].
        missed: readings that never came, since the one before.
        age: beyond the least that was seen [s].
        since_start: by the arm's clock [s].
        since_touch: likewise [s]; None before it.
    """

    sense: Sense
    force: float
    depth: float
    speed: float
    missed: int
    age: float
    since_start: float
    since_touch: float | None


def spoiled(sense: Sense, last: Sense, rest: AtRest, theta: float) -> str | None:
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
    return None


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


_PHASES = {"free motion": 0.0, "learning": 1.0, "locked": 2.0}
_SLIDING = 3.0
_STILL = 1e-12
"""Speed that is none [m/s]."""


class SurfaceBelief(NamedTuple):
    """The surface as a law knows it.

    Args:
        phase: of the press; 0 in free motion.
        bound: K_u [N/m].
        stiffness: as the position feels it, and its standard deviation [N/m]; None before any was found.
        normal: into the surface, shape (3,).
    """

    phase: float
    bound: float
    stiffness: tuple[float, float] | None
    normal: Array


def press(
    wire: Wire,
    order: Order,
    rows: Rows,
    asked_to_stop: Callable[[], str | None],
    show: Callable[[str], None] = lambda _: None,
) -> Outcome:
    """Press as told; the arm rests when this returns or raises.

    Args:
        wire: to an arm at rest in free motion.
        order: what to do with it, from `checked`.
        rows: keeps everything.
        asked_to_stop: the reason why the user wants it to end; None while he does not.
        show: called with each sentence for the user while it presses; must not block.

    Raises:
        InputError: what `look` refuses, or the arm has another master.
    """
    try:
        wire.tare()
        rest = look(wire, order)
        order, note = with_noise_of(rest, order)
        if note is not None:
            show(note)
        kind = _Press if order.task.path is None else _Slide
        return kind(wire, order, rows, rest, asked_to_stop, show).run()
    finally:
        wire.stop()


class _Press:
    """A press under way; see `press`."""

    _did = "pressed"

    def __init__(
        self,
        wire: Wire,
        order: Order,
        rows: Rows,
        rest: AtRest,
        asked_to_stop: Callable[[], str | None],
        show: Callable[[str], None],
    ):
        self._wire, self._order, self._rows, self._rest = wire, order, rows, rest
        self._loop, self._plan = order.loop, order.task.plan
        self._tick, lag = order.loop.gains.arm.tick, order.loop.gains.theta
        self._guard = Guard(wire, order.limits, rest.position, self._tick, lag, asked_to_stop)
        self._troubles = Troubles(lag, show)
        self._watch = Stopwatch(self._tick, order.jitter, order.most)
        self._direction = np.array(order.task.direction)
        self._last, self._depth, self._commanded = rest.last, 0.0, np.zeros(3)
        self._law: ForceLoop | SlidingLoop = order.loop
        self._touched: float | None = None
        self._pressed: list[tuple[float, float]] = []
        self._stiffness: tuple[float, float] | None = None

    def run(self) -> Outcome:
        """Run the press from its start to its end."""
        self._guard.begin()
        try:
            self._hold()
            ended, ok = f"{self._did} for {self._order.task.hold:g} s", True
            self._retreat()
        except EndedError as reason:
            ended, ok = str(reason), False
        finally:
            self._wire.stop()
        return self._outcome(ended, ok)

    def _hold(self) -> None:
        """Approach, and press for as long as was asked."""
        while not self._held():
            now = self._read()
            if now.since_touch is not None:
                self._loop.desired = self._plan.desired(now.since_touch)
            self._move(now, self._velocity(now))
            self._end_if(self._troubles.lasting(self._law.trouble, now.since_start))

    def _velocity(self, now: Moment) -> Array:
        """That the law asks of the tool [m/s], shape (3,)."""
        speed = self._loop.update(now.force, now.depth, float(now.missed))
        with np.errstate(invalid="ignore"):  # of an infinite speed, which the guard refuses
            return speed * self._direction

    def _known(self) -> SurfaceBelief:
        """The surface as the law knows it."""
        loop, found = self._loop, self._loop.estimate
        bound = loop.gains.seen_cap if found is None else found.bound
        stiffness = None if found is None else (found.stiffness, found.stiffness_std)
        return SurfaceBelief(_PHASES[loop.phase], bound, stiffness, self._direction)

    def _retreat(self) -> None:
        """Go back from the surface: the tip, or the command of a servo, which its tip follows later."""
        back = self._depth - self._order.task.retreat
        servo = self._loop.gains.arm.kind == "servo"
        # At half the limit: a pose that a network delays shows the way of two or three ticks as that of one.
        speed = min(0.5 * self._order.limits.speed, 10.0 * self._loop.gains.approach)
        while (
            self._order.task.retreat and (self._commanded @ self._direction if servo else self._depth) > back
        ):
            self._move(self._read(), -speed * self._direction)

    def _held(self) -> bool:
        return self._touched is not None and self._last.stamp - self._touched >= self._order.task.hold

    def _read(self) -> Moment:
        """The next reading, within all limits."""
        sense = self._guard.read()
        self._end_if(spoiled(sense, self._last, self._rest, self._loop.gains.theta))
        now = self._moment(sense)
        self._depth, self._last = now.depth, sense
        self._end_if(reason_to_stop(now, self._order, self._rest))
        return now

    def _end_if(self, reason: str | None) -> None:
        if reason is not None:
            raise EndedError(reason)

    def _moment(self, sense: Sense) -> Moment:
        ticks = (sense.stamp - self._last.stamp) / self._tick
        depth = float((np.array(sense.position) - self._rest.position) @ self._direction)
        return Moment(
            sense=sense,
            force=float((np.array(sense.force) - self._rest.bias) @ self._direction),
            depth=depth,
            speed=math.dist(sense.position, self._last.position) / max(ticks, 1.0) / self._tick,
            missed=max(round(ticks) - 1, 0),
            age=self._watch.age(sense.stamp, time.monotonic()),
            since_start=sense.stamp - self._rest.last.stamp,
            since_touch=None if self._touched is None else sense.stamp - self._touched,
        )

    def _move(self, now: Moment, wanted: Array) -> None:
        """Command a velocity [m/s], within the limit, and keep the row.

        A speed that the arm cannot have, or that is no number, is a fault of the law: the guard refuses it as it is.
        """
        size, velocity = float(np.linalg.norm(wanted)), wanted
        if size <= self._loop.gains.arm.limits.speed:
            velocity = wanted * min(1.0, self._order.limits.speed / max(size, _STILL))
        self._commanded = self._commanded + self._tick * velocity
        self._guard.write(Command(triple(velocity), triple(self._rest.position + self._commanded)))
        self._watch.done(now.sense.stamp, time.monotonic(), now.missed)
        self._keep(now, velocity)

    def _keep(self, now: Moment, velocity: Array) -> None:
        known, sense = self._known(), now.sense
        self._stiffness = known.stiffness or self._stiffness
        if self._touched is None and known.phase:
            self._touched = sense.stamp
        if self._touched is not None and not self._held():
            force = float((np.array(sense.force) - self._rest.bias) @ known.normal)
            self._pressed.append((sense.stamp - self._touched, force))
        self._rows.add(
            sense.stamp, sense.received, now.depth, now.force, float(velocity @ self._direction),
            float(self._commanded @ self._direction), known.bound, known.phase, float(now.missed),
            *sense.force, *sense.torque, *sense.position, *sense.quaternion,
        )  # fmt: skip
        self._end_if("there is no room for more readings" if self._rows.full else None)

    def _outcome(self, ended: str, ok: bool) -> Outcome:
        times, forces = np.array(self._pressed).reshape(-1, 2).T
        return Outcome(
            ended=ended,
            ok=ok,
            touched=self._touched is not None,
            force=force_reached(times, forces) if ok else None,
            settled=settling_time(times, forces, self._order) if ok else None,
            stiffness=self._stiffness,
            surface=surface_of(self._law) if isinstance(self._law, SlidingLoop) else None,
            lateness=self._watch.summary(),
            rest=self._rest,
            troubles=self._troubles.ticks,
        )


class _Slide(_Press):
    """A slide under way: time counts from where the force is held, and the tip begins to slide."""

    _did = "slid"

    def __init__(self, *given: Any):
        super().__init__(*given)
        self._law = self._sliding = SlidingLoop(self._loop.gains, self._direction)
        self._sliding.desired = self._order.task.force
        assert self._order.task.path is not None
        self._ways = self._order.task.path.directions(self._loop.gains, self._direction)

    def _velocity(self, now: Moment) -> Array:
        tick = 0 if now.since_touch is None else round(now.since_touch / self._tick)
        force, place = (np.array(now.sense.force) - self._rest.bias, np.array(now.sense.position))
        way = self._ways[min(tick, len(self._ways) - 1)]
        return self._sliding.update(force, place, way, float(now.missed))

    def _known(self) -> SurfaceBelief:
        law, K = self._sliding, self._sliding.stiffness
        stiffness = None if K is None else (float(K), K.std)
        return SurfaceBelief(_SLIDING * law.sliding, law.bound, stiffness, law.normal)
