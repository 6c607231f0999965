"""The record of a run or a log, as it is played again: the arm of a run moves, and its truth is known."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from palpate.arrays import Array
from palpate.bench.force_input import COLUMNS as ROW
from palpate.bench.summary import CONTACT, LOST
from palpate.errors import InputError
from palpate.identification import Identification, Parameter
from palpate.logs.read import read_log
from palpate.records import Record
from palpate.report.identification.page import TONES
from palpate.report.identification.words import CALLED, full_number
from palpate.robots.arm3 import Arm3
from palpate.signals.types import NORMAL
from palpate.text import printable
from palpate_live.view import LEAD, Happened, Replay, ReplayedSignals, View

_MOST_MARKS = 200


def of_log(title: str, found: Identification, along: Record) -> Replay:
    """A log played again.

    Args:
        title: its name.
        found: what `palpate identify` says of it.
        along: `time`, and `position` and `force` along the normal.

    Raises:
        InputError: too few rows.
    """
    units = along.units
    metre = units["position"] == "m"
    columns = {
        "t": np.asarray(along["time"]),
        "measured": np.asarray(along["force"]),
        "depth": along["position"] * (1e3 if metre else 1.0),
    }
    for name in ("K", "B"):
        columns |= _constant(columns["t"], found, name)
    kept, notes = clear_at_restarts(columns)
    view = View(
        title=printable(title),
        about=f"{len(along)} rows; the estimate is that of the whole log",
        kind="replay",
        rate=0.0,
        notes=(
            "The log has no joint angles, so the page plots force over position instead of an arm.",
            *notes,
        ),
        identified=identification_rows(found),
        position="position",
        units={"depth": "mm" if metre else units["position"], "measured": units["force"]},
    )
    marks = [Happened(start, "contact") for start, _ in found.contacts[:_MOST_MARKS]]
    return Replay(view, ReplayedSignals(kept, tuple(marks)))


def identification_rows(found: Identification) -> tuple[dict[str, str], ...]:
    """Answer of `palpate identify`, parameter by parameter, as printed."""
    parameters = dict(found.parameters)
    point = found.working_point
    rows = [_fact("working point", point.stiffness)] if point else []
    return (
        *rows,
        *(_fact(f"{name}, {CALLED[name]}" if name in CALLED else name, p) for name, p in parameters.items()),
    )


def clear_at_restarts(columns: dict[str, Array]) -> tuple[dict[str, Array], tuple[str, ...]]:
    """The rows whose time has grown, and what a reader should know if others were left out."""
    t = columns["t"]
    latest = np.fmax.accumulate(np.concatenate([[-np.inf], t[:-1]]))
    grows = np.isfinite(t) & (t > latest)
    lost = int((~grows).sum())
    if not lost:
        return columns, ()
    note = f"{lost} rows are left out: their time does not grow."
    return {name: values[grows] for name, values in columns.items()}, (note,)


def _fact(name: str, p: Parameter) -> dict[str, str]:
    text = full_number(p) if p.value is not None else "no number"
    return {"name": printable(name), "text": text, "verdict": str(p.verdict), "tone": TONES[p.verdict]}


def _constant(t: Array, found: Identification, name: str) -> dict[str, Array]:
    """An identified parameter and its half-width in the contacts; nothing elsewhere, and nothing if it is not."""
    p = found.parameters.get(name)
    if p is None or p.value is None or p.ci95 is None or str(p.verdict) != "identified":
        return {}
    inside = np.zeros(len(t), dtype=bool)
    for start, end in found.contacts:
        inside |= (t - t[0] >= start) & (t - t[0] <= end)
    half = (p.ci95[1] - p.ci95[0]) / 2
    return {name: np.where(inside, p.value, np.nan), f"{name}_half": np.where(inside, half, np.nan)}


_PLAIN = {
    "t": "t",
    "measured": "force_measured",
    "force": "force",
    "desired": "force_desired",
    "q1": "q1",
    "q2": "q2",
    "q3": "q3",
    "phase": "phase",
}


def of_run(path: Path, found: Identification, *, whole: bool = False) -> Replay:
    """The replayed record of `palpate run`.

    Args:
        path: of its `record.parquet`.
        found: what `palpate identify` says of it.
        whole: begin at the very start of the search for the surface, not shortly before the touch.

    Raises:
        InputError: columns are missing, or there are too few rows.
    """
    record = read_log(path)
    lacking = sorted(set(ROW) - set(record.columns))
    if lacking:
        raise InputError(f"{path} lacks the columns {', '.join(lacking[:5])} of a run; show it with --log")
    columns = {name: np.asarray(record[own]) for name, own in _PLAIN.items()}
    columns["depth"] = 1e3 * record["penetration"]
    columns["wall"] = record["x"] - record["penetration"]
    contact = np.maximum.accumulate(record["phase"]) > 0.0
    for name in ("K", "B"):
        value, half = record[f"{name}_matched"], NORMAL * record[f"{name}_matched_std"]
        known = contact & (half < np.abs(value))
        columns[name] = np.where(known, value, np.nan)
        columns[f"{name}_half"] = np.where(known, half, np.nan)
        columns[f"{name}_true"] = np.full(len(record), _truth(record.meta, name))
    length = Arm3().length
    start = tuple(float(record[f"q{i}"][0]) for i in (1, 2, 3)) if len(record) else ()
    view = View(
        title=str(_experiment_value(record.meta, "title") or path.stem),
        about=f"{path.parent.name}/{path.name}",
        kind="replay",
        rate=0.0,
        links=(length.x, length.y, length.z),
        rest=start,
        identified=identification_rows(found),
    )
    kept, notes = clear_at_restarts(columns)
    moments = tuple(_moments(record["t"], record["phase"]))
    first = float(record["t"][np.argmax(contact)]) - LEAD if contact.any() and not whole else None
    return Replay(replace(view, notes=notes), ReplayedSignals(kept, moments), first)


def _moments(t: Array, phase: Array) -> list[Happened]:
    found = []
    for i in np.flatnonzero(np.diff(phase, prepend=0.0)):
        if phase[i] == CONTACT:
            found.append(Happened(float(t[i]), "switch to force"))
        elif phase[i] == LOST:
            found.append(Happened(float(t[i]), "contact lost", "fail"))
    return found


def _truth(meta: Mapping[str, Any], name: str) -> float:
    """The record's own, if it is a spring and a damper."""
    kind = _experiment_value(meta, "surface", "kind")
    value = meta.get("truth", {}).get(name, {}).get("value") if isinstance(meta.get("truth"), dict) else None
    return float(value) if kind == "kelvin-voigt" and isinstance(value, int | float) else float("nan")


def _experiment_value(meta: Mapping[str, Any], *keys: str) -> Any:
    """The record's experiment; None if it is damaged."""
    value: Any = meta.get("experiment")
    for key in keys:
        value = value.get(key) if isinstance(value, dict) else None
    return value
