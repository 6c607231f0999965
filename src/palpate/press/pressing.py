"""A press from free motion to its end: a record with the columns of `palpate run`, for any number of joints."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

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
from palpate.press.pilots import Acted, Pilot
from palpate.press.setting import Place
from palpate.press.simulated_arm import SimulatedArm
from palpate.press.tool import Plan
from palpate.records import Record

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
