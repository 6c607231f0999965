"""Summary of a press in numbers: the keys of `palpate run`, for an arm of any number of joints."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate.arrays import Array
from palpate.bench.summary import CONTACT, WINDOW, force_figures, losses
from palpate.contact_frame.arm import identify_contact
from palpate.contact_frame.load import Payload
from palpate.environments.kelvin_voigt import KelvinVoigt
from palpate.errors import InputError
from palpate.force.arm import PositionLoop
from palpate.force.gains import Gains
from palpate.identification.sample_clock import sample_clock_of
from palpate.press.engines import series_of
from palpate.press.setting import Place
from palpate.press.tool import held_tool
from palpate.records import Record
from palpate.robots.serial.serial_arm import SerialArm


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
    pressing, t = record["phase"] == CONTACT, record["t"]
    n = asked.arm.joints
    summary: dict[str, Any] = {
        "arm": asked.arm.title,
        "mode": asked.gains.arm.kind,
        "controller": asked.controller,
        "physics": asked.physics,
        "end": record.meta["end"],
        "why": record.meta["why"],
        "seed": asked.seed,
        "duration_s": float(t[-1]) if len(t) else 0.0,
        "contact_at_s": float(t[np.argmax(pressing)]) if pressing.any() else None,
        "contacts_lost": losses(record),
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
        last = pressing & (t > t[pressing][-1] - WINDOW)
        summary["force"] = force_figures(record, pressing, last)
        start = [record[name][0] for name in ("y", "z")]
        moved = [
            float(np.mean(record[name][last])) - zero for name, zero in zip(("y", "z"), start, strict=True)
        ]
        summary["tip"] = {"slipped_mm": 1e3 * float(np.hypot(*moved))}
        summary["identified"] = identification_of(record, asked)
    return summary


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
            force_filter=low_pass if low_pass.sections else None,
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
