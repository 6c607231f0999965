"""The page and the figure of an identification."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from palpate.identification.result import Identification
from palpate.identification.uncertainty import Parameter
from palpate.report import style
from palpate.report.chart import build_figure, panels
from palpate.report.identification import words
from palpate.report.identification.charts import axis_label, build_charts, evidence_charts, time_charts
from palpate.report.identification.uncertainty_budget import budget_notes, budget_tables
from palpate.report.page import Answer, Table, answer_page
from palpate.text import printable
from palpate.units import NONE, plain, quantity

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_EVIDENCE = (
    "Force over position, whatever the model. Flat storage and loss in proportion to frequency are a spring beside a"
    " damper; storage that falls with the square of the frequency is a mass."
)
_MAX_CONTACTS = 6
"""Contacts that a line names."""
_MISFIT = "Noise looks the same all along the misfit. Waves, steps or repeated shapes are forces that the model lacks."


def write_figure(result: Identification, path: Path, title: str, dpi: int | None = None) -> Path:
    """Draw an identification with its traces and write it, whole or not at all.

    Args:
        result: the identification.
        path: of the PNG, SVG or PDF.
        title: name of the log.
        dpi: of a PNG; `style.DPI` if none is given.
    """
    return style.save(draw(result, title), path, dpi)


def draw(result: Identification, title: str) -> Figure:
    """The charts of an identification below its sentence and its values; it must have its traces."""
    if result.traces is None:
        raise ValueError("an identification without traces has no figure")
    values = [
        f"{name} {words.full_number(p)} {words.MARKS[p.verdict]} {p.verdict}"
        for name, p in result.parameters.items()
    ]
    head = [title, words.sentence(result), ";  ".join(values), words.subtitle(result)]
    return build_figure(build_charts(result, result.traces), 2, head)


def page(result: Identification, source: words.Source) -> str:
    """The page of an identification as HTML."""
    options = {**source.options, **result.options}.items()
    origin = [
        ("log", printable(source.file)),
        *([("sha256", source.sha256)] if source.sha256 else []),
        ("options", ", ".join(f"{printable(str(name))} {printable(str(value))}" for name, value in options)),
    ]
    answer = Answer(
        title=source.title,
        sentence=words.sentence(result),
        about=" ".join(
            f"{fact.removesuffix('.')}." for fact in (*facts(result, source.title), *source.notes)
        ),
        alerts=[
            {"tone": "warn", "title": w.code.word, "text": printable(w.text), "advice": words.advice(w.code)}
            for w in result.warnings
        ],
        tables=[parameter_table(result, whole=True), *([_model_table(result)] if result.comparison else [])],
        figures=_figures(result),
        folds=_budget_folds(result),
        source=("The same as JSON", json.dumps(words.as_json(result, source), indent=1)),
    )
    made = {"made": source.made} if source.made else {}
    return answer_page(answer, room="identify", command=source.command, origin=origin, **made)


def facts(result: Identification, name: str) -> list[str]:
    """Further results, a line each: contacts, next press, slopes, friction, fit, resonance."""
    count, point = len(result.contacts), result.working_point
    spans = [f"{start:.4g}-{end:.4g} s" for start, end in result.contacts[:_MAX_CONTACTS]]
    spans += ["..."] if count > _MAX_CONTACTS else []
    contacts = f"{count} contact{'s' * (count != 1)}{': ' if spans else ''}{', '.join(spans)}"
    after = words.interval(point.prediction95, point.stiffness.unit) if point else ""
    return [
        printable(f"{name}: {contacts}"),
        *([f"the next press: {after} (95 %)"] if after else []),
        *words.press_facts(result),
        *([words.subtitle(result)] if result.n or result.slide else []),
        *(
            ["resonance {:.4g} Hz, damping ratio {:.3g}".format(*result.resonance)]
            if result.resonance
            else []
        ),
    ]


def parameter_table(result: Identification, *, whole: bool = False) -> Table:
    """The working point and each parameter: the interval, the verdict, and the largest cause.

    A whole table has full names, all causes with their half-widths, and the reason of the verdict.
    """
    row, point = _whole_row if whole else _brief_row, result.working_point
    rows = []
    if point is not None:
        place = f"stiffness {words.point_place(result, point)}" if whole else "working point"
        rows.append(row(place, point.stiffness))
    for name, p in result.parameters.items():
        called = words.CALLED.get(name) if whole else ""
        rows.append(row(", ".join(filter(None, [name, called])), p))
    last = ("where the ± comes from", "why") if whole else ("limited by",)
    return Table("", ("", "95 %", "verdict", *last), rows)


def _brief_row(name: str, p: Parameter) -> tuple[str, ...]:
    cause = next(iter(p.budget), NONE)
    return tuple(map(printable, (name, words.full_number(p), str(p.verdict), cause)))


def _whole_row(name: str, p: Parameter) -> tuple[str, ...]:
    causes = sorted(p.budget.items(), key=lambda item: -item[1])
    halves = "; ".join(f"{cause} ± {quantity(half, p.unit, digits=2)}" for cause, half in causes)
    return (*_brief_row(name, p)[:-1], printable(halves), printable(p.reason))


def _model_table(result: Identification) -> Table:
    rows = []
    for tried in result.comparison:
        chosen = math.isclose(tried.rmse, result.rmse, rel_tol=1e-9)
        name = f"{result.model} (chosen)" if chosen else tried.model  # its mass may have been taken out since
        note = printable(tried.note) or ("the plainest that the log allows" if chosen else "")
        rows.append((name, f"{tried.r2:.4f}", plain(tried.rmse, 3), note))
    misfit = axis_label("rms misfit", words.force_and_depth_units(result)[0])
    return Table("Models compared", ("model", "R²", misfit, "why, or why not"), rows)


def _figures(result: Identification) -> list[dict[str, Any]]:
    if result.traces is None:
        return []
    evidence, times = evidence_charts(result, result.traces), time_charts(result, result.traces)
    captions = [(evidence, _EVIDENCE), (times, _MISFIT if result.n else "The force never leaves its rest.")]
    return [{"panels": panels(charts), "caption": caption} for charts, caption in captions if charts]


def _budget_folds(result: Identification) -> list[tuple[str, str, list[Sequence[str]]]]:
    folds = [
        (f"Uncertainty budget of {table.title}", "", [table.head, *table.rows])
        for table in budget_tables(result)
    ]
    return [*folds, ("Method", "of the budgets", [(note,) for note in budget_notes(result)])]
