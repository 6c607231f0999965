"""Order of a press over a wire, with its limits; checked against the gains before anything moves."""

import math
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from palpate._vector import Vec3
from palpate.arrays import Array
from palpate.errors import InputError, unknown
from palpate.force import ForceLoop, SlidingLoop
from palpate.force.gains import Gains
from palpate.force.sliding.paths import directions, duration
from palpate.force.sliding.slide_domain import numbers_of
from palpate.force.sliding.slide_state import beside
from palpate.press.at_rest import TARE
from palpate.press.free_stroke import StrokePlan
from palpate.press.sequence import Plan
from palpate.press.unload import REST_LAGS, SLOW
from palpate.wires.wire import Triple, triple


@dataclass(frozen=True)
class PressLimits:
    """Limits that end a press; the user gives all of them.

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
        for name, unit, limit in (
            ("force", "N", 1e4),
            ("speed", "m/s", 1.0),
            ("travel", "m", 2.0),
            ("seconds", "s", 3600.0),
        ):
            value = getattr(self, name)
            if not 0.0 < value <= limit:
                raise InputError(
                    f"the {name} limit must be above 0 and at most {limit:g} {unit}, got {value:g}"
                )


@dataclass(frozen=True)
class Path:
    """A path along a surface.

    Args:
        name: line, back, raster or circle.
        length: of a line or a pass, radius of a circle [m].
        seconds: of the slide, at most; a line ends at its length [s].
    """

    name: str
    length: float
    seconds: float

    def duration(self, gains: Gains) -> float:
        """Duration of the slide [s] at the speed of the gains."""
        return duration(self.name, self.seconds, numbers_of(gains).speed, self.length)

    def directions(self, gains: Gains, into: Array) -> Array:
        """Unit vectors in the base's axes for each tick, shape (n, 3).

        Args:
            gains: with a table `slide`.
            into: direction into the surface, of unit length, shape (3,).
        """
        e1 = np.array(beside(Vec3(*into.tolist())))  # type: ignore[no-untyped-call]
        ways = directions(
            self.name, self.duration(gains), gains.arm.rate, numbers_of(gains).speed, self.length
        )
        return np.asarray(ways @ np.array([e1, np.cross(e1, into), -into]))


ENDS = ("retreat", "hold")


@dataclass(frozen=True)
class PressTask:
    """Task of a press: force, direction, duration, path.

    Args:
        force: F_d [N].
        direction: into the surface, of unit length in the base.
        hold: how long to press from where the force is reached on [s].
        retreat: clearance of the retreat from the surface [m].
        probe: share of the force by which it is lowered now and then.
        path: along the surface; None for a press.
        end: retreat or hold: what follows the hold. Every other end is a retreat.
        free_stroke: length of a stroke before the press, away from the surface and back [m]; 0 for none.

    Raises:
        InputError: a probe that is no share, a hold that is no time, another end.
    """

    force: float
    direction: Triple
    hold: float
    retreat: float
    probe: float = 0.0
    path: Path | None = None
    end: Literal["retreat", "hold"] = "retreat"
    free_stroke: float = 0.0

    def __post_init__(self) -> None:
        self.plan  # noqa: B018 - it refuses what it cannot be
        if self.end not in ENDS:
            raise unknown("end", self.end, ENDS)

    @property
    def plan(self) -> Plan:
        """The force at each time since the touch."""
        return Plan(self.force, self.hold, self.probe)


@dataclass(frozen=True)
class Order:
    """A press that was checked: what to do with which gains, within which limits.

    Args:
        loop: of the arm, its desired force set.
        task: what to do, the direction of unit length.
        limits: what ends it.
    """

    loop: ForceLoop
    task: PressTask
    limits: PressLimits

    @property
    def most(self) -> int:
        """Readings that there may be: a fifth more than the time limit's, for an arm that runs a little fast."""
        seconds = self.limits.seconds + self.retreat_time
        return int(1.2 * seconds * self.loop.gains.arm.rate) + 1000

    @property
    def slow_speed(self) -> float:
        """Speed of the retreat after a hold, during which the stop conditions are watched [m/s].

        Half the limit: of an arm that does not stamp its positions, a late one shows the way of several ticks.
        """
        return min(0.5 * self.limits.speed, SLOW * self.loop.gains.approach)

    @property
    def stroke(self) -> StrokePlan | None:
        """The free stroke before the press, as slow as its retreat and as F_max demands; None without one."""
        task, gains = self.task, self.loop.gains
        if not task.free_stroke:
            return None
        speed = min(self.slow_speed, gains.speed_at(task.force))
        return StrokePlan(np.array(task.direction), task.free_stroke, speed, gains, task.force)

    @property
    def retreat_time(self) -> float:
        """Longest time of a retreat [s]: back by twice the travel limit and the clearance, slowly, and the rest."""
        distance = 2.0 * (self.limits.travel + self.task.retreat)
        return distance / self.slow_speed + 3 * REST_LAGS * self.loop.gains.theta

    @property
    def jitter(self) -> float | None:
        """Delay of a reading that the certificate allows [s]; None if no certificate covers the adapting law."""
        certificate = self.loop.certificate
        if certificate is None:
            return None
        gains = certificate.proved_gains
        ticks = max((c.jitter(gains) for c in certificate.claims if c.kind == "adapting"), default=None)
        return None if ticks is None else ticks * self.loop.gains.arm.tick


STROKE_FRACTION = 0.9
"""Largest free stroke over the travel limit: the tip of a position arm goes a little beyond its command."""


def stiffest_contact(gains: Gains) -> float:
    """The stiffest surface of the gains in series with what gives way behind a command [N/m].

    Of a torque arm the surface alone: a wire's controller has a spring of its own.
    """
    return gains.cap if gains.arm.kind == "torque" else gains.arm.seen(gains.cap)


def safe_travel(gains: Gains, force: float) -> float:
    """Travel within which no surface of the gains is pressed with more than a force, whatever the sensor shows [m].

    Args:
        gains: of the loop; their cap is the stiffest surface.
        force: that is allowed [N].
    """
    return force / stiffest_contact(gains)


def check_order(loop: ForceLoop, task: PressTask, limits: PressLimits) -> Order:
    """The request as an order, its direction of unit length; refused where it contradicts the gains.

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
    if gains.force_max is not None and not limits.force < gains.force_max:
        raise InputError(
            f"the force limit must lie below F_max = {gains.force_max:g} N of the gains, got {limits.force:g} N; lower "
            "it, or tune with a higher --force-max"
        )
    if not gains.approach <= limits.speed <= gains.arm.limits.speed:
        raise InputError(
            f"the speed limit must lie between the certified approach of {1e3 * gains.approach:.3g} mm/s and the arm's"
            f" {1e3 * gains.arm.limits.speed:g} mm/s, got {1e3 * limits.speed:g} mm/s; at twice the limit the arm stops"
        )
    if not 0.0 <= task.free_stroke <= STROKE_FRACTION * limits.travel:
        raise InputError(
            f"--free-stroke must be from 0 to {STROKE_FRACTION:g} of the travel limit of {1e3 * limits.travel:.3g} mm"
        )
    stroke = Order(loop, task, limits).stroke
    before = TARE if stroke is None else TARE + stroke.seconds
    if not (task.hold > 0.0 and task.hold + before < limits.seconds):
        raise InputError(
            f"--seconds must be above 0 and leave time for rest, free stroke ({before:.2g} s) and approach within the"
            f" limit of {limits.seconds:g} s"
        )
    if not 0.0 <= task.retreat <= limits.travel:
        raise InputError(f"--retreat must be from 0 to the travel limit of {1e3 * limits.travel:g} mm")
    loop.desired = task.force
    if gains.arm.kind == "servo":  # its lead has to know what the limit takes off
        loop.limit_speed(limits.speed)
    task = replace(task, direction=triple(np.array(task.direction) / size))
    if task.path is not None:
        _check_path(task.path, gains, task, limits)
        task = replace(task, hold=task.path.duration(gains))
    return Order(loop, task, limits)


def _check_path(path: Path, gains: Gains, task: PressTask, limits: PressLimits) -> None:
    speed, into = numbers_of(gains).speed, np.array(task.direction)
    SlidingLoop(gains, into)  # compiled before the arm is read
    if speed > limits.speed:
        raise InputError(
            f"the slide's {1e3 * speed:g} mm/s are above the speed limit of {1e3 * limits.speed:g} mm/s; tune for a "
            "slower slide"
        )
    ways = path.directions(gains, into)
    reach = float(np.linalg.norm(speed * gains.arm.tick * ways.cumsum(axis=0), axis=1).max())
    if not reach <= limits.travel:
        raise InputError(
            f"the path reaches {1e3 * reach:.3g} mm from its start, beyond the travel limit of "
            f"{1e3 * limits.travel:.3g} mm; raise --travel-limit, or make --length smaller"
        )
