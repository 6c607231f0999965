"""Sequence of every press and slide: from free motion to contact to the end, tick by tick, whoever moves the arm.

A simulated arm and one over a wire are read and moved alike. A driver is the law between the two.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from math import inf
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike

from palpate.arrays import Array
from palpate.bench.summary import APPROACH, CONTACT, LOST
from palpate.errors import InputError
from palpate.force.force_loop import ForceLoop
from palpate.force.guard import BEYOND, DRIFTS, LATE, SWINGS, TROUBLES
from palpate.force.sliding import slide_state
from palpate.force.sliding.sliding_loop import SlidingLoop

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


class MovableArm(Protocol):
    """An arm in a simulation, or on the other end of a wire."""

    def read(self) -> TipSample:
        """The readings at this tick; waits for the tick if the arm has its own clock."""
        ...

    def move(self, velocity: Array) -> None:
        """Moves the tip with this velocity until the next command [m/s], shape (3,); it does not turn."""
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
    """

    def __init__(
        self,
        arm: MovableArm,
        loop: SlidingLoop,
        direction: Callable[[float], ArrayLike],
        show: Callable[[str], None] = lambda _: None,
    ):
        self._arm, self.loop, self._direction = arm, loop, direction
        self._slid = False
        self.troubles = Troubles(loop.gains.theta, show)

    def step(self, sample: TipSample, desired: float, since: float) -> Action:
        """One tick, as `PressDriver` describes it."""
        loop = self.loop
        velocity = loop.update(sample.force, sample.position, self._direction(since), sample.missed)
        self._arm.move(velocity)
        self._slid = self._slid or loop.sliding
        phase = CONTACT if loop.sliding else LOST if self._slid else APPROACH
        lasting = self.troubles.lasting(loop.trouble, sample.time)
        return Action(phase, float(velocity @ loop.normal), velocity, loop.bound, loop.trouble, lasting)
