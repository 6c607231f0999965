"""A press over a wire, or a slide: tare in free motion, approach, `ForceLoop` or `SlidingLoop`, unload, rest.

The sequence is that of every press, driven by the arm's own readings: each comes through the guard and is compared with
all stop conditions, and each speed goes out through the guard. Whatever ends the press, the tip is unloaded, the arm is
told to rest, and all that came is kept.
"""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from palpate.arrays import Array
from palpate.bench.summary import RETREAT
from palpate.force import ForceLoop, SlidingLoop
from palpate.press.at_rest import SATURATED
from palpate.press.free_stroke import FreeForce, StrokeMetError, make_stroke
from palpate.press.sequence import (
    CautiousDriver,
    ForceToReach,
    PressSequence,
    SlidingDriver,
    TipSample,
    lag_ticks,
)
from palpate.press.unload import HELD, Glimpse, RetreatPlan, Unloading, unload
from palpate.wires.at_rest import AtRest, check_at_rest, retune_for_noise
from palpate.wires.guard import Guard, Moment, end_if, reading_fault, reason_to_stop
from palpate.wires.order import Order
from palpate.wires.outcome import Outcome, Rows, describe_surface, force_reached, settling_time
from palpate.wires.realtime import CLOCK, Clock, Stopwatch, defer_interrupts
from palpate.wires.wire import ArmReading, Command, PressEndedError, Wire, triple

_PHASES = {"free motion": 0.0, "learning": 1.0, "locked": 2.0}
_SLIDING = 3.0
_STILL = 1e-12
"""Speed below which a command counts as none [m/s]."""


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


def read_belief(loop: ForceLoop | SlidingLoop, direction: Array) -> SurfaceBelief:
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
    clock: Clock = CLOCK,
) -> Outcome:
    """Press as ordered; the tip is unloaded and the arm rests when this returns or raises.

    The same wire, and the same order, can be pressed with again.

    Args:
        wire: to an arm at rest in free motion.
        order: what to do with it, from `check_order`.
        rows: record of the press.
        asked_to_stop: returns the reason why the user stops the press, or None.
        show: called with each sentence for the user while it presses; must not block.
        clock: that the wire's readings are received by.

    Raises:
        InputError: what `check_at_rest` refuses, or the arm has another master.
    """
    order.loop.reset()
    try:
        wire.tare()
        rest = check_at_rest(wire, order)
        order, note = retune_for_noise(rest, order)
        if note is not None:
            show(note)
        return _Press(GuardedArm(wire, order, rest, asked_to_stop, clock), order, rows, show).run()
    finally:
        wire.stop()


class GuardedArm:
    """The arm of a sequence: its readings within the stop conditions, its commands through the guard.

    Args:
        wire: to the arm.
        order: of the press.
        rest: the arm before it.
        asked_to_stop: returns the reason why the user stops the press, or None.
        clock: of the wire's readings.
    """

    def __init__(
        self,
        wire: Wire,
        order: Order,
        rest: AtRest,
        asked_to_stop: Callable[[], str | None],
        clock: Clock = CLOCK,
    ):
        gains = order.loop.gains
        self._order, self.rest, self._tick, self.watchdog = order, rest, gains.arm.tick, wire.watchdog
        self.clock = clock
        self.guard = Guard(wire, order.limits, rest.position, self._tick, gains.theta, asked_to_stop, clock)
        self.watch = Stopwatch(self._tick, order.jitter, order.most)
        self._direction = np.array(order.task.direction)
        self.velocity, self.commanded = np.zeros(3), np.zeros(3)
        self.deepest = 0.0
        """Largest way of tip or command along the direction [m]."""
        self.now = Moment(rest.last, 0.0, 0.0, 0.0, 0, 0.0, 0.0)
        self.into = self._direction
        self.slope = 0.0
        """Slope of the free force over the depth, which is taken off the readings [N/m]."""
        self.on_retreat: Callable[[], None] = lambda: None
        self.fault: str | None = None
        """Stop condition that was met first in the retreat of a press that no stop condition had ended."""
        self.watching = False

    def read(self) -> TipSample:
        """The next reading, within all limits.

        Raises:
            PressEndedError: none came, or a stop condition.
        """
        sense = self.guard.read()
        end_if(self._take(sense))
        end_if(reason_to_stop(self.now, self._order, self.rest))
        self.deepest = max(self.deepest, self.now.depth)
        return TipSample(sense.stamp, self.net_force, np.array(sense.position), float(self.now.missed))

    @property
    def net_force(self) -> Array:
        """Force of the present reading without that of free motion [N], shape (3,)."""
        free = self.rest.bias + self.slope * self.now.depth * self._direction
        return np.asarray(np.array(self.now.sense.force) - free)

    def _take(self, sense: ArmReading) -> str | None:
        """Make a reading the current one; return the reason if it is unusable."""
        fault = reading_fault(sense, self.now.sense, self.rest, self._order.loop.gains.theta)
        if fault is not None:
            return fault
        last = self.now.sense
        ticks = (sense.stamp - last.stamp) / self._tick
        moving = sense.stamp - sense.position_lag - (last.stamp - last.position_lag)
        depth = float((np.array(sense.position) - self.rest.position) @ self._direction)
        self.now = Moment(
            sense=sense,
            force=float((np.array(sense.force) - self.rest.bias) @ self._direction) - self.slope * depth,
            depth=depth,
            speed=math.dist(sense.position, last.position) / max(moving, self._tick),
            missed=max(round(ticks) - 1, 0),
            age=self.watch.age(sense.stamp, self.clock.monotonic()),
            since_start=sense.stamp - self.rest.last.stamp,
        )
        return None

    def glimpse(self) -> Glimpse:
        """The believable readings of this tick of the retreat.

        The force is None if the sensor is saturated, the depth if the position stands still or exceeds the travel.
        """
        before = self.now.sense
        if self.watching:
            try:
                self.read()
            except PressEndedError as reason:
                self.fault, self.watching = str(reason), False
        else:
            sense = self.guard.glimpse()
            if sense is not None:
                self._take(sense)
        sense, depth = self.now.sense, self.now.depth * float(np.sign(self.into @ self._direction))
        if sense is before:
            return Glimpse(None, None)
        force = np.array(sense.force)
        saturated = np.abs(force).max() >= SATURATED * self._order.loop.gains.arm.sensor.full_scale
        stuck = sense.position == before.position or not abs(depth) <= self._order.limits.travel
        along = float(self.net_force @ self.into)
        return Glimpse(None if saturated else along, None if stuck else depth)

    def retreat(self, velocity: Array) -> str | None:
        """Command a velocity out of the surface [m/s], shape (3,); the reason if it did not go out."""
        self.velocity, self.commanded = velocity, self.commanded + self._tick * velocity
        command = Command(triple(velocity), triple(self.rest.position + self.commanded))
        reason = self.guard.retreat(command, self.into)
        self.on_retreat()
        return reason

    def move(self, velocity: Array, turning: Array | None = None) -> None:
        """Command a velocity [m/s], within the limit.

        A speed that the arm cannot have, or that is no number, is a fault of the law: the guard refuses it as it is.

        Raises:
            PressEndedError: it must not go out, or could not be sent.
        """
        size, limits = float(np.linalg.norm(velocity)), self._order.limits
        if size <= self._order.loop.gains.arm.limits.speed:
            velocity = velocity * min(1.0, limits.speed / max(size, _STILL))
        commanded = self.commanded + self._tick * velocity
        self.guard.write(Command(triple(velocity), triple(self.rest.position + commanded)))
        self.velocity, self.commanded = velocity, commanded
        self.deepest = max(self.deepest, float(commanded @ self._direction))
        self.watch.note_sent(self.now.sense.stamp, self.clock.monotonic(), self.now.missed)


class _Press:
    """A running press or slide; see `press`. The hold of a slide begins when its force is held."""

    def __init__(self, arm: GuardedArm, order: Order, rows: Rows, show: Callable[[str], None]):
        self._arm, self._order, self._rows = arm, order, rows
        task, gains = order.task, order.loop.gains
        self._direction = np.array(task.direction)
        self._driver: CautiousDriver | SlidingDriver
        goal: ForceToReach | None = ForceToReach(task.force, self._direction, lag_ticks(gains))
        if task.path is None:
            self._driver = CautiousDriver(arm, order.loop, self._direction, show)
        else:
            loop, ways = SlidingLoop(gains, self._direction), task.path.directions(gains, self._direction)
            loop.desired = task.force
            if gains.arm.kind == "servo":
                loop.limit_speed(order.limits.speed)
            rate, last = gains.arm.rate, len(ways) - 1
            self._driver = SlidingDriver(arm, loop, lambda since: ways[min(round(since * rate), last)], show)
            goal = None
        self._sequence = PressSequence(arm, self._driver, task.plan.force_at, gains.arm.tick, goal)
        self._pressed: list[tuple[float, float]] = []
        self._stiffness: tuple[float, float] | None = None
        self._last_sense = arm.rest.last
        self._free_force: FreeForce | None = None

    def run(self) -> Outcome:
        """Run the press from its start to its end.

        Raises:
            InputError: the force in free motion is none with which to press.
        """
        guard = self._arm.guard
        guard.begin()
        try:
            met = self._measure_free_force()
            result = self._press_and_unload() if met is None else (met, False, self._unload(out=True))
        finally:
            guard.stop()
        return self._outcome(*result)

    def _press_and_unload(self) -> tuple[str, bool, Unloading]:
        """Press; return the reason of the end, True if the hold was completed, and how the tip was unloaded."""
        try:
            ended, ok = self._press()
            unloading = self._rest() if ok and self._order.task.end == "hold" else self._unload(watching=ok)
        except BaseException:
            self._rows.about["unloaded"] = self._unload().to_json()
            raise
        fault = self._arm.fault
        return (ended, ok, unloading) if fault is None else (fault, False, unloading)

    def _measure_free_force(self) -> str | None:
        """Make the free stroke, and take its slope off the readings; the reason if it has ended early."""
        stroke = self._order.stroke
        if stroke is None:
            return None
        try:
            self._free_force = make_stroke(self._arm, stroke)
        except (StrokeMetError, PressEndedError) as reason:
            return f"in the free stroke {reason}"
        except BaseException:
            self._unload(out=True)
            raise
        level, travel = self._order.loop.gains.level, self._order.limits.travel
        self._arm.slope = self._free_force.slope_to_subtract(travel, level)
        return None

    def _press(self) -> tuple[str, bool]:
        """Approach and press; return the reason of the end, and True if the hold was completed."""
        task = self._order.task
        try:
            while not self._is_done():
                with np.errstate(invalid="ignore"):  # of an infinite speed, which the guard refuses
                    action = self._sequence.tick().action
                self._keep()
                end_if(action.ended)
        except PressEndedError as reason:
            return self._with_shortfall(str(reason)), False
        return f"{'pressed' if task.path is None else 'slid'} for {task.hold:g} s", True

    def _with_shortfall(self, ended: str) -> str:
        """The reason of an end, with what was met if the travel or the time for the approach is exhausted."""
        limits, arm = self._order.limits, self._arm
        step = limits.speed * self._order.loop.gains.arm.tick
        over = max(arm.deepest, arm.now.depth) + step >= limits.travel or arm.now.since_start > limits.seconds
        if self._sequence.touched or not over:
            return ended
        return f"{ended}, and {self._sequence.shortfall(arm.rest.noise)}"

    def _is_done(self) -> bool:
        return self._sequence.reached and self._sequence.since >= self._order.task.hold

    def _rest(self) -> Unloading:
        """Rest where the command is."""
        self._arm.retreat(np.zeros(3))
        return HELD

    def _unload(self, watching: bool = False, out: bool = False) -> Unloading:
        """Lead the tip out of the surface; a Ctrl-C waits until it is out.

        Args:
            watching: the stop conditions are watched, and the retreat is slow: of a press that none of them ended.
            out: the tip is on its free stroke, out of which it goes back to its start.
        """
        arm, order = self._arm, self._order
        normal = -self._direction if out else read_belief(self._driver.loop, self._direction).normal
        arm.into = normal if np.isfinite(normal).all() else self._direction
        arm.watching, arm.on_retreat = watching, self._keep_retreat
        depth, clearance = arm.deepest, order.task.retreat
        if out:
            depth = float(arm.commanded @ arm.into)
            clearance = min(clearance, depth)
            depth -= clearance
        plan = RetreatPlan(
            gains=order.loop.gains,
            normal=arm.into,
            speed=order.slow_speed if watching or out else order.limits.speed,
            clearance=clearance,
            depth=depth,
            noise=arm.rest.noise,
            force=order.task.force,
        )
        with defer_interrupts():
            return unload(arm, plan)

    def _keep(self) -> None:
        """Keep the row of a tick."""
        arm, touch = self._arm, self._sequence.touch
        sense, known = arm.now.sense, read_belief(self._driver.loop, self._direction)
        self._stiffness = known.stiffness or self._stiffness
        if touch is None:
            self._pressed.clear()
        else:
            force = float(arm.net_force @ known.normal)
            self._pressed.append((sense.stamp - touch.time, force))
        if self._sequence.reached:
            self._rows.note_hold(sense.stamp)
        self._add_row(known.bound, known.phase)
        end_if("there is no room for more readings" if self._rows.full else None)

    def _keep_retreat(self) -> None:
        """Keep the row of a tick of the retreat, if it has a new reading and there is room."""
        sense = self._arm.now.sense
        if not self._rows.full and sense is not self._last_sense:
            self._add_row(read_belief(self._driver.loop, self._direction).bound, RETREAT)
            self._arm.watch.note_sent(sense.stamp, self._arm.clock.monotonic(), self._arm.now.missed)

    def _add_row(self, bound: float, phase: float) -> None:
        arm, now = self._arm, self._arm.now
        sense = self._last_sense = now.sense
        self._rows.add(
            sense.stamp,
            sense.received,
            now.depth,
            now.force,
            float(arm.velocity @ self._direction),
            float(arm.commanded @ self._direction),
            bound,
            phase,
            float(now.missed),
            *sense.force,
            *sense.torque,
            *sense.position,
            *sense.quaternion,
        )

    def _outcome(self, ended: str, ok: bool, unloading: Unloading) -> Outcome:
        times, forces = np.array(self._pressed).reshape(-1, 2).T
        loop, touched = self._driver.loop, self._sequence.touched
        if not unloading.completed:
            unloading = replace(unloading, how=f"{unloading.how}; {self._arm.watchdog}")
        return Outcome(
            ended=ended,
            ok=ok,
            unloading=unloading,
            touched=touched,
            force=force_reached(times, forces) if ok else None,
            settled=settling_time(times, forces, self._order) if ok else None,
            stiffness=self._stiffness if touched else None,
            surface=describe_surface(loop) if isinstance(loop, SlidingLoop) and touched else None,
            lateness=self._arm.watch.summary(),
            rest=self._arm.rest,
            free_stroke=None if self._free_force is None else self._free_force.to_json(self._arm.slope),
            troubles=self._driver.troubles.ticks,
        )
