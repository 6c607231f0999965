"""Charts of a run, each named by its figure, and its page: the answer and what failed first, then tables and charts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from palpate.arrays import Array, Mask
from palpate.bench.summary import CONTACT, LOST
from palpate.files import write_text
from palpate.identification.result import Identification
from palpate.records import Record
from palpate.report import style
from palpate.report.chart import KNOWN, Band, Chart, Interval, Mark, Series, build_figure, panels
from palpate.report.page import Answer, answer_page
from palpate.report.run.table import alerts, sentence, tables
from palpate.signals.types import NORMAL
from palpate.text import printable

BEFORE = 1.0
"""Time before contact that is still shown [s]."""
PARAMETERS = {"K": ("Stiffness K", "N/m"), "B": ("Damping B", "N s/m"), "M": ("Mass M", "kg")}
_MAX_STRETCHES = 40
"""Contacts, and losses of contact, that are marked at most."""
_OUTLIER = 50.0
"""Times the range of nearly all values; what is farther leaves no resolution for the others, and is a gap."""
_NEAR_LIMIT = 0.7
"""Fraction of a motor's limit from which on the limit is shown."""


def run_figures(record: Record) -> dict[str, tuple[list[Chart], str]]:
    """Charts of each figure and its caption, by its name, in the order to be read."""
    charts = build_charts(record)
    window = contact_window(record)
    in_window = {name: replace(chart, xlim=window) for name, chart in charts.items()}
    approach = [_position(record), charts["force"]]
    approach_words = (
        "The whole run. The desired position moves in steps until contact; friction delays the tip."
    )
    figures = {"approach": (approach, f"{approach_words} Shaded: force control, and loss of contact.")}
    if "K" in charts:
        caption = "The true force acts on the simulated surface; the controller receives the measured one."
        figures["force"] = ([in_window["force"]], caption)
        caption = (
            "Recursive least squares on channels matched in lag, its 95 % interval, and the stiffness from three kinds "
            "of signals. The initial transient of the estimates is cut off."
        )
        figures["identification"] = ([in_window[name] for name in (*PARAMETERS, "thesis")], caption)
    torques = [chart for name, chart in charts.items() if name.startswith("motor")]
    figures["torque"] = (torques, "Applied torque. Dashed: the limit, if the torque comes near it.")
    return figures


def contact_window(record: Record) -> tuple[float, float]:
    """Times from shortly before the first contact to the end of the run [s]; the whole run without a contact."""
    t, contact = record["t"], record["phase"] == CONTACT
    first = float(t[np.argmax(contact)]) - BEFORE if contact.any() else float(t[0])
    return max(float(t[0]), first), float(t[-1])


def build_charts(record: Record) -> dict[str, Chart]:
    """Charts of force, motors, each parameter, and stiffness from three kinds of signals; the latter need contact."""
    t, marks = record["t"], _marks(record)
    desired = np.where(record["phase"] == CONTACT, record["force_desired"], np.nan)
    forces = [
        Series(t, record["force_measured"], "measured", "measured, filtered", 0.8),
        Series(t, record["force"], "F", "true"),
        Series(t, desired, label="desired", **KNOWN),
        *(_at_limit(record, i, record["force"], f"motor {i} at its limit") for i in (1, 2, 3)),
    ]
    charts = {"force": _chart("Force", "force [N]", forces, marks=marks)} | _torques(record)
    if not (record["phase"] == CONTACT).any():
        return charts
    truth = {name: float(known["value"]) for name, known in record.meta["truth"].items()}
    lost = [mark for mark in marks if mark.colour == "fail"]
    touched = np.maximum.accumulate(record["phase"]) > 0.0

    def estimate(name: str) -> Array:
        return _without_far(np.where(touched, record[name], np.nan))

    for name, (title, unit) in PARAMETERS.items():
        value, half = estimate(f"{name}_matched"), NORMAL * record[f"{name}_matched_std"]
        label = "95 % if the model holds"
        interval = Interval(t, _without_far(value - half), _without_far(value + half), name, label)
        late = [
            record[f"{name}_matched"] + sign * NORMAL * record[f"{name}_matched_std"] for sign in (-1.0, 1.0)
        ]
        charts[name] = _chart(
            title,
            f"{name} [{unit}]",
            [Series(t, value, name, "on line")],
            _true_value(truth.get(name)),
            intervals=[interval],
            ylim=_settled_range(record, late, truth.get(name)),
            marks=lost,
        )
    fronts = {"thesis": ("measured", "--", "thesis' signals"), "raw": ("measured", "", "raw signals")}
    fronts |= {"matched": ("K", "", "matched in lag")}
    charts["thesis"] = _chart(
        "Stiffness by signals",
        "K [N/m]",
        [
            Series(t, estimate(f"K_{front}"), colour, label, 1.6 if front == "matched" else 1.1, dash)
            for front, (colour, dash, label) in fronts.items()
        ],
        _true_value(truth.get("K")),
        marks=lost,
        ylim=_settled_range(record, [record[f"K_{front}"] for front in fronts], truth.get("K")),
    )
    return charts


def _chart(
    title: str, y: str, series: Sequence[Series | None], bands: Sequence[Band] = (), **options: Any
) -> Chart:
    return Chart(
        y, [line for line in series if line is not None], bands, title=title, x="time [s]", **options
    )


def _true_value(value: float | None) -> list[Band]:
    return [] if value is None else [Band(value, value, label="truth", **KNOWN)]


def _position(record: Record) -> Chart:
    t, wall = record["t"], 1e3 * record.meta["experiment"]["wall"]["x"]
    series = [
        Series(t, 1e3 * record["x_desired"], label="desired", **KNOWN),
        Series(t, 1e3 * record["x"], "F", "tip"),
    ]
    at_rest = Band(wall, wall, "quiet", "surface at rest", 1.0, ":")
    return _chart("Position", "x [mm]", series, [at_rest], marks=_marks(record))


def _torques(record: Record) -> dict[str, Chart]:
    """A chart a motor, and its limit if the torque comes near it."""
    charts = {}
    for i, limit in enumerate(record.meta["experiment"]["robot"]["torque_limits"], 1):
        torque = record[f"torque{i}"]
        is_near = len(torque) and np.max(np.abs(torque)) > _NEAR_LIMIT * limit
        bands = [Band(end, end, "fail", "", 0.8, "--") for end in ((-limit, limit) if is_near else ())]
        series = [Series(record["t"], torque, "ink", width=0.8), _at_limit(record, i, torque, "at the limit")]
        title, marks = f"Motor {i}", _marks(record)
        charts[f"motor{i}"] = _chart(title, "torque [N m]", series, bands, marks=marks, height=1.9)
    return charts


def _at_limit(record: Record, motor: int, values: Array, label: str) -> Series | None:
    """Dots on a line where a motor is at its limit; None where it never is."""
    up = record[f"saturated{motor}"] > 0.0
    return Series(record["t"][up], values[up], "fail", label, dots=2.0) if up.any() else None


def _marks(record: Record) -> list[Mark]:
    """Stretches of force control and of lost contact."""
    t, phase = record["t"], record["phase"]
    kinds = ((CONTACT, "F", "force control"), (LOST, "fail", "contact lost"))
    marks = [Mark(_stretches(t, phase == kind), colour, label) for kind, colour, label in kinds]
    return [mark for mark in marks if mark.spans]


def _stretches(t: Array, inside: Mask) -> list[tuple[float, float]]:
    edges = np.flatnonzero(np.diff(inside.astype(int), prepend=0, append=0))
    ends = zip(edges[::2], edges[1::2], strict=True)
    return [(float(t[a]), float(t[b - 1])) for a, b in ends][:_MAX_STRETCHES]


def _without_far(values: Array) -> Array:
    """Values with gaps in place of the few that are far from all others."""
    known = values[np.isfinite(values)]
    if not len(known):
        return values
    low, high = np.quantile(known, (0.02, 0.98))
    room = _OUTLIER * (high - low) or np.inf
    return np.where((values < low - room) | (values > high + room), np.nan, values)


def _settled_range(record: Record, parts: Sequence[Array], truth: float | None) -> tuple[float, float]:
    """Range of a chart: where the estimates come to rest, and the truth, not where they come from."""
    pressed = np.flatnonzero(record["phase"] == CONTACT)
    late = pressed[len(pressed) // 4 :]
    ends = [float(np.quantile(part[late], q)) for part in parts for q in (0.02, 0.98)]
    ends += [] if truth is None else [truth]
    room = 0.25 * (max(ends) - min(ends)) or 1.0
    return min(ends) - room, max(ends) + room


_MIN_ROWS = 2
"""Rows of a record up to which a page has no charts."""


def write_report(
    record: Record,
    summary: dict[str, Any],
    identification: Identification | None,
    source: str,
    folder: Path,
    endings: Sequence[str] = (),
    dpi: int | None = None,
) -> dict[str, str]:
    """Write the figures and report.html of a run into a folder: file name and caption of each figure.

    Args:
        record: of the run.
        summary: as `summary.json` has it.
        identification: what `palpate identify` says of the record; None where it says nothing.
        source: the experiment's file.
        folder: where to.
        endings: of the figures' files, each of `style.FORMATS`; without one the charts are on the page alone.
        dpi: of a PNG; `style.DPI` if none is given.
    """
    figures = run_figures(record)
    captions = {}
    for name, (charts, caption) in figures.items() if endings else ():
        drawing = build_figure(charts)
        for ending in endings:
            style.save(drawing, folder / f"{name}{ending}", dpi)
            captions[f"{name}{ending}"] = caption
    write_text(folder / "report.html", page(record, summary, identification, source, figures))
    return captions


def page(
    record: Record,
    summary: dict[str, Any],
    identification: Identification | None,
    source: str,
    figures: dict[str, tuple[list[Chart], str]],
) -> str:
    """The page as HTML; arguments as of `write_report`, and the charts."""
    experiment = record.meta["experiment"]
    shown_figures = figures.values() if len(record) > _MIN_ROWS else ()
    reason = printable(summary.get("not_identified") or "")
    answer = Answer(
        title=experiment["title"],
        sentence=sentence(summary),
        about=" ".join(
            filter(
                None,
                [
                    experiment["about"],
                    reason and f"palpate identify of the record gives no answer: {reason}.",
                ],
            )
        ),
        alerts=alerts(summary),
        tables=tables(summary, identification),
        figures=[{"panels": panels(charts), "caption": caption} for charts, caption in shown_figures],
        source=("The experiment", source),
    )
    return answer_page(
        answer, room="run", command=summary["command"], origin=[("seed", str(summary["seed"]))]
    )
