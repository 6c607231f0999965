"""Sequence of every press and slide: from free motion to contact to the end.

A simulated arm and one over a wire are read and moved alike. A driver is the law between reading and motion.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from math import inf
from typing import TYPE_CHECKING, NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike

from palpate.arrays import Array
from palpate.bench.summary import APPROACH, CONTACT, LOST
from palpate.errors import InputError
from palpate.force.force_loop import ForceLoop
from palpate.force.gains import Gains
from palpate.press.at_rest import SETTLING_BAND, SURE
from palpate.press.troubles import Troubles

if TYPE_CHECKING:
    from palpate.force.sliding.sliding_loop import SlidingLoop
    from palpate.force.sliding.turning_tool import TurningTool


PROBE_STEPS = 6
"""Down and up again, three times."""
SEARCH_FACTOR = 3.0
"""Duration of the search for the surface, over that of the approach to where it should be."""


@dataclass(frozen=True)
class Plan:
    """The plan's numbers.

    Args:
        force: [N].
        seconds: of the hold, from where the force is reached on [s].
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
        """Desired force at a time of the hold [N]: steady, in the middle third in steps down and up, steady."""
        third = self.seconds / 3.0
        if not third <= since < 2.0 * third:
            return self.force
        lowered = int((since - third) / (third / PROBE_STEPS)) % 2 == 0
        return self.force * (1.0 - self.probe * lowered)


def plan_for(force: float, seconds: float, probe: float, gap: float, speed: float) -> Plan:
    """A plan that looks for the surface three times as long as the way to it takes, and a second."""
    return Plan(force, seconds, probe, 1.0 + SEARCH_FACTOR * gap / speed)


def mean_over(forces: Array, lag: float, tick: float) -> Array:
    """Running mean over a loop's lag [s], of which single readings' noise is no part; shape (n - lag/tick + 1,).

    Args:
        forces: one a tick [N], shape (n,).
        lag: theta [s].
        tick: [s].
    """
    width = max(round(lag / tick), 1)
    return np.convolve(forces, np.full(width, 1.0 / width), "valid") if len(forces) > width else forces


def lag_ticks(gains: Gains) -> int:
    """Ticks of the loop's lag theta, over which a force is averaged."""
    return max(round(gains.theta / gains.arm.tick), 1)


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
    """Law that moves the arm once a tick."""

    def step(self, sample: TipSample, desired: float, since: float) -> Action:
        """Press with the desired force [N], or look for the surface; `since` is the time of the hold [s]."""
        ...


class Tick(NamedTuple):
    """One tick of a sequence: readings, desired force [N], and result."""

    sample: TipSample
    desired: float
    action: Action


class ForceToReach(NamedTuple):
    """Force that a press has to reach before its hold begins.

    Args:
        force: desired [N].
        normal: into the surface, shape (3,).
        lag: of the loop, in ticks: over so many the force is averaged.
    """

    force: float
    normal: Array
    lag: int


class PressSequence:
    """A press or a slide, tick by tick.

    The hold begins where the mean force over the loop's lag reaches the settling band of the desired force in contact.
    Its clock stands still while contact is lost, and goes on when the force is reached in the next contact. A contact
    in which the force was never reached is none.

    Args:
        arm: what moves.
        driver: of that arm.
        desired: desired force [N] at a time of the hold [s].
        tick: of the arm [s].
        wanted: the force to reach; None where the driver's contact itself is a force that is held.
    """

    def __init__(
        self,
        arm: MovableArm,
        driver: PressDriver,
        desired: Callable[[float], float],
        tick: float,
        wanted: ForceToReach | None = None,
    ):
        self._arm, self._driver, self._desired, self._tick = arm, driver, desired, tick
        self._wanted = wanted
        self._forces = deque[float](maxlen=1 if wanted is None else wanted.lag)
        self._contact, self._count, self._ticks, self._last = 0, 0, 0, 0.0
        self.touch: TipSample | None = None
        """First reading of the contact in which the force was reached, or may be."""
        self.reached, self.touched, self.largest = False, False, 0.0
        """The force was reached in the present contact; in any; largest mean force over the lag [N]."""
        self.last_contact = 0
        """Ticks until the last one of a contact in which the force was reached; 0 before it."""

    @property
    def since(self) -> float:
        """Time of the hold [s]."""
        return self._ticks * self._tick

    @property
    def next_since(self) -> float:
        """Time of the hold at the next tick [s]."""
        return (self._ticks + self.reached) * self._tick

    @property
    def in_contact(self) -> int:
        """Ticks of the present contact."""
        return self._contact

    def tick(self) -> Tick:
        """Read the arm and move it."""
        sample = self._arm.read()
        if self.reached:
            self._ticks += round((sample.time - self._last) / self._tick)
        self._last = sample.time
        desired = self._desired(self.since)
        action = self._driver.step(sample, desired, self.since)
        self._note_contact(sample, action.phase == CONTACT)
        return Tick(sample, desired, action)

    def _note_contact(self, sample: TipSample, contact: bool) -> None:
        self._contact, self._count = self._contact + 1 if contact else 0, self._count + 1
        if contact and self.touch is None:
            self.touch = sample
        elif not contact and not self.touched:
            self.touch = None
        reached = self._is_force_reached(sample)
        self.reached = contact and (self.reached or reached)
        self.touched = self.touched or self.reached
        if self.reached:
            self.last_contact = self._count

    def _is_force_reached(self, sample: TipSample) -> bool:
        """True if the mean force over the loop's lag, all of it in contact, is in the band or above it."""
        if self._wanted is None:
            return True
        force, normal, lag = self._wanted
        self._forces.append(float(sample.force @ normal))
        mean = sum(self._forces) / lag
        self.largest = max(self.largest, mean)
        return self._contact >= lag and mean >= (1.0 - SETTLING_BAND) * force

    def shortfall(self, noise: float) -> str:
        """Sentence on the largest force, where the desired one was never reached.

        Args:
            noise: standard deviation of a reading in free motion [N].
        """
        if self._wanted is None:
            return "no surface was held"
        if self.largest <= SURE * noise:
            return "no surface was met"
        return f"the force of {self._wanted.force:g} N was never reached, {self.largest:.3g} N at most"


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
        loop, direction = self.loop, self._direction(since)
        if self._tool is None or sample.rotation is None:
            velocity = loop.update(sample.force, sample.position, direction, sample.missed)
            self._arm.move(velocity)
        else:
            twist = self._tool.update(
                sample.force, sample.position, sample.rotation, direction, sample.missed
            )
            velocity = twist[:3]
            self._arm.move(velocity, twist[3:])
        self._slid = self._slid or loop.sliding
        phase = CONTACT if loop.sliding else LOST if self._slid else APPROACH
        lasting = self.troubles.lasting(loop.trouble, sample.time)
        return Action(phase, float(velocity @ loop.normal), velocity, loop.bound, loop.trouble, lasting)
