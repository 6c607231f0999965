"""A tool that was weighed, on a simulated arm: its mass on the last link, its weight and inertia on the sensor."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace
from math import inf
from typing import NamedTuple, Protocol

import numpy as np

from palpate._vector import Vec3
from palpate.arrays import Array
from palpate.contact_frame import Payload
from palpate.contact_frame.tool_payload import side_of
from palpate.errors import InputError
from palpate.force.guard import BEYOND, DRIFTS, LATE, SWINGS, TROUBLES
from palpate.force.sliding.slide_state import AWAY, JERKS, LOST, REFUTED, SLIDING_TROUBLES, STEPPED
from palpate.press.cell import NO_TOOL, HeldTool
from palpate.robots.serial.chain import spread_of
from palpate.robots.serial.serial_arm import SerialArm


def held_tool(payload: Payload | None) -> HeldTool:
    """A tool as a sensor shows it, with the sign of a press.

    A weight that points down is that of a sensor that shows what the tool exerts on it: the opposite of a press.
    """
    if payload is None:
        return NO_TOOL
    sign = -(side_of(np.array(payload.weight)) or -1.0)
    follows = payload.mass if payload.inertia is None else payload.inertia
    return HeldTool(
        weight=sign * Vec3(*payload.weight),
        bias=sign * Vec3(*payload.bias),
        inertia=float(follows),
        centre=Vec3(*(payload.centre or (0.0, 0.0, 0.0))),
    )


def with_tool(arm: SerialArm, payload: Payload) -> SerialArm:
    """The arm with the tool's mass at its centre, on the last link; its control knows of it, as of any payload.

    How the mass spreads about its centre was not weighed, and is left out. A MuJoCo model that the arm was read from
    does not have the tool, and is left behind.
    """
    chain, last = arm.chain, arm.joints - 1
    mass = max(payload.mass, payload.inertia or 0.0)
    at = chain.tip + chain.tip_turn @ np.array(payload.centre or (0.0, 0.0, 0.0))
    whole = chain.mass[last] + mass
    com = (chain.mass[last] * chain.com[last] + mass * at) / whole
    moment = (
        chain.inertia[last]
        + _point(chain.mass[last], chain.com[last] - com)
        + _point(mass, at - com)
    )  # fmt: skip
    least, spread = spread_of(_change(chain.inertia, last, moment))
    loaded = chain._replace(
        mass=_change(chain.mass, last, whole),
        com=_change(chain.com, last, com),
        least=least,
        spread=spread,
    )
    return replace(arm, title=f"{arm.title} with a tool of {mass:.3g} kg", chain=loaded, scene=None)


def _point(mass: float, off: Array) -> Array:
    """Inertia of a point mass about a point that it is off from [kg m^2], shape (3, 3)."""
    return np.asarray(mass * (off @ off * np.eye(3) - np.outer(off, off)))


def _change(values: Array, i: int, value: float | Array) -> Array:
    new = values.copy()
    new[i] = value
    return new


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

    def desired(self, since: float) -> float:
        """Desired force at a time since the touch [N]: steady, in the middle third in steps down and up, steady."""
        third = self.seconds / 3.0
        if not third <= since < 2.0 * third:
            return self.force
        lowered = int((since - third) / (third / _STEPS)) % 2 == 0
        return self.force * (1.0 - self.probe * lowered)


def plan_for(force: float, seconds: float, probe: float, gap: float, speed: float) -> Plan:
    """A plan that looks for the surface three times as long as the way to it takes, and a second."""
    return Plan(force, seconds, probe, 1.0 + _PATIENCE * gap / speed)


class Sense(NamedTuple):
    """Readings of an arm at a tick, all in its base's axes."""

    time: float  # of the reading [s]
    force: Array  # wrench that the tip exerts on the environment: force [N], moment about the tip [N m], shape (6,)
    pose: Array  # of the tip, homogeneous, shape (4, 4)
    joints: Array  # positions [rad, m], shape (n,)


class Command(NamedTuple):
    """How the tip is to move until the next one: one of the two, the other None."""

    velocity: Array | None = None  # of the tip [m/s], and its turning [rad/s], in the base's axes, shape (6,)
    pose: Array | None = None  # of the tip, homogeneous, shape (4, 4)


class Wire(Protocol):
    """An arm on the other end of a wire, or in a simulation."""

    def read(self) -> Sense:
        """The readings at this tick; waits for the tick if the arm has its own clock."""
        ...

    def write(self, command: Command) -> None:
        """How the tip is to move from now on."""
        ...

    def close(self) -> None:
        """Leaves the arm at rest."""
        ...


_SLIDES = REFUTED, STEPPED, JERKS, LOST, AWAY
BORNE = {SLIDING_TROUBLES[code] for code in (LATE, DRIFTS, BEYOND, SWINGS, *_SLIDES)}
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
