"""The record of a run, as it is played again: the arm moves, and the truth is known."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from palpate.arrays import Array
from palpate.bench.row import COLUMNS as ROW
from palpate.bench.sequence import CONTACT, LOST
from palpate.errors import InputError
from palpate.identification import Identification
from palpate.live.of_log import identified, restarted
from palpate.live.replay import Replay, Signals
from palpate.live.view import LEAD, Happened, View
from palpate.logs.read import read_log
from palpate.robots.arm3 import Arm3

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
        value, half = record[f"{name}_matched"], 1.96 * record[f"{name}_matched_std"]
        known = contact & (half < np.abs(value))
        columns[name] = np.where(known, value, np.nan)
        columns[f"{name}_half"] = np.where(known, half, np.nan)
        columns[f"{name}_true"] = np.full(len(record), _truth(record.meta, name))
    length = Arm3().length
    start = tuple(float(record[f"q{i}"][0]) for i in (1, 2, 3)) if len(record) else ()
    view = View(
        title=str(_told(record.meta, "title") or path.stem),
        about=f"{path.parent.name}/{path.name}",
        kind="replay",
        rate=0.0,
        links=(length.x, length.y, length.z),
        rest=start,
        identified=identified(found),
    )
    kept, notes = restarted(columns)
    moments = tuple(_moments(record["t"], record["phase"]))
    first = float(record["t"][np.argmax(contact)]) - LEAD if contact.any() and not whole else None
    return Replay(replace(view, notes=notes), Signals(kept, moments), first)


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
    kind = _told(meta, "surface", "kind")
    value = meta.get("truth", {}).get(name, {}).get("value") if isinstance(meta.get("truth"), dict) else None
    return float(value) if kind == "kelvin-voigt" and isinstance(value, int | float) else float("nan")


def _told(meta: Mapping[str, Any], *keys: str) -> Any:
    """The record's experiment; None if it is damaged."""
    value: Any = meta.get("experiment")
    for key in keys:
        value = value.get(key) if isinstance(value, dict) else None
    return value
