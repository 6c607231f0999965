"""Sequence of every press and slide: at rest, from free motion to contact to the end, whoever moves the arm.

A simulated arm and one over a wire are read and moved alike. A driver is the law between the two. At
rest in free motion the force sensor is tared; its noise and drift are compared with those that the gains assume.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from math import inf
from typing import TYPE_CHECKING, NamedTuple, Protocol

import msgspec
import numpy as np
from numpy.typing import ArrayLike

from palpate.arrays import Array
from palpate.bench.summary import APPROACH, CONTACT, LOST
from palpate.errors import InputError
from palpate.force.arm import Sensor
from palpate.force.force_loop import ForceLoop
from palpate.force.gains import Gains
from palpate.force.guard import BEYOND, DRIFTS, LATE, SWINGS, TROUBLES
from palpate.force.sliding import slide_state

if TYPE_CHECKING:
    from palpate.force.sliding.sliding_loop import SlidingLoop
    from palpate.force.sliding.turning_tool import TurningTool


TARE = 0.5
"""At rest in free motion before a press [s]."""
SURE = 8.0
"""Standard deviations of a reading, which no reading of a press shows by chance."""


def check_range(shown: float, most: float, full_scale: float) -> None:
    """Refuse a sensor that is saturated, or too far from zero.

    Args:
        shown: in free motion, the largest component [N].
        most: that is to be read [N].
        full_scale: of the sensor [N].

    Raises:
        InputError: it stands at the end of its scale, or could not read that force.
    """
    if shown >= 0.99 * full_scale:
        raise InputError(
            f"the force sensor shows {shown:.3g} N in free motion, the end of its scale; unload it"
        )
    if shown + most > full_scale:
        raise InputError(
            f"the force sensor shows {shown:.3g} N in free motion, so that it cannot read a force of up to {most:g} N"
            f" (full scale {full_scale:g} N); tare it, or lower the force and its limit"
        )


_PARTS = 10
_SURELY = 4.5
"""Student's t of eight degrees of freedom at 99.9 %: a line through the means of ten parts."""
_SHARE = 0.05
"""Of the desired force, the band within which a press counts as settled: a drift that leaves it is no reading of it."""


def noise_and_drift(times: Array, force: Array) -> tuple[float, float, float]:
    """Noise [N], drift and the drift's standard deviation [N/s] of readings at rest.

    The drift is that of the means of ten parts, so that a hum, or the memory of a low-pass, counts once in each part.

    Args:
        times: of the readings [s], shape (n,), ten or more.
        force: [N], shape (n,).
    """
    t, f = (np.array([part.mean() for part in np.array_split(v, _PARTS)]) for v in (times, force))
    t = t - t.mean()
    drift = float(t @ f / (t @ t))
    left = f - f.mean() - drift * t
    about = force - force.mean() - drift * (times - times.mean())
    return float(about.std()), drift, float(np.sqrt(left @ left / (_PARTS - 2) / (t @ t)))


def fitting(gains: Gains, noise: float, count: int) -> Gains | None:
    """The gains for a noise that was measured; None if they are for that already.

    No lag and no gain depends on the noise: it decides what counts as a touch.

    Args:
        gains: as they were tuned.
        noise: standard deviation of the readings at rest [N].
        count: of the readings.

    Raises:
        InputError: a noise that hides the force.
    """
    sensor = gains.arm.sensor
    if noise <= sensor.noise * (1.0 + SURE / np.sqrt(2.0 * count)):
        return None
    sensor = msgspec.structs.replace(sensor, noise=noise)
    return msgspec.structs.replace(gains, arm=msgspec.structs.replace(gains.arm, sensor=sensor))


def check_drift(drift: float, std: float, force: float, seconds: float, sensor: Sensor) -> None:
    """Refuse a sensor that surely drifts by more than its maker's figure, or than the press can bear.

    Args:
        drift: of the force at rest [N/s].
        std: its standard deviation [N/s].
        force: desired [N].
        seconds: that the press may last [s].
        sensor: of the gains; without a drift, so much is borne as leaves the force within 5 %.

    Raises:
        InputError: it drifts by more.
    """
    borne = _SHARE * force / seconds
    most = borne if sensor.drift is None else max(sensor.drift, borne)
    if abs(drift) - _SURELY * std > most:
        raise InputError(
            f"the force drifts by {drift:.2g} N/s at rest, and at most {most:.2g} N/s is borne: let the sensor warm up,"
            " tare again, or press for a shorter time"
        )


_STEPS = 6
"""Down and up again, three times."""
_PATIENCE = 3.0
"""How many times longer than the approach should take the surface is looked for."""


@dataclass(frozen=True)
class Plan:
    """The plan's numbers.

    Args:
        force: [N].
        seconds: from the first touch on [s].
        probe: share of the force by which it is lowered now and then, so that the surface shows itself; 0 for never.
        longest: time to look for the surface [s].
    """

    force: float
    seconds: float
    probe: float = 0.2
    longest: float = 60.0

    def __post_init__(self) -> None:
        if not 0.0 < self.seconds < inf:
            raise InputError(f"the press must last longer than 0 s, got {self.seconds:g} s")
        if not 0.0 <= self.probe <= 0.9:
            raise InputError(f"the probe is a share of the force from 0 to 0.9, got {self.probe:g}")

    def force_at(self, since: float) -> float:
        """Desired force at a time since the touch [N]: steady, in the middle third in steps down and up, steady."""
        third = self.seconds / 3.0
        if not third <= since < 2.0 * third:
            return self.force
        lowered = int((since - third) / (third / _STEPS)) % 2 == 0
        return self.force * (1.0 - self.probe * lowered)


def plan_for(force: float, seconds: float, probe: float, gap: float, speed: float) -> Plan:
    """A plan that looks for the surface three times as long as the way to it takes, and a second."""
    return Plan(force, seconds, probe, 1.0 + _PATIENCE * gap / speed)


def mean_over(forces: Array, lag: float, tick: float) -> Array:
    """Running mean over a loop's lag [s], of which single readings' noise is no part; shape (n - lag/tick + 1,).

    Args:
        forces: one a tick [N], shape (n,).
        lag: theta [s].
        tick: [s].
    """
    width = max(round(lag / tick), 1)
    return np.convolve(forces, np.full(width, 1.0 / width), "valid") if len(forces) > width else forces


class TipSample(NamedTuple):
    """Readings of an arm at a tick, in its base's axes."""

    time: float  # by the arm's clock [s]
    force: Array  # that the tip exerts on the environment [N], shape (3,)
    position: Array  # of the tip [m], shape (3,)
    missed: float = 0.0  # readings that never came, since the one before
    rotation: Array | None = None  # of the tool, its axes in columns, shape (3, 3); where it is to turn


class MovableArm(Protocol):
    """An arm in a simulation, or on the other end of a wire."""

    def read(self) -> TipSample:
        """The readings at this tick; waits for the tick if the arm has its own clock."""
        ...

    def move(self, velocity: Array, turning: Array | None = None) -> None:
        """Moves the tool's point with this velocity [m/s] and turning [rad/s] until the next command, shape (3,)."""
        ...


class Action(NamedTuple):
    """Result of a driver's tick."""

    phase: float  # APPROACH, CONTACT or LOST
    speed: float  # asked of the tip along the normal [m/s]
    velocity: Array  # asked of the tip [m/s], shape (3,)
    bound: float  # K_u of the cautious law [N/m]; 0 where there is none
    trouble: str = ""  # of the law in this tick
    ended: str | None = None  # by a trouble that lasts


class PressDriver(Protocol):
    """Moves the arm once a tick."""

    def step(self, sample: TipSample, desired: float, since: float) -> Action:
        """Presses with the desired force [N], or looks for the surface; `since` is the time since the touch [s]."""
        ...


class Tick(NamedTuple):
    """One tick of a sequence: readings, desired force [N], and result."""

    sample: TipSample
    desired: float
    action: Action


class PressSequence:
    """A press or a slide, tick by tick.

    Args:
        arm: what moves.
        driver: of that arm.
        desired: desired force [N] at a time since the touch [s].
        tick: of the arm [s].
    """

    def __init__(self, arm: MovableArm, driver: PressDriver, desired: Callable[[float], float], tick: float):
        self._arm, self._driver, self._desired, self._tick = arm, driver, desired, tick
        self.touch: TipSample | None = None
        self._last = 0.0

    def _since(self, time: float) -> float:
        """Time since the touch in whole ticks [s]; 0 before it."""
        return 0.0 if self.touch is None else round((time - self.touch.time) / self._tick) * self._tick

    @property
    def next_since(self) -> float:
        """Time since the touch at the next tick [s]; 0 before it."""
        return self._since(self._last + self._tick)

    def tick(self) -> Tick:
        """Reads the arm and moves it."""
        sample = self._arm.read()
        self._last = sample.time
        since = self._since(sample.time)
        desired = self._desired(since)
        action = self._driver.step(sample, desired, since)
        if self.touch is None and action.phase == CONTACT:
            self.touch = sample
        return Tick(sample, desired, action)


_SLIDES = (
    slide_state.REFUTED,
    slide_state.STEPPED,
    slide_state.JERKS,
    slide_state.LOST,
    slide_state.AWAY,
)
BORNE = {slide_state.SLIDING_TROUBLES[code] for code in (LATE, DRIFTS, BEYOND, SWINGS, *_SLIDES)}
"""Troubles with which a press or a slide goes on, however long they last."""


class Troubles:
    """Troubles of the law: each is shown when it begins, and one that lasts longer than the lag ends the press.

    Those of `BORNE` end none. Missed ticks are not shown: the wire counts them, and ends the press at too many.

    Args:
        lag: of the loop [s].
        show: called with the sentence of a trouble.
    """

    def __init__(self, lag: float, show: Callable[[str], None]):
        self._lag, self._show = lag, show
        self._now, self._since = "", 0.0
        self.ticks: Counter[str] = Counter()

    def lasting(self, trouble: str, time: float) -> str | None:
        """The sentence of a trouble that has lasted too long; None of none.

        Args:
            trouble: of this tick, empty for none.
            time: by the clock of the arm [s].
        """
        trouble = "" if trouble == TROUBLES[LATE] else trouble
        if trouble != self._now:
            self._now, self._since = trouble, time
        if not trouble:
            return None
        if trouble not in self.ticks:
            self._show(trouble)
        self.ticks[trouble] += 1
        return trouble if time - self._since > self._lag and trouble not in BORNE else None


class CautiousDriver:
    """`palpate.force.ForceLoop` along a normal.

    Args:
        arm: what moves.
        loop: its force loop.
        normal: into the surface, in the base's axes, shape (3,).
        show: called with the sentence of a trouble when it begins.
    """

    def __init__(
        self, arm: MovableArm, loop: ForceLoop, normal: Array, show: Callable[[str], None] = lambda _: None
    ):
        self._arm, self._normal, self.loop = arm, normal, loop
        self._touched = False
        self.troubles = Troubles(loop.gains.theta, show)

    def step(self, sample: TipSample, desired: float, since: float) -> Action:
        """One tick, as `PressDriver` describes it."""
        loop, normal = self.loop, self._normal
        loop.desired = desired
        speed = loop.update(float(sample.force @ normal), float(normal @ sample.position), sample.missed)
        velocity = speed * normal
        self._arm.move(velocity)
        pressing = loop.phase != "free motion"
        self._touched = self._touched or pressing
        phase = CONTACT if pressing else LOST if self._touched else APPROACH
        estimate, trouble = loop.estimate, loop.trouble
        bound = estimate.bound if estimate is not None else loop.gains.seen_cap
        return Action(phase, speed, velocity, bound, trouble, self.troubles.lasting(trouble, sample.time))


class SlidingDriver:
    """`palpate.force.SlidingLoop` along a path; the tip slides from the first tick at which the force is held.

    Args:
        arm: what moves.
        loop: its sliding loop, whose desired force is set.
        direction: of the slide at a time since it began [s], shape (3,).
        show: called with the sentence of a trouble when it begins.
        tool: turns the tool with that loop; None for one that does not turn.
    """

    def __init__(
        self,
        arm: MovableArm,
        loop: SlidingLoop,
        direction: Callable[[float], ArrayLike],
        show: Callable[[str], None] = lambda _: None,
        tool: TurningTool | None = None,
    ):
        self._arm, self.loop, self._direction, self._tool = arm, loop, direction, tool
        self._slid = False
        self.troubles = Troubles(loop.gains.theta, show)

    def step(self, sample: TipSample, desired: float, since: float) -> Action:
        """One tick, as `PressDriver` describes it."""
        loop, way = self.loop, self._direction(since)
        if self._tool is None or sample.rotation is None:
            velocity = loop.update(sample.force, sample.position, way, sample.missed)
            self._arm.move(velocity)
        else:
            twist = self._tool.update(sample.force, sample.position, sample.rotation, way, sample.missed)
            velocity = twist[:3]
            self._arm.move(velocity, twist[3:])
        self._slid = self._slid or loop.sliding
        phase = CONTACT if loop.sliding else LOST if self._slid else APPROACH
        lasting = self.troubles.lasting(loop.trouble, sample.time)
        return Action(phase, float(velocity @ loop.normal), velocity, loop.bound, loop.trouble, lasting)
