"""A replayed log of force and position, with its identification."""

from __future__ import annotations

import numpy as np

from palpate.arrays import Array
from palpate.identification import Identification, Parameter
from palpate.live.replay import Replay, Signals
from palpate.live.view import Happened, View
from palpate.records import Record
from palpate.report.identification.page import TONES
from palpate.report.identification.words import CALLED, formatted
from palpate.text import printable

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
    kept, notes = restarted(columns)
    view = View(
        title=printable(title),
        about=f"{len(along)} rows; the estimate is that of the whole log",
        kind="replay",
        rate=0.0,
        notes=(
            "The log has no joint angles, so the page plots force over position instead of an arm.",
            *notes,
        ),
        identified=identified(found),
        position="position",
        units={"depth": "mm" if metre else units["position"], "measured": units["force"]},
    )
    marks = [Happened(start, "contact") for start, _ in found.contacts[:_MOST_MARKS]]
    return Replay(view, Signals(kept, tuple(marks)))


def identified(found: Identification) -> tuple[dict[str, str], ...]:
    """Answer of `palpate identify`, parameter by parameter, as printed."""
    parameters = dict(found.parameters)
    point = found.working_point
    rows = [_fact("working point", point.stiffness)] if point else []
    return (
        *rows,
        *(_fact(f"{name}, {CALLED[name]}" if name in CALLED else name, p) for name, p in parameters.items()),
    )


def restarted(columns: dict[str, Array]) -> tuple[dict[str, Array], tuple[str, ...]]:
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
    text = formatted(p) if p.value is not None else "no number"
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
