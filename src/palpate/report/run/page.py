"""The page of a run: the answer and what failed first, charts to touch, the thesis' own columns, and the film."""

from dataclasses import asdict
from typing import Any

import numpy as np

from palpate.arrays import Array
from palpate.bench.summary import CONTACT
from palpate.identification.result import Identification
from palpate.records import Record
from palpate.report.chart import figure_of, panels
from palpate.report.film import animation, coordinates, film_of, frames_of, text, trace_panel, view_of
from palpate.report.identification.page import TONES, split
from palpate.report.identification.words import CALLED, full_number
from palpate.report.look.assets import ARM, CHARTS, TABLES, data, packed_column, scripts, text_of
from palpate.report.page import Card, data_address, render
from palpate.report.run.figures import BEFORE, PARAMETERS, charts_of, figures_of, window_of
from palpate.report.run.table import alerts, force_cards, force_rows, motors, sentence, thesis_table
from palpate.report.style import rows_shown, svg
from palpate.robots.arm3 import Arm3
from palpate.text import printable
from palpate.units import quantity

ROWS = 4000
"""Of the record that lie in the page, the peaks of the measured force among them."""
_FEWER = 1500
"""Of it in the pictures for a browser that runs no scripts."""
_PACKAGE = "palpate.report.run"
_STILL = ("force", "identification")


def run_page(
    record: Record, summary: dict[str, Any], found: Identification | None, source: str, sha256: str
) -> str:
    """The page as HTML.

    Args:
        record: of the run.
        summary: as `summary.json` has it.
        found: what `palpate identify` says of the record; None where it says nothing.
        source: the experiment's file.
        sha256: of `record.parquet`.
    """
    contact, worth, experiment = summary["force"] is not None, len(record) > 2, record.meta["experiment"]
    why = printable(summary["not_identified"])
    return render(
        "run.html",
        _PACKAGE,
        room="run",
        title=printable(experiment["title"]),
        about=printable(experiment["about"]),
        sentence=sentence(summary),
        alerts=alerts(summary),
        cards=[asdict(card) for card in (*force_cards(summary), _stiffness(found, why))] if contact else [],
        surface=[] if found is None else _surface(found, summary["truth"]),
        identified_by=_identified_by(found, why),
        thesis=thesis_table(summary) if contact else None,
        motors=motors(summary),
        facts=force_rows(summary) if contact else [],
        source=source,
        charts=data(_chart_data(record)) if worth else "",
        pictures=_pictures(record) if worth else [],
        scripts=(*scripts(*CHARTS, *ARM, *TABLES), text_of("run.js", _PACKAGE))
        if worth
        else scripts(*TABLES),
        command=summary["command"],
        origin=[("seed", str(summary["seed"])), ("record.parquet", f"sha256 {sha256}")],
    )


def _stiffness(found: Identification | None, why: str) -> Card:
    """By `palpate identify`: at the working point, or else of the model."""
    if found is None:
        return Card("Stiffness", why=why, colour="K", tone="none", verdict="not identified")
    point = found.working_point
    own = found.parameters.get("K") or (point.stiffness if point else None)
    if own is None:
        return Card("Stiffness", why="nothing is touched", colour="K", tone="none")
    number = split(own)
    text, reason = number["text"] if own.value is not None else "", printable(own.reason)
    return Card(
        "Stiffness",
        text,
        number["unit"],
        number["half"],
        reason,
        TONES[own.verdict],
        str(own.verdict),
        "K wide",
    )


def _identified_by(found: Identification | None, why: str) -> str:
    if found is None:
        return f"palpate identify gives no answer for this record: {why}."
    return (
        f"By palpate identify of record.parquet, as the model {found.model}; on the bench the truth is known. "
        "The charts are of an estimator on line, which assumes a spring, a damper and a mass."
    )


def _surface(found: Identification, truth: dict[str, Any]) -> list[dict[str, str]]:
    """Identified parameters beside the truth."""
    rows = []
    for name, p in found.parameters.items():
        known = truth.get(name, {}).get("value")
        off = "–"
        if known is not None and p.value is not None and p.ci95 is not None:
            off = "inside the interval" if p.ci95[0] <= known <= p.ci95[1] else "outside the interval"
        rows.append(
            {
                "name": printable(name),
                "called": CALLED.get(name, ""),
                "colour": name if name in PARAMETERS else "other",
                "tone": TONES[p.verdict],
                "verdict": str(p.verdict),
                "value": full_number(p) if p.value is not None else "no number",
                "truth": quantity(known, truth[name]["unit"], digits=4) if known is not None else "–",
                "off": off,
            }
        )
    return rows


def _pictures(record: Record) -> list[dict[str, str]]:
    """Still pictures, for a browser that runs no scripts."""
    rows = rows_shown(record["force_measured"], _FEWER, record["phase"] == CONTACT)
    few = Record({name: column[rows] for name, column in record.columns.items()}, record.units, record.meta)
    found = figures_of(few)
    return [
        {"source": data_address(svg(figure_of(found[name][0])), "image/svg+xml"), "caption": found[name][1]}
        for name in _STILL
        if name in found
    ]


def _chart_data(record: Record) -> dict[str, Any]:
    """Data of the charts and the arm, in plain values."""
    charts, window = charts_of(record), window_of(record)
    rows = rows_shown(record["force_measured"], ROWS, record["t"] > window[0])
    motion = {name: record[name][rows] for name in ("t", "q1", "q2", "q3", "force")}
    motion |= {"depth": record["penetration"][rows], "wall": (record["x"] - record["penetration"])[rows]}
    return {
        "charts": dict(zip(charts, panels(list(charts.values()), ROWS), strict=True)),
        "columns": {name: packed_column(values) for name, values in motion.items()},
        "links": list(Arm3().length),
        "window": window,
        "shown": min(window[0] + BEFORE + 1.2, window[1]),
    }


_WIDE, _HIGH = 640.0, 520.0
_ARM, _FORCE = (20.0, 20.0, 600.0, 270.0), (40.0, 350.0, 560.0, 140.0)
"""Left, top, width and height of the arm's panel, and of the force's."""
_CORNERS = np.array([[-0.06, -0.17, 0.0], [0.56, 0.1, 0.0]])
"""Extent of the picture along x and y [m]: the planar arm's reach in front of a wall, and its base."""


def film(record: Record) -> str:
    """The film of a run of at least two rows, as SVG."""
    rows = frames_of(record, BEFORE)
    seconds = float(record["t"][rows[-1]] - record["t"][rows[0]])
    view = view_of(_CORNERS, _ARM, -0.5 * np.pi, 0.5 * np.pi)
    angles = np.cumsum(np.column_stack([record[f"q{i}"][rows] for i in (1, 2, 3)]), axis=1)
    steps = np.array(Arm3().length)[:, None] * np.stack(
        [np.cos(angles), np.sin(angles), 0.0 * angles], axis=2
    )
    joints = np.concatenate([np.zeros((len(rows), 1, 3)), np.cumsum(steps, axis=1)], axis=1)
    arm = [coordinates(view(points)) for points in joints]
    tip = np.array([view(points[-1:])[0] for points in joints])
    across, along = (
        animation(name, [f"{v:.1f}" for v in values], seconds)
        for name, values in zip(("cx", "cy"), tip.T, strict=True)
    )
    surface = [coordinates(view(_ground(wall))) for wall in (record["x"] - record["penetration"])[rows]]
    force, desired = record["force"][rows], record["force_desired"][rows]
    words = f"force and desired force, up to {float(force.max()):.3g} N in {seconds:.3g} s"
    parts = [
        f'<polygon class="surface" points="{surface[0]}">{animation("points", surface, seconds)}</polygon>',
        f'<polyline class="arm" points="{arm[0]}">{animation("points", arm, seconds)}</polyline>',
        f'<circle class="dot" r="6" cx="{tip[0, 0]:.1f}" cy="{tip[0, 1]:.1f}">{across}{along}</circle>',
        text(_ARM[0], _ARM[1] + _ARM[3] + 20, "the arm, to scale"),
    ]
    return film_of(
        [*parts, *trace_panel(record["t"][rows], force, desired, _FORCE, words)], 0.0, _WIDE, _HIGH
    )


def _ground(wall: float) -> Array:
    """Corners of the surface behind a wall at x, shape (4, 3) [m]."""
    (_, low, _), (far, high, _) = _CORNERS
    return np.array([[wall, low, 0.0], [far, low, 0.0], [far, high, 0.0], [wall, high, 0.0]])
