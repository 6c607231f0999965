"""A press over a wire, or a slide: tare in free motion, approach, `ForceLoop` or `SlidingLoop`, withdraw, rest.

The sequence is that of every press, driven by the arm's own readings: each comes through the guard and is compared with
all stop conditions, and each speed goes out through the guard. Whatever ends the press, the arm is told to rest, and
all that came is kept.
"""

import math
import time
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from palpate.arrays import Array
from palpate.force import ForceLoop, SlidingLoop
from palpate.press.sequence import CautiousDriver, PressSequence, SlidingDriver, TipSample
from palpate.wires import Command, EndedError, Wire, triple
from palpate_wires.at_rest import AtRest, look, with_noise_of
from palpate_wires.guard import Guard, Moment, end_if, fault_of, reason_to_stop
from palpate_wires.order import Order
from palpate_wires.outcome import Outcome, Rows, force_reached, settling_time, surface_of
from palpate_wires.realtime import Stopwatch

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


def belief_of(loop: ForceLoop | SlidingLoop, direction: Array) -> SurfaceBelief:
    """The surface as a loop knows it; `direction` is that of the press, shape (3,)."""
    if isinstance(loop, SlidingLoop):
        K = loop.stiffness
        stiffness = None if K is None else (float(K), K.std)
        return SurfaceBelief(_SLIDING * loop.sliding, loop.bound, stiffness, loop.normal)
    estimate = loop.estimate
    bound = loop.gains.seen_cap if estimate is None else estimate.bound
    stiffness = None if estimate is None else (estimate.stiffness, estimate.stiffness_std)
    return SurfaceBelief(_PHASES[loop.phase], bound, stiffness, direction)


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
        order: what to do with it, from `check_order`.
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
        return _Press(GuardedArm(wire, order, rest, asked_to_stop), order, rows, show).run()
    finally:
        wire.stop()


class GuardedArm:
    """The arm of a sequence: its readings within the stop conditions, its commands through the guard.

    Args:
        wire: to the arm.
        order: of the press.
        rest: the arm before it.
        asked_to_stop: the reason why the user wants it to end; None while he does not.
    """

    def __init__(self, wire: Wire, order: Order, rest: AtRest, asked_to_stop: Callable[[], str | None]):
        gains = order.loop.gains
        self._order, self.rest, self._tick = order, rest, gains.arm.tick
        self.guard = Guard(wire, order.limits, rest.position, gains.arm.tick, gains.theta, asked_to_stop)
        self.watch = Stopwatch(self._tick, order.jitter, order.most)
        self._direction = np.array(order.task.direction)
        self.velocity, self.commanded = np.zeros(3), np.zeros(3)
        self.touched: float | None = None
        """Time of the touch, by the arm's clock [s]."""
        self.now = Moment(rest.last, 0.0, 0.0, 0.0, 0, 0.0, 0.0, None)

    def read(self) -> TipSample:
        """The next reading, within all limits.

        Raises:
            EndedError: none came, or a stop condition.
        """
        sense = self.guard.read()
        end_if(fault_of(sense, self.now.sense, self.rest, self._order.loop.gains.theta))
        force, position = np.array(sense.force) - self.rest.bias, np.array(sense.position)
        last = self.now.sense
        ticks = (sense.stamp - last.stamp) / self._tick
        moving = sense.stamp - sense.position_lag - (last.stamp - last.position_lag)
        self.now = Moment(
            sense=sense,
            force=float(force @ self._direction),
            depth=float((position - self.rest.position) @ self._direction),
            speed=math.dist(sense.position, last.position) / max(moving, self._tick),
            missed=max(round(ticks) - 1, 0),
            age=self.watch.age(sense.stamp, time.monotonic()),
            since_start=sense.stamp - self.rest.last.stamp,
            since_touch=None if self.touched is None else sense.stamp - self.touched,
        )
        end_if(reason_to_stop(self.now, self._order, self.rest))
        return TipSample(sense.stamp, force, position, float(self.now.missed))

    def move(self, velocity: Array, turning: Array | None = None) -> None:
        """Command a velocity [m/s], within the limit.

        A speed that the arm cannot have, or that is no number, is a fault of the law: the guard refuses it as it is.

        Raises:
            EndedError: it must not go out, or could not be sent.
        """
        size, limits = float(np.linalg.norm(velocity)), self._order.limits
        if size <= self._order.loop.gains.arm.limits.speed:
            velocity = velocity * min(1.0, limits.speed / max(size, _STILL))
        self.velocity, self.commanded = velocity, self.commanded + self._tick * velocity
        self.guard.write(Command(triple(velocity), triple(self.rest.position + self.commanded)))
        self.watch.note_sent(self.now.sense.stamp, time.monotonic(), self.now.missed)


class _Press:
    """A press or a slide under way; see `press`. The time of a slide counts from where the force is held."""

    def __init__(self, arm: GuardedArm, order: Order, rows: Rows, show: Callable[[str], None]):
        self._arm, self._order, self._rows = arm, order, rows
        task, gains = order.task, order.loop.gains
        self._direction = np.array(task.direction)
        self._driver: CautiousDriver | SlidingDriver
        if task.path is None:
            self._driver = CautiousDriver(arm, order.loop, self._direction, show)
        else:
            loop, ways = SlidingLoop(gains, self._direction), task.path.directions(gains, self._direction)
            loop.desired = task.force
            if gains.arm.kind == "servo":
                loop.limit_speed(order.limits.speed)
            rate, last = gains.arm.rate, len(ways) - 1
            self._driver = SlidingDriver(arm, loop, lambda since: ways[min(round(since * rate), last)], show)
        self._sequence = PressSequence(arm, self._driver, task.plan.force_at, gains.arm.tick)
        self._pressed: list[tuple[float, float]] = []
        self._stiffness: tuple[float, float] | None = None

    def run(self) -> Outcome:
        """Run the press from its start to its end."""
        self._arm.guard.begin()
        try:
            self._hold()
            done = "pressed" if self._order.task.path is None else "slid"
            ended, ok = f"{done} for {self._order.task.hold:g} s", True
            self._retreat()
        except EndedError as reason:
            ended, ok = str(reason), False
        finally:
            self._arm.guard.stop()
        return self._outcome(ended, ok)

    def _hold(self) -> None:
        """Approach, and press for as long as was asked."""
        while not self._held():
            with np.errstate(invalid="ignore"):  # of an infinite speed, which the guard refuses
                action = self._sequence.tick().action
            self._keep()
            end_if(action.ended)

    def _retreat(self) -> None:
        """Go back from the surface: the tip, or the command of a servo, which its tip follows later."""
        arm, retreat, gains = self._arm, self._order.task.retreat, self._order.loop.gains
        back, servo = arm.now.depth - retreat, gains.arm.kind == "servo"
        # At half the limit: of an arm that does not stamp its positions, a late one shows the way of several ticks.
        speed = min(0.5 * self._order.limits.speed, 10.0 * gains.approach)
        while retreat and (arm.commanded @ self._direction if servo else arm.now.depth) > back:
            arm.read()
            arm.move(-speed * self._direction)
            self._keep()

    def _held(self) -> bool:
        touched = self._arm.touched
        return touched is not None and self._arm.now.sense.stamp - touched >= self._order.task.hold

    def _keep(self) -> None:
        """Keep the row of a tick."""
        arm, touch = self._arm, self._sequence.touch
        now, known = arm.now, belief_of(self._driver.loop, self._direction)
        arm.touched, sense = None if touch is None else touch.time, now.sense
        self._stiffness = known.stiffness or self._stiffness
        if arm.touched is not None and not self._held():
            force = float((np.array(sense.force) - arm.rest.bias) @ known.normal)
            self._pressed.append((sense.stamp - arm.touched, force))
        self._rows.add(
            sense.stamp, sense.received, now.depth, now.force, float(arm.velocity @ self._direction),
            float(arm.commanded @ self._direction), known.bound, known.phase, float(now.missed),
            *sense.force, *sense.torque, *sense.position, *sense.quaternion,
        )  # fmt: skip
        end_if("there is no room for more readings" if self._rows.full else None)

    def _outcome(self, ended: str, ok: bool) -> Outcome:
        times, forces = np.array(self._pressed).reshape(-1, 2).T
        loop = self._driver.loop
        return Outcome(
            ended=ended,
            ok=ok,
            touched=self._sequence.touch is not None,
            force=force_reached(times, forces) if ok else None,
            settled=settling_time(times, forces, self._order) if ok else None,
            stiffness=self._stiffness,
            surface=surface_of(loop) if isinstance(loop, SlidingLoop) and self._pressed else None,
            lateness=self._arm.watch.summary(),
            rest=self._arm.rest,
            troubles=self._driver.troubles.ticks,
        )
