"""A simulated press, from its approach to its retreat, and its record."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from palpate.arrays import Array
from palpate.bench import summary
from palpate.force.gains import Gains
from palpate.press.sequence import (
    Action,
    ForceToReach,
    Plan,
    PressDriver,
    PressSequence,
    Tick,
    TipSample,
    lag_ticks,
)
from palpate.press.setting import Place
from palpate.press.simulated_arm import SimulatedArm
from palpate.press.unload import HELD, SimulatedRetreat, Unloading, simulated_retreat, unload
from palpate.records import Record

Progress = Callable[[float, str], None]

JOINT_LIMIT, TROUBLE, NOT_REACHED = "joint limit", "trouble", "force not reached"
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
    arm: SimulatedArm,
    driver: PressDriver,
    place: Place,
    plan: Plan,
    gains: Gains,
    progress: Progress | None = None,
    end: str = "retreat",
) -> Record:
    """Approach, touch, press, and retreat from the surface, whatever ended the press.

    Args:
        arm: at its start.
        driver: of the arm.
        place: pose at the start, and the surface before it.
        plan: of the force.
        gains: of the arm: lag, noise, and speed of the approach, ten times which is that of the retreat.
        progress: called now and then with the time [s] and the phase; may raise KeyboardInterrupt to end the press.
        end: hold, to rest in contact after a press that is done; else retreat.

    Returns:
        One row a tick; ``meta["end"]`` says why it ended, ``meta["why"]`` in a sentence, ``meta["unloaded"]`` how.

    Raises:
        KeyboardInterrupt: of `progress`, before there is a row.
    """
    rows = _Rows(arm.arm.joints)
    goal = ForceToReach(plan.force, place.normal, lag_ticks(gains))
    sequence = PressSequence(arm, driver, plan.force_at, arm.loop.tick, goal)
    ending, k = None, 0
    while ending is None:
        try:
            tick = sequence.tick()
            if progress is not None and k % _SHOWN == 0:
                progress(k * arm.loop.tick, tick.action.trouble or summary.PHASES[tick.action.phase])
        except KeyboardInterrupt:
            if not rows.rows:
                raise
            ending = summary.Ending(summary.INTERRUPTED, f"interrupted at {k * arm.loop.tick:.3f} s")
            break
        row = _row(arm, place, tick, sequence.touch, k * arm.loop.tick)
        ending = _judge(arm, plan, row, tick.action, sequence, k)
        if np.isfinite(row).all():
            rows.rows.append(row)
        k += 1
    unloading = HELD
    if ending.end == summary.DIVERGED:
        unloading = Unloading("could not unload: the simulated arm has diverged", completed=False)
    elif ending.end != summary.DONE or end != "hold":
        unloading = _unload(arm, place, gains, plan.force, rows)
    return _record(arm, rows, ending, unloading, touched=sequence.touched)


def _unload(arm: SimulatedArm, place: Place, gains: Gains, force: float, rows: _Rows) -> Unloading:
    """Retreat along the normal, as a press over a wire does; each tick is a row."""

    def keep_row(sample: TipSample, velocity: Array) -> bool:
        action = Action(summary.RETREAT, float(place.normal @ velocity), velocity, 0.0)
        row = _row(arm, place, Tick(sample, 0.0, action), None, sample.time)
        if not np.isfinite(row).all():
            return False
        rows.rows.append(row)
        return True

    arm.hold_place()
    start = place.pose[:3, 3]
    plan = simulated_retreat(gains, place.normal, float(place.normal @ (arm.pose[:3, 3] - start)), force)
    return unload(SimulatedRetreat(arm, plan, start, keep_row, arm.zero), plan)


def _row(arm: SimulatedArm, place: Place, tick: Tick, touch: TipSample | None, time: float) -> Array:
    (_, force, position, *_), action, truth = tick.sample, tick.action, arm.truth
    tip, pressing = place.axes @ position, action.phase == summary.CONTACT
    true = place.axes @ arm.arm.forward_kinematics(truth.q)[:3, 3] if np.isfinite(truth.q).all() else tip
    reading = float(place.normal @ force)
    displacement = tip[0] - float(place.normal @ touch.position) if touch is not None and pressing else 0.0
    known = [truth.force, reading, reading, tick.desired * pressing]
    state = [truth.depth, float(truth.touching), displacement, action.bound]
    about = (time, action.phase)
    parts = (about, truth.q, truth.qd, true, tip, action.speed, known, truth.torque, truth.saturated, state)
    return np.hstack(parts)


def _judge(
    arm: SimulatedArm, plan: Plan, row: Array, action: Action, sequence: PressSequence, k: int
) -> summary.Ending | None:
    tick, robot = arm.loop.tick, arm.arm
    if not np.isfinite(row).all():
        return summary.Ending(
            summary.DIVERGED, f"the arm's motion is no finite number from {k * tick:.3f} s on"
        )
    q = row[2 : 2 + robot.joints]
    beyond = np.flatnonzero((q < robot.lower) | (q > robot.upper))
    if len(beyond):
        return summary.Ending(
            JOINT_LIMIT, f"{robot.names[beyond[0]]} reached the end of its range at {k * tick:.3f} s"
        )
    if action.ended is not None:
        return summary.Ending(TROUBLE, f"{action.ended}; at {k * tick:.3f} s")
    if sequence.reached:
        done = sequence.next_since >= plan.seconds
        return summary.Ending(summary.DONE, "as asked for") if done else None
    if sequence.in_contact:
        late = sequence.in_contact * tick >= max(plan.longest, plan.seconds)
        shortfall = sequence.shortfall(arm.loop.sensor.noise)
        return summary.Ending(NOT_REACHED, f"{shortfall}, within {k * tick:.3g} s") if late else None
    if (k + 1 - sequence.last_contact) * tick < plan.longest:
        return None
    if sequence.touched:
        return summary.Ending(
            summary.LOST_CONTACT, f"the surface was lost, and not met again within {plan.longest:.3g} s"
        )
    return summary.Ending(summary.NO_CONTACT, f"no surface was felt within {plan.longest:.3g} s")


def _record(
    arm: SimulatedArm, rows: _Rows, ending: summary.Ending, unloading: Unloading, *, touched: bool
) -> Record:
    units = rows.columns()
    for i, slides in enumerate(arm.arm.chain.slide, start=1):
        if slides:
            units |= {f"q{i}": "m", f"qd{i}": "m/s", f"torque{i}": "N"}
    table = np.array(rows.rows).reshape(-1, len(units))
    columns = {name: np.ascontiguousarray(table[:, i]) for i, name in enumerate(units)}
    meta = {"end": ending.end, "why": ending.why, "unloaded": unloading.how, "touched": touched}
    return Record(columns, units, meta)
