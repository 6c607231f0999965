"""A simulated press: its record, and its summary with the keys of `palpate run`."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from palpate.arrays import Array
from palpate.bench import summary
from palpate.contact_frame.arm import identify_contact
from palpate.contact_frame.load import Payload
from palpate.environments.kelvin_voigt import KelvinVoigt
from palpate.errors import InputError
from palpate.force.arm import PositionLoop
from palpate.force.gains import Gains
from palpate.identification.sample_clock import sample_clock_of
from palpate.press.engines import series_of
from palpate.press.sequence import Action, Plan, PressDriver, PressSequence, Tick, TipSample
from palpate.press.setting import Place, held_tool
from palpate.press.simulated_arm import SimulatedArm
from palpate.records import Record
from palpate.robots.serial.serial_arm import SerialArm

Progress = Callable[[float, str], None]

PHASES = {summary.APPROACH: "approach", summary.CONTACT: "contact", summary.LOST: "lost contact"}
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

    Raises:
        KeyboardInterrupt: of `progress`, before there is a row.
    """
    rows, sequence = _Rows(arm.arm.joints), PressSequence(arm, driver, plan.force_at, arm.loop.tick)
    ending, k = None, 0
    while ending is None:
        try:
            tick = sequence.tick()
            if progress is not None and k % _SHOWN == 0:
                progress(k * arm.loop.tick, tick.action.trouble or PHASES[tick.action.phase])
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
    return _record(arm, rows, ending)


def _row(arm: SimulatedArm, place: Place, tick: Tick, touch: TipSample | None, time: float) -> Array:
    (_, force, position, *_), action, truth = tick.sample, tick.action, arm.truth
    seen, pressing = place.axes @ position, action.phase == summary.CONTACT
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
    if sequence.touch is None:
        late = (k + 1) * tick >= plan.longest
        return (
            summary.Ending(summary.NO_CONTACT, f"no surface was felt within {plan.longest:.3g} s")
            if late
            else None
        )
    if sequence.next_since < plan.seconds:
        return None
    if action.phase != summary.CONTACT:
        return summary.Ending(summary.LOST_CONTACT, "the surface was lost, and not in contact at the end")
    return summary.Ending(summary.DONE, "as asked for")


def _record(arm: SimulatedArm, rows: _Rows, ending: summary.Ending) -> Record:
    units = rows.columns()
    for i, slides in enumerate(arm.arm.chain.slide, start=1):
        if slides:
            units |= {f"q{i}": "m", f"qd{i}": "m/s", f"torque{i}": "N"}
    table = np.array(rows.rows).reshape(-1, len(units))
    columns = {name: np.ascontiguousarray(table[:, i]) for i, name in enumerate(units)}
    return Record(columns, units, {"end": ending.end, "why": ending.why})


@dataclass(frozen=True)
class Asked:
    """Arm, surface and loop of a press, for the record.

    Args:
        arm: what moved.
        gains: of the cautious law, and the arm as it sees it.
        place: where.
        surface: what was touched.
        controller: by name.
        physics: by name.
        seed: of the noise.
        notes: what a reader should know.
        payload: the tool that was carried; None without one.
    """

    arm: SerialArm
    gains: Gains
    place: Place
    surface: KelvinVoigt
    controller: str
    physics: str
    seed: int
    notes: tuple[str, ...]
    payload: Payload | None = None

    def meta(self, record: Record) -> dict[str, Any]:
        """Metadata of the record, plain values."""
        loop = self.gains.arm
        known: dict[str, tuple[float, str]] = self.surface.truth()  # type: ignore[no-untyped-call]
        truth = {name: {"value": value, "unit": unit} for name, (value, unit) in known.items()}
        return {
            "seed": self.seed,
            "truth": truth,
            "arm": self.arm.title,
            "mode": loop.kind,
            "controller": self.controller,
            "physics": self.physics,
            "rate_hz": loop.rate,
            "instruments": {
                "force": {"filter": loop.sensor.low_pass, "delay_s": self.delay(record)},
                "position": {"lag_s": 0.0},
            },
            "notes": list(self.notes),
            "place_m": self.place.point.tolist(),
            **self.between,
        }

    @property
    def between(self) -> dict[str, Any]:
        """Compliance and mass between encoders and surface, as `palpate identify` reads them: value and std."""
        tool = {} if self.payload is None else self.payload.meta
        inner = self.gains.arm.inner
        if not isinstance(inner, PositionLoop):
            return tool
        known = {"robot_stiffness_N_per_m": (inner.stiffness, 0.0), **tool}
        if inner.mass is not None:  # of which the part beyond the sensor counts as the tool's
            known["robot_mass_kg"] = (max(inner.mass - held_tool(self.payload).inertia, 0.0), 0.0)
        return known

    def delay(self, record: Record) -> float:
        """From the sampling of a force to its reading [s]: identification finds the clock of a slower sensor itself.

        Of one about as fast as the ticks it takes each row for fresh: a reading is then as old as its tick is after
        the sensor's sample, in the mean.
        """
        return float(self._ages(record).mean())

    def delay_std(self, record: Record) -> float:
        """Standard deviation of that [s]: ages run from 0 to a tick again and again, and each run is one chance.

        An arm of positions has a lag besides that nobody tells: its drive trains damp.
        """
        if self.gains.arm.kind == "position":
            return self.gains.arm.tick / float(np.sqrt(12.0))
        ages = self._ages(record)
        runs = max(int((np.diff(ages) < 0.0).sum()), 1)
        return float(ages.std() / np.sqrt(runs))

    def _ages(self, record: Record) -> Array:
        """Of each row's reading [s], where identification takes each for fresh; else 0."""
        if sample_clock_of(record["force_sampled"]).period != 1.0:
            return np.zeros(1)
        t, sampling = record["t"], self.gains.arm.sensor.sampling
        return np.asarray(t - np.floor(t * sampling + 1e-9) / sampling)


def summarise(record: Record, asked: Asked) -> dict[str, Any]:
    """Plain JSON values: how it went, the force, the motors' limits, what was identified, the truth."""
    pressing, t = record["phase"] == summary.CONTACT, record["t"]
    n = asked.arm.joints
    result: dict[str, Any] = {
        "arm": asked.arm.title,
        "mode": asked.gains.arm.kind,
        "controller": asked.controller,
        "physics": asked.physics,
        "end": record.meta["end"],
        "why": record.meta["why"],
        "seed": asked.seed,
        "duration_s": float(t[-1]) if len(t) else 0.0,
        "contact_at_s": float(t[np.argmax(pressing)]) if pressing.any() else None,
        "contacts_lost": summary.losses(record),
        "force": None,
        "tip": None,
        "saturated": {f"joint{i}": _mean(record[f"saturated{i}"]) for i in range(1, n + 1)},
        "identified": None,
        "truth": record.meta["truth"],
        "loop": _loop(asked),
        "pose": {"smallest_singular_value": asked.place.weakest, "tip_mass_kg": asked.place.mass},
        "tare_N": record.meta["tare_N"],
        "sensor_saturated": _mean(
            np.abs(record["force_sampled"] + record.meta["tare_N"]) >= _full_scale(asked)
        ),
        "notes": list(asked.notes),
    }
    if pressing.any():
        last = pressing & (t > t[pressing][-1] - summary.WINDOW)
        result["force"] = summary.force_figures(record, pressing, last)
        start = [record[name][0] for name in ("y", "z")]
        moved = [
            float(np.mean(record[name][last])) - zero for name, zero in zip(("y", "z"), start, strict=True)
        ]
        result["tip"] = {"slipped_mm": 1e3 * float(np.hypot(*moved))}
        result["identified"] = identification_of(record, asked)
    return result


def identification_of(record: Record, asked: Asked) -> dict[str, Any]:
    """Identification of the record's measured columns, with the known instruments."""
    loop = asked.gains.arm
    log = Record(
        {"time": record["t"], "position": record["x_measured"], "force": record["force_sampled"]},
        {"time": "s", "position": "m", "force": "N"},
        {"tool_mass_kg": (0.0, 0.0), **asked.between},
    )
    low_pass = loop.low_pass
    try:
        found, _ = identify_contact(
            log,
            lag=low_pass.lag + asked.delay(record),
            lag_std=asked.delay_std(record),
            force_filter=low_pass,
        )
    except InputError as error:
        return {"why_not": str(error), "parameters": {}, "warnings": []}
    told = found.to_json()
    return {key: told[key] for key in ("model", "parameters", "warnings")}


def _loop(asked: Asked) -> dict[str, Any]:
    gains = asked.gains
    return {
        "rate_hz": gains.arm.rate,
        "theta_s": gains.theta,
        "stiffness_cap": gains.cap,
        "approach_speed_m_s": gains.approach,
        "series_stiffness": series_of(gains.arm),
    }


def _full_scale(asked: Asked) -> float:
    return float(asked.gains.arm.sensor.full_scale)


def _mean(values: Any) -> float:
    return float(np.mean(values)) if len(values) else 0.0
