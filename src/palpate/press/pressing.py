"""A simulated press: its drivers, and the march from free motion to contact to end."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, NamedTuple, Protocol

import numpy as np

from palpate._vector import ZERO3, Vec3, Vec6
from palpate.arrays import Array
from palpate.bench.force_input import (
    APPROACH,
    CONTACT,
    DIVERGED,
    DONE,
    INTERRUPTED,
    LOST,
    LOST_CONTACT,
    NO_CONTACT,
    Ending,
)
from palpate.controllers import Hybrid, Impedance, ProportionalIntegral, ResolvedAcceleration
from palpate.controllers.proportional_integral import integral_gain
from palpate.errors import InputError, unknown
from palpate.force import ForceLoop
from palpate.force.gains import Gains
from palpate.press.setting import Place
from palpate.press.simulated_arm import SimulatedArm
from palpate.press.tool import Command, Plan, Sense, Troubles, Wire
from palpate.records import Record
from palpate.signals.types import Task

CAUTIOUS = "cautious"
CONTROLLERS = (CAUTIOUS, "hybrid", "proportional-integral", "impedance")
_POSITION, _RATE = 400.0, 40.0
"""K_pp [1/s^2] and K_pv [1/s] of the directions that hold their place: 3 Hz, critically damped."""
_BANDWIDTH = 0.25
"""Of the proportional-integral controller [Hz]: a fifth of B/m, what a surface of 50 N s/m and a tip of 6 kg bear."""
_GIVING = 2000.0
"""Stiffness of the impedance [N/m]."""


class Acted(NamedTuple):
    """The command of a tick."""

    phase: float
    speed: float  # asked of the tip along the normal [m/s]
    bound: float  # K_u of the cautious law [N/m]; 0 where there is none
    trouble: str = ""  # of the law in this tick
    ended: str | None = None  # by a trouble that lasts


class Pilot(Protocol):
    """Acts once a tick."""

    def step(self, sense: Sense, desired: float) -> Acted:
        """Presses with the desired force [N], or looks for the surface."""
        ...


class Cautious:
    """`palpate.force.ForceLoop` along a normal, over any wire.

    Args:
        wire: the arm.
        gains: of the law.
        normal: into the surface, in the base's axes, shape (3,).
    """

    def __init__(self, wire: Wire, gains: Gains, normal: Array):
        self._wire, self._normal, self.loop = wire, normal, ForceLoop(gains)
        self._touched = False
        self._troubles = Troubles(gains.theta, lambda _: None)

    def step(self, sense: Sense, desired: float) -> Acted:
        """One tick, as `Pilot` describes it."""
        self.loop.desired = desired
        force, place = float(sense.force[:3] @ self._normal), float(self._normal @ sense.pose[:3, 3])
        speed = self.loop.update(force, place)
        self._wire.write(Command(velocity=np.concatenate([speed * self._normal, np.zeros(3)])))
        pressing = self.loop.phase != "free motion"
        self._touched = self._touched or pressing
        phase = CONTACT if pressing else LOST if self._touched else APPROACH
        estimate = self.loop.estimate
        bound = estimate.bound if estimate is not None else self.loop.gains.seen_cap
        trouble = self.loop.trouble
        return Acted(phase, speed, bound, trouble, self._troubles.lasting(trouble, sense.time))


class ByTorque:
    """A controller of `palpate.controllers` in six directions on the simulated arm: it approaches, and then presses.

    Args:
        arm: of torques.
        place: where it starts.
        controller: by name.
        speed: of the approach [m/s].
        switch: reading above which the controller takes over, eight deviations of the noise [N].
        force: that the impedance's target is placed for [N].
    """

    def __init__(
        self, arm: SimulatedArm, place: Place, controller: str, speed: float, switch: float, force: float
    ):
        self._arm, self._normal, self._speed, self._switch = arm, place.normal, speed, switch
        at = place.axes @ place.pose[:3, 3]
        self._at, self._gone, self._phase = Vec3(*map(float, at)), 0.0, APPROACH
        self._approach = ResolvedAcceleration(_six(_POSITION), _six(_RATE))
        self._controller = self._make(controller, place.place, force)

    def _make(self, name: str, surface: float, force: float) -> Any:
        tick = self._arm.loop.tick
        held, rate, none = _six(_POSITION), _six(_RATE), _six(0.0)
        if name == "hybrid":
            return Hybrid(held, rate, _six(1.0), _six(0.003))
        if name == "proportional-integral":
            return ProportionalIntegral(held, rate, none, _six(integral_gain(_BANDWIDTH)), tick)
        if name == "impedance":
            inner: Any = self._arm.loop.inner  # of torques, so that it has a mass
            damping = 1.4 * float(np.sqrt(_GIVING * inner.mass))
            target: Any = Vec6(Vec3(surface + force / _GIVING, self._at.y, self._at.z), ZERO3)
            return Impedance(_six(inner.mass), _six(damping), _six(_GIVING), target)
        raise unknown("controller", name, CONTROLLERS)

    def step(self, sense: Sense, desired: float) -> Acted:
        """One tick, as `Pilot` describes it."""
        force = float(sense.force[:3] @ self._normal)
        if self._phase == CONTACT and force <= 0.0:
            self._phase = LOST
            self._at = self._at._replace(x=float(self._normal @ sense.pose[:3, 3]))
            self._gone = 0.0
        elif force > self._switch:
            self._phase = CONTACT
        nothing = _six(0.0)
        if self._phase == CONTACT:
            at: Any = Vec6(self._at, ZERO3)
            s: Any = Vec6(Vec3(1.0, 0.0, 0.0), ZERO3)
            self._arm.act(self._controller, Task(at, nothing, nothing, desired * s, s))
            return Acted(CONTACT, 0.0, 0.0)
        self._gone += self._arm.loop.tick * self._speed
        x: Any = Vec6(self._at + Vec3(self._gone, 0.0, 0.0), ZERO3)
        xd: Any = Vec6(Vec3(self._speed, 0.0, 0.0), ZERO3)
        self._arm.act(self._approach, Task(x, xd, nothing, nothing, nothing))
        return Acted(self._phase, self._speed, 0.0)


def pilot_of(name: str, arm: SimulatedArm, gains: Gains, place: Place, force: float) -> Pilot:
    """The pilot of that name.

    Raises:
        InputError: no such controller; one of torques on an arm of positions.
    """
    if name == CAUTIOUS:
        return Cautious(arm, gains, place.normal)
    if name not in CONTROLLERS:
        raise unknown("controller", name, CONTROLLERS)
    if gains.arm.kind != "torque":
        raise InputError(f"--controller {name} gives torques, and the arm takes positions; add --mode torque")
    return ByTorque(arm, place, name, gains.approach, 8.0 * gains.arm.sensor.noise, force)


def _six(value: float) -> Any:
    """The same number in six directions; the types of tasks and controllers name those of three."""
    one = Vec3(float(value), float(value), float(value))
    return Vec6(one, one)


Progress = Callable[[float, str], None]

PHASES = {APPROACH: "approach", CONTACT: "contact", LOST: "lost contact"}
JOINT_LIMIT, TROUBLE = "joint limit", "trouble"
_SHOWN = 200
"""Ticks between two looks at the progress."""


@dataclass
class _Rows:
    joints: int
    rows: list[Array] = field(default_factory=list)

    def columns(self) -> dict[str, str]:
        n = range(1, self.joints + 1)
        return {
            "t": "s",
            "phase": "1",
            **{f"q{i}": "rad" for i in n},
            **{f"qd{i}": "rad/s" for i in n},
            "x": "m",  # true place of the tip along the normal, from the base
            "y": "m",  # along the surface
            "z": "m",
            "x_measured": "m",
            "y_measured": "m",
            "z_measured": "m",
            "speed_desired": "m/s",
            "force": "N",  # true, mean of the tick
            "force_sampled": "N",  # as the sensor gave it last
            "force_measured": "N",
            "force_desired": "N",
            **{f"torque{i}": "N m" for i in n},
            **{f"saturated{i}": "1" for i in n},
            "penetration": "m",
            "touching": "1",
            "displacement": "m",  # measured x from the touch on
            "K_bound": "N/m",  # K_u of the cautious law
        }


def press(
    arm: SimulatedArm, pilot: Pilot, place: Place, plan: Plan, progress: Progress | None = None
) -> Record:
    """Approaches, touches, presses.

    Args:
        arm: simulated.
        pilot: who presses.
        place: where.
        plan: what is asked for.
        progress: called now and then with the time [s] and the phase; may raise KeyboardInterrupt to end the press.

    Returns:
        One row a tick; ``meta["end"]`` says why it ended, ``meta["why"]`` in a sentence.
    """
    rows = _Rows(arm.arm.joints)
    touched, tick = None, arm.loop.tick
    ending, k, origin = None, 0, 0.0
    while ending is None:
        sense = arm.read()
        since = 0.0 if touched is None else (k - touched) * tick
        desired = plan.desired(since)
        try:
            acted = pilot.step(sense, desired)
            if progress is not None and k % _SHOWN == 0:
                progress(k * tick, acted.trouble or PHASES[acted.phase])
        except KeyboardInterrupt:
            ending = Ending(INTERRUPTED, f"interrupted at {k * tick:.3f} s")
            break
        if touched is None and acted.phase == CONTACT:
            touched, origin = k, float(place.normal @ sense.pose[:3, 3])
        row = _row(arm, place, sense, acted, desired if acted.phase == CONTACT else 0.0, origin, k)
        ending = _judge(arm, plan, row, acted, touched, k)
        if np.isfinite(row).all():
            rows.rows.append(row)
        k += 1
    return _record(arm, rows, ending)


def _row(
    arm: SimulatedArm, place: Place, sense: Any, acted: Acted, desired: float, origin: float, k: int
) -> Array:
    truth = arm.truth
    seen = place.axes @ sense.pose[:3, 3]
    true = place.axes @ arm.arm.forward_kinematics(truth.q)[:3, 3] if np.isfinite(truth.q).all() else seen
    reading = float(place.normal @ sense.force[:3])
    moved = seen[0] - origin if acted.phase == CONTACT else 0.0
    numbers = [
        [k * arm.loop.tick, acted.phase], truth.q, truth.qd, true, seen, [acted.speed],
        [truth.force, reading, reading, desired], truth.torque, truth.saturated,
        [truth.depth, float(truth.touching), moved, acted.bound],
    ]  # fmt: skip
    return np.concatenate([np.asarray(part, dtype=float) for part in numbers])


def _judge(
    arm: SimulatedArm, plan: Plan, row: Array, acted: Acted, touched: int | None, k: int
) -> Ending | None:
    tick = arm.loop.tick
    if not np.isfinite(row).all():
        return Ending(DIVERGED, f"the arm's motion is no finite number from {k * tick:.3f} s on")
    q, robot = row[2 : 2 + arm.arm.joints], arm.arm
    beyond = np.flatnonzero((q < robot.lower) | (q > robot.upper))
    if len(beyond):
        return Ending(
            JOINT_LIMIT, f"{robot.names[beyond[0]]} reached the end of its range at {k * tick:.3f} s"
        )
    if acted.ended is not None:
        return Ending(TROUBLE, f"{acted.ended}; at {k * tick:.3f} s")
    if touched is None:
        late = (k + 1) * tick >= plan.longest
        return Ending(NO_CONTACT, f"no surface was felt within {plan.longest:.3g} s") if late else None
    if (k + 1 - touched) * tick < plan.seconds:
        return None
    if acted.phase != CONTACT:
        return Ending(LOST_CONTACT, "the surface was lost, and not in contact at the end")
    return Ending(DONE, "as asked for")


def _record(arm: SimulatedArm, rows: _Rows, ending: Ending) -> Record:
    units = rows.columns()
    for i, slides in enumerate(arm.arm.chain.slide, start=1):
        if slides:
            units |= {f"q{i}": "m", f"qd{i}": "m/s", f"torque{i}": "N"}
    table = np.array(rows.rows).reshape(-1, len(units))
    columns = {name: np.ascontiguousarray(table[:, i]) for i, name in enumerate(units)}
    return Record(columns, units, {"end": ending.end, "why": ending.why})
