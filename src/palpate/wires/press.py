"""A press over a wire: tare in the air, approach and press with `ForceLoop`, withdraw, rest; stop at any limit.

The loop is driven by the arm's own readings. Whatever ends it, the arm is told to rest, and all that came is kept.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.errors import InputError
from palpate.force import ForceLoop
from palpate.press.plan import Plan
from palpate.wires.lateness import Lateness, Stopwatch
from palpate.wires.protocol import Command, LostError, Sense, Triple, Wire
from palpate.wires.recording import Rows

Array = NDArray[np.float64]

TARE = 0.5
"""In the air before the press [s]."""
_PHASES = {"air": 0.0, "learning": 1.0, "locked": 2.0}
_BAND = 0.05
"""Of the force, within which a press counts as settled."""
_FEWEST = 20
_PATIENCE = 10.0
"""For which that many readings may take: nothing moves yet, and a busy computer may be starved for a while [s]."""


@dataclass(frozen=True)
class Limits:
    """What ends a press; all are asked of the user.

    Args:
        force: of any component [N].
        speed: of the tool along the direction, commanded and measured [m/s].
        travel: from where the tool is at the start, along the direction and back [m].
        seconds: of the whole press, tare and withdrawal included [s].
    """

    force: float
    speed: float
    travel: float
    seconds: float

    def __post_init__(self) -> None:
        for name, unit, most in (
            ("force", "N", 1e4),
            ("speed", "m/s", 1.0),
            ("travel", "m", 2.0),
            ("seconds", "s", 3600.0),
        ):
            value = getattr(self, name)
            if not 0.0 < value <= most:
                raise InputError(
                    f"the {name} limit must be above 0 and at most {most:g} {unit}, got {value:g}"
                )


@dataclass(frozen=True)
class Task:
    """What to do.

    Args:
        force: F_d [N].
        direction: into the surface, of unit length in the base.
        hold: how long to press after the touch [s].
        retreat: way back afterwards [m].
        probe: share of the force by which it is lowered now and then.

    Raises:
        InputError: a probe that is no share, a hold that is no time.
    """

    force: float
    direction: Triple
    hold: float
    retreat: float
    probe: float = 0.0

    def __post_init__(self) -> None:
        self.plan  # noqa: B018 - it refuses what it cannot be

    @property
    def plan(self) -> Plan:
        """The force at each time since the touch."""
        return Plan(self.force, self.hold, self.probe)


@dataclass(frozen=True)
class Air:
    """What the arm shows at rest in the air.

    Args:
        position: [m], shape (3,).
        bias: of the force [N], shape (3,).
        noise: of the force along the direction [N].
        rate: readings a second [Hz].
        last: the last reading.
    """

    position: Array
    bias: Array
    noise: float
    rate: float
    last: Sense


@dataclass(frozen=True)
class Outcome:
    """How a press went.

    Args:
        ended: why, in words.
        ok: it pressed for as long as was asked.
        touched: the surface was met.
        force: mean over the last third of the hold [N]; None if it was not reached.
        settled: seconds from the touch until the force was within 5 % for good; None if it was not.
        stiffness: what the loop found of the surface, as the position feels it, and its std [N/m]; None if nothing.
        lateness: of the loop.
        air: what was seen before.
    """

    ended: str
    ok: bool
    touched: bool
    force: float | None
    settled: float | None
    stiffness: tuple[float, float] | None
    lateness: Lateness
    air: Air

    def to_json(self) -> dict[str, Any]:
        """As plain JSON values."""
        return {
            "ended": self.ended,
            "ok": self.ok,
            "touched": self.touched,
            "force_N": self.force,
            "settled_s": self.settled,
            "stiffness_N_per_m": None if self.stiffness is None else list(self.stiffness),
            "lateness": self.lateness.to_json(),
            "bias_N": self.air.bias.tolist(),
            "noise_N": self.air.noise,
            "rate_Hz": self.air.rate,
        }


@dataclass(frozen=True)
class Order:
    """A press that was checked: what to do with which gains, within which limits.

    Args:
        loop: of the arm, its desired force set.
        task: what to do, the direction of unit length.
        limits: what ends it.
    """

    loop: ForceLoop
    task: Task
    limits: Limits

    @property
    def most(self) -> int:
        """Readings that there may be: a fifth more than the time limit's, for an arm that runs a little fast."""
        return int(1.2 * self.limits.seconds * self.loop.gains.arm.rate) + 1000


class _EndedError(Exception):
    """The press ends; the text says why."""


def look(wire: Wire, order: Order) -> Air:
    """Read an arm at rest in the air, and refuse what no press should begin with.

    Raises:
        InputError: another rate than the gains', an arm that moves, a sensor that is saturated, untared or too noisy.
        LostError: no readings.
    """
    gains = order.loop.gains
    sensed = [wire.read(1.0)]
    while (span := sensed[-1].received - sensed[0].received) < TARE or len(sensed) < _FEWEST:
        if span > _PATIENCE:
            raise InputError(f"only {len(sensed)} readings came in {span:.3g} s; is the arm switched on?")
        sensed.append(wire.read(1.0))
    stamps = np.array([s.stamp for s in sensed])
    rate = 1.0 / max(float(np.median(np.diff(stamps))), 1e-9)
    # Over the lag theta a rate that is off by this moves a reading by one tick, which is what is proved.
    if abs(rate * gains.arm.tick - 1.0) > gains.arm.tick / gains.theta:
        raise InputError(
            f"the arm gives {rate:.4g} readings a second, and the gains are for {gains.arm.rate:g}: tune for this rate"
        )
    force, place = np.array([s.force for s in sensed]), np.array([s.position for s in sensed])
    if not (np.isfinite(force).all() and np.isfinite(place).all()):
        raise InputError("the arm gives readings that are no numbers; is its sensor switched on?")
    bias, along = force.mean(axis=0), force @ np.array(order.task.direction)
    air = Air(place[-1], bias, float(along.std()), rate, sensed[-1])
    _check_air(air, float(np.ptp(place, axis=0).max()), order)
    return air


def _check_air(air: Air, moved: float, order: Order) -> None:
    task, limits, gains = order.task, order.limits, order.loop.gains
    arm = gains.arm
    largest = float(np.abs(air.bias).max())
    if largest >= 0.99 * arm.sensor.full_scale:
        raise InputError(
            f"the force sensor shows {largest:.3g} N in the air, the end of its scale; unload it"
        )
    if largest + limits.force > arm.sensor.full_scale:
        raise InputError(
            f"the force sensor shows {largest:.3g} N in the air, so that it cannot read a force up to the limit of"
            f" {limits.force:g} N (full scale {arm.sensor.full_scale:g} N); tare it, or lower the limit"
        )
    if moved > max(gains.approach * TARE, 1e-5):
        raise InputError(f"the arm moved by {1e3 * moved:.3g} mm in {TARE:g} s; let it rest first")
    lowest = task.force * (1.0 - task.probe)
    if 8.0 * air.noise > lowest:
        raise InputError(
            f"the force's noise is {air.noise:.2g} N in the air: {lowest:g} N is below 8 standard deviations of it"
        )


def press(wire: Wire, order: Order, rows: Rows, asked_to_stop: Callable[[], bool]) -> Outcome:
    """Press as told; the arm rests when this returns or raises.

    Args:
        wire: to an arm at rest in the air.
        order: what to do with it, from `checked`.
        rows: keeps everything.
        asked_to_stop: whether the user wants it to end.

    Raises:
        InputError: what `look` refuses, or the arm has another master.
    """
    try:
        wire.tare()
        running = Running(wire, order, rows, asked_to_stop, look(wire, order))
        wire.begin()
        return running.run()
    finally:
        wire.stop()


class Running:
    """A press under way.

    Args:
        wire: see `press`.
        order: see `press`.
        rows: see `press`.
        asked_to_stop: see `press`.
        air: what was seen at rest.
    """

    def __init__(self, wire: Wire, order: Order, rows: Rows, asked_to_stop: Callable[[], bool], air: Air):
        self.wire, self.rows, self.asked_to_stop, self.air = wire, rows, asked_to_stop, air
        self.loop, self.task, self.limits = order.loop, order.task, order.limits
        loop, self.plan = order.loop, order.task.plan
        self.tick = loop.gains.arm.tick
        allowed = _jitter(loop)
        self.watch = Stopwatch(self.tick, None if allowed is None else allowed * self.tick, order.most)
        self.direction = np.array(self.task.direction)
        self.x_command, self.begun = 0.0, air.last.stamp
        self.touched: float | None = None
        self.last, self.depth = air.last, 0.0
        self.forces: list[tuple[float, float]] = []
        self.stiffness: tuple[float, float] | None = None

    def run(self) -> Outcome:
        """All of it."""
        try:
            while not self._held():
                self._step(self.loop.update)
            ended, ok = f"pressed for {self.task.hold:g} s", True
            back = self.depth - self.task.retreat
            while self.task.retreat and self.depth > back:
                self._step(self._away)
        except _EndedError as reason:
            ended, ok = str(reason), False
        except LostError as error:
            ended, ok = str(error), False
        finally:
            self.wire.stop()
        return self._told(ended, ok)

    def _away(self, force: float, depth: float, missed: float) -> float:
        """The speed of the withdrawal [m/s]."""
        return -min(self.limits.speed, 10.0 * self.loop.gains.approach)

    def _held(self) -> bool:
        return self.touched is not None and self.last.stamp - self.touched >= self.task.hold

    def _step(self, law: Callable[[float, float, float], float]) -> None:
        """One reading, one command."""
        sense = self.wire.read(self.loop.gains.theta)
        ticks = (sense.stamp - self.last.stamp) / self.tick
        missed = max(round(ticks) - 1, 0)
        force = float((np.array(sense.force) - self.air.bias) @ self.direction)
        before, self.depth = (
            self.depth,
            float((np.array(sense.position) - self.air.position) @ self.direction),
        )
        self._check(sense, force, (self.depth - before) / max(ticks, 1.0) / self.tick)
        self.last = sense
        if self.touched is not None and not self._held():
            self.loop.desired = self.plan.desired(sense.stamp - self.touched)
        speed = min(max(law(force, self.depth, float(missed)), -self.limits.speed), self.limits.speed)
        self.x_command += self.tick * speed
        self.wire.write(
            Command(
                _triple(speed * self.direction), _triple(self.air.position + self.x_command * self.direction)
            )
        )
        self.watch.done(sense.stamp, time.monotonic(), missed)
        self._note(sense, force, speed, missed)

    def _check(self, sense: Sense, force: float, speed: float) -> None:
        """End the press where a limit is passed."""
        limits, gains = self.limits, self.loop.gains
        if self.asked_to_stop():
            raise _EndedError("stopped by the user")
        if self.rows.full or sense.stamp - self.begun > limits.seconds:
            what = "" if self.touched is not None else ", and nothing was touched"
            raise _EndedError(f"the time limit of {limits.seconds:g} s is over{what}")
        largest = float(np.abs(np.array(sense.force) - self.air.bias).max())
        if not largest <= limits.force:
            raise _EndedError(f"the force is {largest:.3g} N, above the limit of {limits.force:g} N")
        if force < -max(self.task.force, 8.0 * self.air.noise) / 2.0:
            raise _EndedError(
                f"the force is {force:.3g} N against the press: is its sign, or --normal, right?"
            )
        if not abs(self.depth) <= limits.travel:
            raise _EndedError(
                f"the tool is {1e3 * self.depth:.3g} mm from the start, beyond the limit of {1e3 * limits.travel:g} mm"
            )
        aside = np.array(sense.position) - self.air.position - self.depth * self.direction
        if not float(np.linalg.norm(aside)) <= limits.travel:
            raise _EndedError("the tool left the line of the press by more than the limit of travel")
        # A quantised position shows speeds that are none from tick to tick: twice the limit over one tick is let pass.
        if abs(speed) > 2.0 * limits.speed + 2e-5 / self.tick:
            raise _EndedError(
                f"the tool moves at {1e3 * speed:.3g} mm/s, above the limit of {1e3 * limits.speed:g}"
            )
        age = self.watch.age(sense.stamp, time.monotonic())
        if age > gains.theta:
            raise _EndedError(
                f"a reading came {1e3 * age:.3g} ms late, more than the loop's lag of {1e3 * gains.theta:.3g} ms"
            )

    def _note(self, sense: Sense, force: float, speed: float, missed: int) -> None:
        found, loop = self.loop.estimate, self.loop
        if found is not None:
            self.stiffness = (found.stiffness, found.stiffness_std)
        if self.touched is None and loop.phase != "air":
            self.touched = sense.stamp
        if self.touched is not None and not self._held():
            self.forces.append((sense.stamp - self.touched, force))
        self.rows.add(
            sense.stamp, sense.received, self.depth, force, speed, self.x_command,
            found.bound if found is not None else loop.gains.seen_cap, _PHASES[loop.phase], float(missed),
            *sense.force, *sense.torque, *sense.position, *sense.quaternion,
        )  # fmt: skip

    def _told(self, ended: str, ok: bool) -> Outcome:
        times, forces = np.array(self.forces or [(0.0, 0.0)]).T
        late = forces[times > 2.0 / 3.0 * times[-1]]
        mean = float(late.mean()) if ok and len(late) else None
        if self.task.probe:  # until it is lowered for the first time
            times, forces = times[times < times[-1] / 3.0], forces[times < times[-1] / 3.0]
        # Of a mean over a whole lag: noise of single readings is not the force.
        width = max(round(self.loop.gains.theta / self.tick), 1)
        smooth = np.convolve(forces, np.full(width, 1.0 / width), "valid") if len(forces) > width else forces
        outside = np.flatnonzero(np.abs(smooth / self.task.force - 1.0) > _BAND)
        inside = ok and (not len(outside) or outside[-1] < len(smooth) - 1)
        settled = float(times[outside[-1] + 1]) if inside and len(outside) else (0.0 if inside else None)
        return Outcome(
            ended, ok, self.touched is not None, mean, settled,
            self.stiffness, self.watch.told(), self.air,
        )  # fmt: skip


def _jitter(loop: ForceLoop) -> int | None:
    """Ticks by which the certificate lets a reading's age change; None without one that covers the adapting law."""
    claims = [] if loop.certificate is None else [c for c in loop.certificate.claims if c.kind == "adapting"]
    return max((c.jitter for c in claims), default=None)


def _triple(vector: Array) -> Triple:
    return float(vector[0]), float(vector[1]), float(vector[2])


def checked(loop: ForceLoop, task: Task, limits: Limits) -> Order:
    """What was asked as an order, its direction of unit length; refused where it does not fit the gains.

    Raises:
        InputError: what does not fit, and what to do.
    """
    gains = loop.gains
    size = float(np.linalg.norm(task.direction))
    if not (math.isfinite(size) and size > 0.0):
        raise InputError(
            "--normal must have a length; it points into the surface in the base's axes, as 0,0,-1"
        )
    if not task.force < limits.force <= gains.arm.sensor.full_scale:
        raise InputError(
            f"the force limit must lie between the force of {task.force:g} N and the sensor's full scale of"
            f" {gains.arm.sensor.full_scale:g} N, got {limits.force:g} N"
        )
    if not gains.approach <= limits.speed <= gains.arm.limits.speed:
        raise InputError(
            f"the speed limit must lie between the certified approach of {1e3 * gains.approach:.3g} mm/s and the arm's"
            f" {1e3 * gains.arm.limits.speed:g} mm/s, got {1e3 * limits.speed:g} mm/s"
        )
    if not (task.hold > 0.0 and task.hold + TARE < limits.seconds):
        raise InputError(
            f"--seconds must be above 0 and leave time for the approach within the limit of {limits.seconds:g} s"
        )
    if not 0.0 <= task.retreat <= limits.travel:
        raise InputError(f"--retreat must be from 0 to the travel limit of {1e3 * limits.travel:g} mm")
    loop.desired = task.force
    return Order(loop, replace(task, direction=_triple(np.array(task.direction) / size)), limits)
