"""A simulated press: its drivers, and its record."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from palpate._vector import ZERO3, Vec3, Vec6
from palpate.arrays import Array
from palpate.bench.summary import (
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
from palpate.force.force_loop import ForceLoop
from palpate.force.gains import Gains
from palpate.press.sequence import Action, CautiousDriver, Plan, PressDriver, PressSequence, Tick, TipSample
from palpate.press.setting import Place
from palpate.press.simulated_arm import SimulatedArm
from palpate.records import Record
from palpate.signals.types import Task, alike, triple

CAUTIOUS = "cautious"
CONTROLLERS = (CAUTIOUS, "hybrid", "proportional-integral", "impedance")
_POSITION, _RATE = 400.0, 40.0
"""K_pp [1/s^2] and K_pv [1/s] of the directions that hold their place: 3 Hz, critically damped."""
_BANDWIDTH = 0.25
"""Of the proportional-integral controller [Hz]: a fifth of B/m, what a surface of 50 N s/m and a tip of 6 kg bear."""
_GIVING = 2000.0
"""Stiffness of the impedance [N/m]."""


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
        self._at, self._gone, self._phase = triple(at), 0.0, APPROACH
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

    def step(self, sample: TipSample, desired: float, since: float) -> Action:
        """One tick, as `PressDriver` describes it."""
        force = float(sample.force @ self._normal)
        if self._phase == CONTACT and force <= 0.0:
            self._phase = LOST
            self._at = self._at._replace(x=float(self._normal @ sample.position))
            self._gone = 0.0
        elif force > self._switch:
            self._phase = CONTACT
        nothing = _six(0.0)
        if self._phase == CONTACT:
            at: Any = Vec6(self._at, ZERO3)
            s: Any = Vec6(Vec3(1.0, 0.0, 0.0), ZERO3)
            self._arm.act(self._controller, Task(at, nothing, nothing, desired * s, s))
            return Action(CONTACT, 0.0, 0.0 * self._normal, 0.0)
        self._gone += self._arm.loop.tick * self._speed
        x: Any = Vec6(self._at + Vec3(self._gone, 0.0, 0.0), ZERO3)
        xd: Any = Vec6(Vec3(self._speed, 0.0, 0.0), ZERO3)
        self._arm.act(self._approach, Task(x, xd, nothing, nothing, nothing))
        return Action(self._phase, self._speed, self._speed * self._normal, 0.0)


def driver_of(name: str, arm: SimulatedArm, gains: Gains, place: Place, force: float) -> PressDriver:
    """The driver of that name.

    Raises:
        InputError: no such controller; one of torques on an arm of positions.
    """
    if name == CAUTIOUS:
        return CautiousDriver(arm, ForceLoop(gains), place.normal)
    if name not in CONTROLLERS:
        raise unknown("controller", name, CONTROLLERS)
    if gains.arm.kind != "torque":
        raise InputError(f"--controller {name} gives torques, and the arm takes positions; add --mode torque")
    return ByTorque(arm, place, name, gains.approach, 8.0 * gains.arm.sensor.noise, force)


def _six(value: float) -> Any:
    """The same number in six directions; the types of tasks and controllers name those of three."""
    return Vec6(alike(value), alike(value))


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
    arm: SimulatedArm, driver: PressDriver, place: Place, plan: Plan, progress: Progress | None = None
) -> Record:
    """Approaches, touches, presses.

    Args:
        arm: simulated.
        driver: of the arm.
        place: where.
        plan: of the force.
        progress: called now and then with the time [s] and the phase; may raise KeyboardInterrupt to end the press.

    Returns:
        One row a tick; ``meta["end"]`` says why it ended, ``meta["why"]`` in a sentence.
    """
    rows, sequence = _Rows(arm.arm.joints), PressSequence(arm, driver, plan.force_at, arm.loop.tick)
    ending, k = None, 0
    while ending is None:
        try:
            tick = sequence.tick()
            if progress is not None and k % _SHOWN == 0:
                progress(k * arm.loop.tick, tick.action.trouble or PHASES[tick.action.phase])
        except KeyboardInterrupt:
            ending = Ending(INTERRUPTED, f"interrupted at {k * arm.loop.tick:.3f} s")
            break
        row = _row(arm, place, tick, sequence.touch, k * arm.loop.tick)
        ending = _judge(arm, plan, row, tick.action, sequence, k)
        if np.isfinite(row).all():
            rows.rows.append(row)
        k += 1
    return _record(arm, rows, ending)


def _row(arm: SimulatedArm, place: Place, tick: Tick, touch: TipSample | None, time: float) -> Array:
    (_, force, position, _), action, truth = tick.sample, tick.action, arm.truth
    seen, pressing = place.axes @ position, action.phase == CONTACT
    true = place.axes @ arm.arm.forward_kinematics(truth.q)[:3, 3] if np.isfinite(truth.q).all() else seen
    reading = float(place.normal @ force)
    moved = seen[0] - float(place.normal @ touch.position) if touch is not None and pressing else 0.0
    numbers = [
        [time, action.phase], truth.q, truth.qd, true, seen, [action.speed],
        [truth.force, reading, reading, tick.desired * pressing], truth.torque, truth.saturated,
        [truth.depth, float(truth.touching), moved, action.bound],
    ]  # fmt: skip
    return np.concatenate([np.asarray(part, dtype=float) for part in numbers])


def _judge(
    arm: SimulatedArm, plan: Plan, row: Array, action: Action, sequence: PressSequence, k: int
) -> Ending | None:
    tick, robot = arm.loop.tick, arm.arm
    if not np.isfinite(row).all():
        return Ending(DIVERGED, f"the arm's motion is no finite number from {k * tick:.3f} s on")
    q = row[2 : 2 + robot.joints]
    beyond = np.flatnonzero((q < robot.lower) | (q > robot.upper))
    if len(beyond):
        return Ending(
            JOINT_LIMIT, f"{robot.names[beyond[0]]} reached the end of its range at {k * tick:.3f} s"
        )
    if action.ended is not None:
        return Ending(TROUBLE, f"{action.ended}; at {k * tick:.3f} s")
    if sequence.touch is None:
        late = (k + 1) * tick >= plan.longest
        return Ending(NO_CONTACT, f"no surface was felt within {plan.longest:.3g} s") if late else None
    if sequence.next_since < plan.seconds:
        return None
    if action.phase != CONTACT:
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
