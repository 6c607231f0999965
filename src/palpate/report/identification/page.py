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
from palpate.report.page import Answer, Table, answer_page
from palpate.text import printable
from palpate.units import NONE, plain, quantity

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_EVIDENCE = (
    "Force over position, without a model. A flat storage and a loss proportional to the frequency mean a spring and a"
    " damper in parallel; a storage that falls with the square of the frequency means a mass."
)
_MAX_CONTACTS = 6
"""Contacts that a line names."""
_MISFIT = "Noise looks the same everywhere. Waves, steps or repeated shapes are forces that the model lacks."


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
    return answer_page(answer, room="identify", command=source.command, origin=origin, made=source.made)


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
        note = printable(tried.note) or ("the simplest that the log supports" if chosen else "")
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


_HEAD = ("source", "type", "law", "input ± u(x)", "sensitivity", "u(y)", "ν", "share")
_MIN_SHARE = 1e-6
"""Share of the variance below which a source is not listed."""
_METHOD = (
    "Follows the GUM (JCGM 100). u(y) is the standard uncertainty of the result by one source, ν its degrees of"
    " freedom. A source without an input has its effect estimated in the result's own unit: its sensitivity is 1. At"
    " the working point each source is expanded by its own ν, so that k is Student's t of ν_eff or more."
)


def budget_tables(result: Identification) -> list[Table]:
    """The budget of the working point and of each parameter that has a number; a row for each source."""
    values = result.uncertainty_json()
    tables = []
    if values["working_point"] is not None:
        tables.append(_table("stiffness at the working point", values["working_point"]))
    for name, parameter in values["parameters"].items():
        title = ", ".join(filter(None, [name, words.CALLED.get(name)]))
        tables.append(_table(title, parameter))
    return tables


def budget_notes(result: Identification) -> list[str]:
    """The correlation of the fit's parameters, and how the budgets are made; nothing where no result has a number."""
    if not budget_tables(result):
        return []
    pairs = [f"r({pair.replace(',', ', ')}) = {r:.2f}" for pair, r in result.correlation.items()]
    return [*([f"Correlation of the fit's estimates: {'; '.join(pairs)}."] if pairs else []), _METHOD]


def _table(name: str, result: dict[str, Any]) -> Table:
    unit, k = result["unit"], result["coverage_factor"]
    expanded = quantity(result["expanded_uncertainty"], unit)
    value = quantity(result["value"], unit, result["expanded_uncertainty"], 4)
    total = (
        f"u_c = {quantity(result['combined_standard_uncertainty'], unit)},"
        f" ν_eff = {_freedom(result['effective_degrees_of_freedom'])}, k = {k:.2f}, U = k u_c = {expanded} (95 %)"
    )
    rows = [_row(source, unit) for source in result["sources"] if source["share"] >= _MIN_SHARE]
    return Table(printable(f"{name}: {value}; {total}"), _HEAD, rows)


def _row(source: dict[str, Any], unit: str) -> tuple[str, ...]:
    input_value = source["input"]
    return (
        printable(source["source"]),
        source["type"],
        source["distribution"],
        quantity(input_value["value"], input_value["unit"], input_value["std"]) if input_value else NONE,
        plain(source["sensitivity"], 3),
        quantity(source["standard_uncertainty"], unit),
        _freedom(source["degrees_of_freedom"]),
        f"{100 * source['share']:.2g} %",
    )


def _freedom(value: float | None) -> str:
    return "∞" if value is None else plain(value, 3)
