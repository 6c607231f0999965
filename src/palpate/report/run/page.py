"""The page of a run: the answer and what failed first, charts to touch, and the thesis' own columns below."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.arrays import Array, Mask
from palpate.bench.summary import CONTACT, LOST
from palpate.identification.result import Identification
from palpate.records import Record
from palpate.report import style
from palpate.report.answer import Card
from palpate.report.identification.page import TONES, split
from palpate.report.identification.words import CALLED, full_number
from palpate.report.look.assets import ARM, CHARTS, TABLES, data, packed_column, rows_shown, scripts, text_of
from palpate.report.numbers import quantity
from palpate.report.page import data_address, render
from palpate.report.run.figures import drawings
from palpate.report.run.table import alerts, force_cards, force_rows, motors, sentence, thesis_table
from palpate.report.style import svg
from palpate.robots.arm3 import Arm3
from palpate.text import printable

if TYPE_CHECKING:
    from collections.abc import Iterator


ROWS = 4000
"""Of the record that lie in the page, the peaks of the measured force among them."""
_FEWER = 1500
"""Of it in the pictures for a browser that runs no scripts."""
_PARAMETERS = ("K", "B", "M")
_PACKAGE = "palpate.report.run"
_STILL = ("force", "identification")


@dataclass(frozen=True)
class Content:
    """Content of the page.

    Args:
        title, about: of the experiment.
        source: its file.
        summary: as `summary.json` has it.
        found: what `palpate identify` says of the record; None where it says nothing.
        why: why not.
        sha256: of `record.parquet`.
    """

    title: str
    about: str
    source: str
    summary: dict[str, Any]
    found: Identification | None
    why: str
    sha256: str


def run_page(record: Record, content: Content) -> str:
    """The page as HTML."""
    summary = content.summary
    contact = summary["force"] is not None
    worth = len(record) > 2
    return render(
        "run.html",
        _PACKAGE,
        room="run",
        title=printable(content.title),
        about=printable(content.about),
        sentence=sentence(summary),
        alerts=alerts(summary),
        cards=_cards(content),
        surface=_surface(content),
        identified_by=_identified_by(content),
        thesis=thesis_table(summary) if contact else None,
        motors=motors(summary),
        facts=force_rows(summary) if contact else [],
        source=content.source,
        charts=data(_charts(record, summary)) if worth else "",
        pictures=list(_pictures(record)) if worth else [],
        scripts=(*scripts(*CHARTS, *ARM, *TABLES), text_of("run.js", _PACKAGE))
        if worth
        else scripts(*TABLES),
        command=summary["command"],
        origin=[("seed", str(summary["seed"])), ("record.parquet", f"sha256 {content.sha256}")],
    )


def _cards(content: Content) -> list[dict[str, str]]:
    if content.summary["force"] is None:
        return []
    return [*(asdict(card) for card in force_cards(content.summary)), _stiffness(content)]


def _card(name: str, number: str, unit: str = "", **more: str) -> dict[str, str]:
    return asdict(Card(name, number, unit, **more))


def _stiffness(content: Content) -> dict[str, str]:
    """By `palpate identify`: at the working point, or else of the model."""
    if content.found is None:
        return _card("Stiffness", "", why=content.why, colour="K", tone="none", verdict="not identified")
    point = content.found.working_point
    own = content.found.parameters.get("K") or (point.stiffness if point else None)
    if own is None:
        return _card("Stiffness", "", why="nothing is touched", colour="K", tone="none", verdict="")
    number = split(own)
    known = own.value is not None
    return _card(
        "Stiffness",
        number["text"] if known else "",
        number["unit"],
        half=number["half"],
        why=printable(own.reason),
        colour="K wide",
        tone=TONES[own.verdict],
        verdict=str(own.verdict),
    )


def _identified_by(content: Content) -> str:
    if content.found is None:
        return f"palpate identify gives no answer for this record: {printable(content.why)}."
    return (
        f"By palpate identify of record.parquet, as the model {content.found.model}; on the bench the truth is known. "
        "The charts are of an estimator on line, which assumes a spring, a damper and a mass."
    )


def _surface(content: Content) -> list[dict[str, str]]:
    """Identified parameters beside the truth."""
    if content.found is None:
        return []
    truth = content.summary["truth"]
    rows = []
    for name, p in content.found.parameters.items():
        known = truth.get(name, {}).get("value")
        off = "–"
        if known is not None and p.value is not None and p.ci95 is not None:
            off = "inside the interval" if p.ci95[0] <= known <= p.ci95[1] else "outside the interval"
        rows.append(
            {
                "name": printable(name),
                "called": CALLED.get(name, ""),
                "colour": name if name in _PARAMETERS else "other",
                "tone": TONES[p.verdict],
                "verdict": str(p.verdict),
                "value": full_number(p) if p.value is not None else "no number",
                "truth": quantity(known, truth[name]["unit"], digits=4) if known is not None else "–",
                "off": off,
            }
        )
    return rows


def _pictures(record: Record) -> Iterator[dict[str, str]]:
    """Still pictures, for a browser that runs no scripts."""
    rows = rows_shown(record["force_measured"], _FEWER, record["phase"] == CONTACT)
    few = Record({name: column[rows] for name, column in record.columns.items()}, record.units, record.meta)
    for one in drawings(few):
        if one.name in _STILL:
            with style.ink():
                picture = svg(one.draw(few))
            yield {"source": data_address(picture, "image/svg+xml"), "caption": one.caption}


def _charts(record: Record, summary: dict[str, Any]) -> dict[str, Any]:
    """Data of the charts and the arm, in plain values."""
    t, phase = record["t"], record["phase"]
    touched = summary["contact_at_s"]
    near = np.zeros(len(t), dtype=bool) if touched is None else (t > touched - 1.0) & (t < touched + 2.0)
    rows = rows_shown(record["force_measured"], ROWS, near)
    columns = {name: values[rows] for name, values in _columns(record).items()}
    length = Arm3().length
    end = float(t[-1])
    shown_from = float(t[0]) if touched is None else max(float(t[0]), touched - 1.0)
    truth = {name: value["value"] for name, value in record.meta["truth"].items() if name in _PARAMETERS}
    return {
        "columns": {name: packed_column(values) for name, values in columns.items()},
        "truth": truth,
        "ranges": _ranges(record, truth),
        "marks": _marks(t, phase),
        "shades": _stretches(t, phase == CONTACT),
        "links": [length.x, length.y, length.z],
        "window": [shown_from, end],
        "shown": end if touched is None else min(touched + 1.2, end),
    }


def _columns(record: Record) -> dict[str, Array]:
    plain_ones = {
        "t": "t",
        "measured": "force_measured",
        "force": "force",
        "desired": "force_desired",
        "K_thesis": "K_thesis",
        "K_raw": "K_raw",
    }
    plain_ones |= {name: name for name in ("q1", "q2", "q3", "torque1", "torque2", "torque3")}
    columns = {name: record[own] for name, own in plain_ones.items()}
    contact = np.maximum.accumulate(record["phase"]) > 0.0
    for name in ("K_thesis", "K_raw"):
        columns[name] = np.where(contact, columns[name], np.nan)
    for name in _PARAMETERS:
        value, half = record[f"{name}_matched"], 1.96 * record[f"{name}_matched_std"]
        columns[name] = np.where(contact, value, np.nan)
        columns[f"{name}_low"], columns[f"{name}_high"] = columns[name] - half, columns[name] + half
    columns["depth"] = 1e3 * record["penetration"]
    columns["wall"] = record["x"] - record["penetration"]
    return {name: _limit(values) for name, values in columns.items()}


def _limit(values: Array) -> Array:
    """Without the few values from far away that would leave no steps for the others: gaps in their place."""
    known = values[np.isfinite(values)]
    if not len(known):
        return values
    low, high = np.quantile(known, (0.02, 0.98))
    room = 50.0 * (high - low) or np.inf
    return np.where((values < low - room) | (values > high + room), np.nan, values)


def _ranges(record: Record, truth: dict[str, float]) -> dict[str, list[float]]:
    """Of the charts: where the estimates come to rest, their interval and the truth, not where they come from."""
    pressed = np.flatnonzero(record["phase"] == CONTACT)
    if not len(pressed):
        return {}
    late = pressed[len(pressed) // 4 :]
    found = {}
    for name in _PARAMETERS:
        value, half = record[f"{name}_matched"][late], 1.96 * record[f"{name}_matched_std"][late]
        found[name] = _range([value - half, value + half], truth.get(name))
    found["thesis"] = _range(
        [record[f"K_{front}"][late] for front in ("thesis", "raw", "matched")], truth.get("K")
    )
    return found


def _range(parts: Sequence[Array], known: float | None) -> list[float]:
    low = min(float(np.quantile(part, 0.02)) for part in parts)
    high = max(float(np.quantile(part, 0.98)) for part in parts)
    if known is not None:
        low, high = min(low, known), max(high, known)
    room = 0.25 * (high - low) or 1.0
    return [low - room, high + room]


def _marks(t: Array, phase: Array) -> list[dict[str, Any]]:
    """Marks at touches and losses of contact."""
    found = []
    for i in np.flatnonzero(np.diff(phase, prepend=0.0))[:40]:
        if phase[i] == CONTACT:
            found.append({"x": float(t[i]), "text": "switch to force", "tone": ""})
        elif phase[i] == LOST:
            found.append({"x": float(t[i]), "text": "✕ contact lost", "tone": "fail"})
    return found


def _stretches(t: Array, inside: Mask) -> list[list[float]]:
    edges = np.flatnonzero(np.diff(inside.astype(int), prepend=0, append=0))
    return [[float(t[a]), float(t[b - 1])] for a, b in zip(edges[::2], edges[1::2], strict=True)][:40]
