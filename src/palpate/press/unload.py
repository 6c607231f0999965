"""Retreat from the surface at the end of every press and slide, simulated or over a wire, whatever ended it.

The tip was in free motion where it began, and a surface at rest stays where it is. So the retreat ends at free motion
where the force shows it: above the noise first, then within it, plus a clearance. A force that never does so is not
believed, and the retreat goes as far back as the tip was led into the surface: by its measured position, and by what
was commanded where there is none.
"""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from math import sqrt
from typing import Any, NamedTuple, Protocol

import numpy as np

from palpate.arrays import Array
from palpate.force.gains import Gains
from palpate.press.at_rest import SATURATED, SURE
from palpate.press.sequence import MovableArm, TipSample, lag_ticks

CLEARANCE = 0.002
"""Between the surface and the end of a simulated retreat [m]; less than the gap at the start."""
REST_LAGS = 3
"""Lags of the loop for which the tip comes to rest: a first-order lag then leaves e^-3 = 5 % of its way.

While the force still falls it is given as many again.
"""
SLOW = 10.0
"""Approach speeds that a stroke in free motion, and a retreat without haste, may have."""


class Glimpse(NamedTuple):
    """Readings of a tick of a retreat, as far as they can be believed.

    Args:
        force: along the normal, without its bias [N]; None if there is none.
        depth: of the tip from the start into the surface [m]; None if there is none.
    """

    force: float | None
    depth: float | None


class RetreatingArm(Protocol):
    """An arm that can be led out of a surface; none of its methods raises for a fault of the arm."""

    def glimpse(self) -> Glimpse:
        """The readings of this tick; waits for them no longer than a tick."""
        ...

    def retreat(self, velocity: Array) -> str | None:
        """Command a velocity out of the surface [m/s], shape (3,); the reason if it was not taken."""
        ...


@dataclass(frozen=True)
class RetreatPlan:
    """Speed, bounds and noise of a retreat.

    Args:
        gains: of the loop: tick, lag, and the sensor's low-pass.
        normal: into the surface, of unit length, shape (3,).
        speed: of the retreat [m/s].
        clearance: from where free motion is reached [m].
        depth: largest way into the surface since the start [m]; the retreat goes that far and the clearance, and on, up
            to twice that, while the measured position is still beyond the start.
        noise: standard deviation of a reading in free motion [N].
        force: desired force of the press [N]; half of it, met from behind, ends the retreat.
    """

    gains: Gains
    normal: Array
    speed: float
    clearance: float
    depth: float
    noise: float
    force: float

    @property
    def ticks(self) -> int:
        """Ticks in which the tip is led back by depth and clearance."""
        return int(np.ceil((self.depth + self.clearance) / (self.speed * self.gains.arm.tick) - 1e-9))

    @property
    def free_force(self) -> float:
        """Largest mean force over the loop's lag that is free motion [N]: eight standard deviations of that mean.

        Readings count as independent once the sensor's low-pass has forgotten the one before.
        """
        law = self.gains.cautious()
        independent = max(self.gains.theta / max(law.period, law.memory), 1.0)
        return SURE * self.noise / sqrt(independent)


@dataclass(frozen=True)
class Unloading:
    """Result of a retreat of the tip.

    Args:
        how: in words.
        distance: commanded way out of the surface [m].
        free: the force showed free motion at the end.
        completed: no command was refused, and nothing was met behind.
    """

    how: str
    distance: float = 0.0
    free: bool = False
    completed: bool = True

    def to_json(self) -> dict[str, Any]:
        """Sentence, distance and whether free motion was seen, as plain JSON values."""
        return {"how": self.how, "distance_m": self.distance, "free_motion": self.free}


HELD = Unloading("not unloaded: the tip rests in contact, as asked by --end hold")


class _Evidence:
    """Forces of a retreat, and what they show: a surface, free motion, or an obstacle behind."""

    def __init__(self, plan: RetreatPlan):
        self._plan, self._lag = plan, lag_ticks(plan.gains)
        self._forces, self._before = (deque[float](maxlen=self._lag) for _ in range(2))
        self._felt, self._lowest = False, 0.0
        self.behind: float | None = None
        """Force of an obstacle behind the tip [N]: grown in the retreat, against the press by half of its force."""

    def add(self, force: float | None, coasting: bool) -> None:
        """Take the force of a tick [N]; `coasting` while the arm may not have followed the retreat yet."""
        if force is None:
            return
        if len(self._forces) == self._lag:
            self._before.append(self._forces[0])
        self._forces.append(force)
        self._felt = self._felt or abs(force) > SURE * self._plan.noise
        if coasting:
            self._lowest = min(self._lowest, force)
        if force < self._lowest - 0.5 * max(self._plan.force, SURE * self._plan.noise):
            self.behind = force

    @property
    def mean(self) -> float | None:
        """Mean force over the loop's lag [N]; None of fewer readings."""
        return sum(self._forces) / self._lag if len(self._forces) == self._lag else None

    @property
    def falling(self) -> bool:
        """True if the force still falls, from lag to lag by more than it may be in free motion."""
        if self.mean is None or len(self._before) < self._lag or self.behind is not None:
            return False
        return sum(self._before) / self._lag - self.mean > self._plan.free_force

    @property
    def free(self) -> bool:
        """True if the force was above the noise and is within it."""
        return self._felt and self.mean is not None and abs(self.mean) <= self._plan.free_force

    def sentence(self) -> str:
        """Reach of a retreat that no fault has ended, in words."""
        if self.free:
            return "to free motion"
        if self._felt and self.mean is not None:
            return f"as far as it was led into the surface; the force is still {self.mean:.3g} N"
        return "without a believable force"


def unload(arm: RetreatingArm, plan: RetreatPlan) -> Unloading:
    """Lead the tip out of the surface, and let it come to rest: for some lags, and while the force still falls.

    Where it then is still beyond its start by its measured position, it is led on: an arm that accelerates slowly has
    not gone as far as it was commanded. Bounded in speed, distance and time by the plan. Ends early where a command is
    not taken, or where the tip meets a force from behind.
    """
    evidence, lag, step = _Evidence(plan), lag_ticks(plan.gains), plan.speed * plan.gains.arm.tick
    velocity, goal = -plan.speed * plan.normal, plan.ticks
    ticks = rested = 0
    free_way = depth = 0.0
    refused: str | None = None
    while refused is None and rested < (2 if evidence.falling else 1) * REST_LAGS * lag:
        force, position = arm.glimpse()
        evidence.add(force, ticks < lag)
        depth = (depth if rested else depth - step) if position is None else position
        free_way = free_way + step if evidence.free else 0.0
        arrived = free_way > plan.clearance or evidence.behind is not None
        if rested or ticks >= goal or arrived:
            refused, rested = arm.retreat(0.0 * velocity), rested + 1
        else:
            refused, ticks = arm.retreat(velocity), ticks + 1
        if rested == REST_LAGS * lag and depth > 0.0 and not arrived and goal == plan.ticks:
            goal, rested = min(ticks + int(np.ceil((depth + plan.clearance) / step)), 2 * plan.ticks), 0
    distance = ticks * step
    if refused is not None:
        return Unloading(f"could not unload: {refused}", distance, completed=False)
    how = f"retreated {1e3 * distance:.3g} mm"
    if evidence.behind is not None:
        return Unloading(
            f"{how}, and rests where {-evidence.behind:.3g} N met it from behind", distance, completed=False
        )
    return Unloading(f"{how} {evidence.sentence()}", distance, evidence.free)


def simulated_retreat(gains: Gains, normal: Array, depth: float, force: float) -> RetreatPlan:
    """Plan of the retreat of a simulated arm: ten times as fast as its approach.

    Args:
        gains: of the loop.
        normal: into the surface, of unit length, shape (3,).
        depth: largest way into the surface since the start [m].
        force: desired force of the press or slide [N].
    """
    return RetreatPlan(
        gains=gains,
        normal=normal,
        speed=min(SLOW * gains.approach, gains.arm.limits.speed),
        clearance=CLEARANCE,
        depth=max(depth, 0.0),
        noise=gains.arm.sensor.noise,
        force=force,
    )


class SimulatedRetreat:
    """A simulated arm in its retreat.

    Args:
        arm: what moves.
        plan: of the retreat.
        start: of the tip before the press or slide [m], shape (3,).
        keep_row: called with the readings and the velocity of each tick after it; false if a row is no finite number.
        bias: of the sensor along the normal, which is taken off its readings [N].
    """

    def __init__(
        self,
        arm: MovableArm,
        plan: RetreatPlan,
        start: Array,
        keep_row: Callable[[TipSample, Array], bool],
        bias: float = 0.0,
    ):
        self._arm, self._plan, self._start, self._keep_row, self._bias = arm, plan, start, keep_row, bias

    def glimpse(self) -> Glimpse:
        """The readings of this tick; no force of a saturated sensor."""
        self._sample, normal = self._arm.read(), self._plan.normal
        force = float(normal @ self._sample.force)
        saturated = abs(force + self._bias) >= SATURATED * self._plan.gains.arm.sensor.full_scale
        return Glimpse(None if saturated else force, float(normal @ (self._sample.position - self._start)))

    def retreat(self, velocity: Array) -> str | None:
        """Move the tip for a tick [m/s], shape (3,)."""
        self._arm.move(velocity)
        return None if self._keep_row(self._sample, velocity) else "the simulated arm has diverged"
