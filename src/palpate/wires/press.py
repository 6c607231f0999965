"""A press over a wire: tare in the air, approach and press with `ForceLoop`, withdraw, rest; stop at any limit.

The loop is driven by the arm's own readings. In each tick a reading comes through the guard, is compared with all stop
conditions, and goes through the law; its speed goes out through the guard. Whatever ends the press, the arm is told to
rest, and all that came is kept.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from palpate.press.troubles import Troubles
from palpate.wires.at_rest import AtRest, look, with_noise_of
from palpate.wires.guard import Guard
from palpate.wires.lateness import Stopwatch
from palpate.wires.order import Order
from palpate.wires.outcome import Outcome, force_reached, settling_time
from palpate.wires.protocol import Command, EndedError, Sense, Wire, triple
from palpate.wires.recording import Rows
from palpate.wires.stop_conditions import Moment, reason_to_stop, spoiled

_PHASES = {"air": 0.0, "learning": 1.0, "locked": 2.0}


def press(
    wire: Wire,
    order: Order,
    rows: Rows,
    asked_to_stop: Callable[[], str | None],
    show: Callable[[str], None] = lambda _: None,
) -> Outcome:
    """Press as told; the arm rests when this returns or raises.

    Args:
        wire: to an arm at rest in the air.
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
        under_way = _Press(wire, order, rows, rest, asked_to_stop, show)
        return under_way.run()
    finally:
        wire.stop()


class _Press:
    """A press under way; see `press`."""

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
        self._last, self._depth, self._commanded = rest.last, 0.0, 0.0
        self._touched: float | None = None
        self._pressed: list[tuple[float, float]] = []
        self._stiffness: tuple[float, float] | None = None

    def run(self) -> Outcome:
        """All of it."""
        self._guard.begin()
        try:
            self._hold()
            ended, ok = f"pressed for {self._order.task.hold:g} s", True
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
            self._move(now, self._loop.update(now.force, now.depth, float(now.missed)))
            self._end_if(self._troubles.lasting(self._loop.trouble, now.since_start))

    def _retreat(self) -> None:
        """Go back from the surface."""
        back = self._depth - self._order.task.retreat
        # At half the limit: a pose that a network delays shows the way of two or three ticks as that of one.
        speed = min(0.5 * self._order.limits.speed, 10.0 * self._loop.gains.approach)
        while self._order.task.retreat and self._depth > back:
            self._move(self._read(), -speed)

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
            speed=(depth - self._depth) / max(ticks, 1.0) / self._tick,
            missed=max(round(ticks) - 1, 0),
            age=self._watch.age(sense.stamp, time.monotonic()),
            since_start=sense.stamp - self._rest.last.stamp,
            since_touch=None if self._touched is None else sense.stamp - self._touched,
        )

    def _move(self, now: Moment, wanted: float) -> None:
        """Command a speed along the direction [m/s], within the limit, and keep the row.

        A speed that the arm cannot have, or that is no number, is a fault of the law: the guard refuses it as it is.
        """
        most, speed = self._order.limits.speed, wanted
        if abs(wanted) <= self._loop.gains.arm.limits.speed:
            speed = min(max(wanted, -most), most)
        self._commanded += self._tick * speed
        way = self._order.task.direction  # plain numbers: the guard names those that are none
        place = [p + self._commanded * w for p, w in zip(self._rest.position, way, strict=True)]
        self._guard.write(Command(triple([speed * w for w in way]), triple(place)))
        self._watch.done(now.sense.stamp, time.monotonic(), now.missed)
        self._keep(now, speed)

    def _keep(self, now: Moment, speed: float) -> None:
        loop, sense = self._loop, now.sense
        found = loop.estimate
        if found is not None:
            self._stiffness = (found.stiffness, found.stiffness_std)
        if self._touched is None and loop.phase != "air":
            self._touched = sense.stamp
        if self._touched is not None and not self._held():
            self._pressed.append((sense.stamp - self._touched, now.force))
        self._rows.add(
            sense.stamp, sense.received, now.depth, now.force, speed, self._commanded,
            found.bound if found is not None else loop.gains.seen_cap, _PHASES[loop.phase], float(now.missed),
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
            lateness=self._watch.summary(),
            rest=self._rest,
            troubles=self._troubles.ticks,
        )
