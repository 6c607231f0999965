"""Records that `palpate run` and the bench wrote: they say themselves what measured them."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import msgspec

from palpate.errors import InputError
from palpate.logs.kinds import Kind, kind_of
from palpate.logs.read import read_log
from palpate.logs.tables.parquet import stored_about
from palpate.records import Record
from palpate.signals.low_pass import LowPass

RUN = {"time": "t", "position": "x_measured", "force": "force_sampled"}
"""Columns of a run's record that form a log: the encoder's position, and the sampled force."""


def is_run(path: Path) -> bool:
    """Whether a file is the record of a run."""
    if kind_of(path) is not Kind.PARQUET:
        return False
    about = stored_about(path)
    return about is not None and set(RUN.values()) <= set(about.units)


def read_run(path: Path, **options: Any) -> Record:
    """Time, position and force of a run's record; `options` are those of `read_log`."""
    record = read_log(path, **(options | RUN))
    about = stored_about(path)
    if about is not None and "wire" in about.meta:
        fact = (
            "a press over a wire: force and position along its direction, the force relative to free motion"
        )
        wire = about.meta["wire"]
        meta = {**record.meta, "facts": [fact], "position_from": "joints", **_arm(path, wire)}
        return Record(record.columns, record.units, meta)
    fact = f"a run's record: {RUN['position']} and {RUN['force']}, with the record's own instruments"
    # Without a tool the bench's force is that on the surface itself.
    arm = {} if about is None else _arm(path, about.meta)
    return Record(record.columns, record.units, {**record.meta, **_NO_TOOL, **arm, "facts": [fact]})


def _arm(path: Path, known: Any) -> dict[str, Any]:
    """Compliances and masses on both sides of the force sensor, with standard deviations, if known."""
    if not isinstance(known, dict):
        return {}
    try:
        return {name: msgspec.convert(known[name], kind) for name, kind in _ARM.items() if name in known}
    except msgspec.ValidationError as error:
        raise InputError(f"{path}: its metadata of the arm is damaged ({error}); press again") from None


def measured_by(path: Path) -> dict[str, Any]:
    """The lag [s] and the force filter that a run's record states, as `palpate.identify` takes them; or neither.

    The lag is that of a fresh reading: the sensor's low-pass at rest, its wait, less what the position is late.
    """
    about = stored_about(path)
    instruments = about.meta.get("instruments") if about else None
    if instruments is None:
        return {}
    try:
        found = msgspec.convert(instruments, _Instruments)
    except msgspec.ValidationError as error:
        raise InputError(
            f"{path}: its metadata of the instruments is damaged ({error}); run it again"
        ) from None
    if found.force is None or found.force.filter == "unknown":
        return {}
    low_pass = LowPass.parse(found.force.filter)
    lag = low_pass.lag + found.force.delay_s - found.position.lag_s
    return {"lag": lag, "force_filter": found.force.filter if low_pass.roll_off else None}


_Kilograms = Annotated[float, msgspec.Meta(ge=0, le=1e3)]
_Followed = Annotated[float, msgspec.Meta(ge=-1e3, le=1e3)]
_Stiffness = Annotated[float, msgspec.Meta(gt=0, le=1e9)]
_Deviation = Annotated[float, msgspec.Meta(ge=0, le=1e9)]
_ARM: dict[str, Any] = {
    "robot_stiffness_N_per_m": tuple[_Stiffness, _Deviation],
    "robot_mass_kg": tuple[_Kilograms, _Kilograms],
    "tool_mass_kg": tuple[_Kilograms, _Kilograms],
    "tool_inertia_kg": tuple[_Followed, _Kilograms],
}
_NO_TOOL = {"tool_mass_kg": (0.0, 0.0)}


class _Force(msgspec.Struct, frozen=True):
    filter: str
    delay_s: float


class _Position(msgspec.Struct, frozen=True):
    lag_s: float = 0.0


class _Instruments(msgspec.Struct, frozen=True):
    force: _Force | None = None
    position: _Position = _Position()
