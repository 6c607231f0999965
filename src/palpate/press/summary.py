"""Summary of a simulated press, with the keys of `palpate run`, and what its record states."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate.arrays import Array
from palpate.bench import summary
from palpate.contact_frame.payload import Payload
from palpate.contact_frame.press_or_slide import identify_contact
from palpate.environments.models import KelvinVoigt, Layered
from palpate.errors import InputError
from palpate.force.arm import PositionLoop
from palpate.force.gains import Gains
from palpate.identification.sample_clock import sample_clock_of
from palpate.press.engines import series_of
from palpate.press.setting import Place, held_tool
from palpate.press.simulated_arm import NO_FREE_FORCE, PoseForce
from palpate.records import Record
from palpate.robots.serial.serial_arm import SerialArm


@dataclass(frozen=True)
class PressRequest:
    """Arm, surface and loop of a press, for the record.

    Args:
        arm: that moves.
        gains: of the cautious law, with its model of the arm.
        place: pose at the start, and the surface before it.
        surface: that is touched.
        controller: by name.
        physics: by name.
        seed: of the noise.
        notes: for the reader of the results.
        payload: the tool that the arm carries; None without one.
        end: hold, to rest in contact after a press that is done; else retreat.
        free: force that the sensor shows in free motion.
    """

    arm: SerialArm
    gains: Gains
    place: Place
    surface: KelvinVoigt | Layered
    controller: str
    physics: str
    seed: int
    notes: tuple[str, ...]
    payload: Payload | None = None
    end: str = "retreat"
    free: PoseForce = NO_FREE_FORCE

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
        """Mean age of a reading at its tick [s].

        Identification finds the clock of a sensor that is slower than the ticks by itself; then this is 0. For a faster
        sensor it takes each row as a new sample, so that the age of the sample at the tick is a delay.
        """
        return float(self._ages(record).mean())

    def delay_std(self, record: Record) -> float:
        """Standard deviation of the delay [s].

        Ages grow from 0 to a tick and begin again; each such run counts as one independent value. A position arm has an
        unknown lag besides, from the damping of its drive trains.
        """
        if self.gains.arm.kind == "position":
            return self.gains.arm.tick / float(np.sqrt(12.0))
        ages = self._ages(record)
        runs = max(int((np.diff(ages) < 0.0).sum()), 1)
        return float(ages.std() / np.sqrt(runs))

    def _ages(self, record: Record) -> Array:
        """Age of each row's reading [s], if identification takes each row as a new sample; else 0."""
        if sample_clock_of(record["force_sampled"]).period != 1.0:
            return np.zeros(1)
        t, sampling = record["t"], self.gains.arm.sensor.sampling
        return np.asarray(t - np.floor(t * sampling + 1e-9) / sampling)


def summarise(record: Record, request: PressRequest) -> dict[str, Any]:
    """Summary as plain JSON values: ending, force, limits of the motors, identification and truth."""
    pressing, t = record["phase"] == summary.CONTACT, record["t"]
    n = request.arm.joints
    result: dict[str, Any] = {
        "arm": request.arm.title,
        "mode": request.gains.arm.kind,
        "controller": request.controller,
        "physics": request.physics,
        "end": record.meta["end"],
        "why": record.meta["why"],
        "unloaded": record.meta["unloaded"],
        "seed": request.seed,
        "duration_s": float(t[-1]) if len(t) else 0.0,
        "contact_at_s": float(t[np.argmax(pressing)]) if pressing.any() else None,
        "contacts_lost": summary.losses(record),
        "force": None,
        "tip": None,
        "saturated": {f"joint{i}": _mean(record[f"saturated{i}"]) for i in range(1, n + 1)},
        "identified": None,
        "truth": record.meta["truth"],
        "loop": _loop(request),
        "pose": {"smallest_singular_value": request.place.weakest, "tip_mass_kg": request.place.mass},
        "tare_N": record.meta["tare_N"],
        "free_stroke": record.meta["free_stroke"],
        "sensor_saturated": _mean(
            np.abs(record["force_sampled"] + record.meta["tare_N"]) >= request.gains.arm.sensor.full_scale
        ),
        "notes": list(request.notes),
    }
    if pressing.any():
        last = pressing & (t > t[pressing][-1] - summary.WINDOW)
        result["force"] = summary.force_figures(record, pressing, last)
        start = [record[name][0] for name in ("y", "z")]
        moved = [
            float(np.mean(record[name][last])) - zero for name, zero in zip(("y", "z"), start, strict=True)
        ]
        result["tip"] = {"slipped_mm": 1e3 * float(np.hypot(*moved))}
        # A contact in which the force was never reached may be a ripple of the sensor, and has no stiffness.
        result["identified"] = identify_record(record, request) if record.meta["touched"] else None
    return result


def identify_record(record: Record, request: PressRequest) -> dict[str, Any]:
    """Identification of the record's measured columns, with the known instruments."""
    loop = request.gains.arm
    log = Record(
        {"time": record["t"], "position": record["x_measured"], "force": record["force_sampled"]},
        {"time": "s", "position": "m", "force": "N"},
        {"tool_mass_kg": (0.0, 0.0), **request.between},
    )
    low_pass = loop.low_pass
    try:
        result, _ = identify_contact(
            log,
            lag=low_pass.lag + request.delay(record),
            lag_std=request.delay_std(record),
            force_filter=low_pass,
        )
    except InputError as error:
        return {"why_not": str(error), "parameters": {}, "warnings": []}
    answer = result.to_json()
    return {key: answer[key] for key in ("model", "parameters", "warnings")}


def _loop(request: PressRequest) -> dict[str, Any]:
    gains = request.gains
    return {
        "rate_hz": gains.arm.rate,
        "theta_s": gains.theta,
        "stiffness_cap": gains.cap,
        "approach_speed_m_s": gains.approach,
        "series_stiffness": series_of(gains.arm),
    }


def _mean(values: Any) -> float:
    return float(np.mean(values)) if len(values) else 0.0
