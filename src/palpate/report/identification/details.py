"""All evidence of an identification on the terminal: parameters, reasons, warnings, uncertainty budgets."""

from collections.abc import Iterator
from typing import Any, Literal, NamedTuple

from rich.console import Console
from rich.table import Table
from rich.text import Text

from palpate.identification.result import Identification
from palpate.identification.uncertainty import Parameter, Verdict
from palpate.report.identification import words
from palpate.text import printable
from palpate.units import NONE, between, plain, quantity

_MANY = 6
"""Contacts that a line names."""


def show(found: Identification, name: str, console: Console) -> None:
    """Print an identification with every reason and warning.

    Args:
        found: what to print.
        name: of the log.
        console: where to.
    """
    console.print(Text(printable(words.sentence(found)), style="bold"))
    console.print(Text(printable(f"{name}: {_contacts(found)}")))
    _point(found, console)
    for fact in words.press_facts(found):
        console.print(Text(fact))
    for fact in found.slide.facts if found.slide else ():
        console.print(Text(fact))
    if found.n and not found.slide:
        console.print(Text(_fit(found)))
    console.print(_parameters(found))
    if found.resonance:
        frequency, ratio = found.resonance
        console.print(Text(f"resonance {frequency:.4g} Hz, damping ratio {ratio:.3g}"))
    for parameter, p in found.parameters.items():
        if p.verdict is not Verdict.IDENTIFIED or parameter == "E":
            note(console, f"{parameter}:", p.reason, words.STYLES[p.verdict])
    for warn in found.warnings:
        note(console, f"{warn.code.word}:", warn.text, "yellow")


def _contacts(found: Identification) -> str:
    spans = [f"{start:.4g}-{end:.4g} s" for start, end in found.contacts[:_MANY]]
    if len(found.contacts) > _MANY:
        spans.append("...")
    count = len(found.contacts)
    return f"{count} contact{'s' * (count != 1)}{': ' if spans else ''}{', '.join(spans)}"


def _point(found: Identification, console: Console) -> None:
    point = found.working_point
    if point is None:
        return
    own = point.stiffness
    value = NONE if own.value is None else words.full_number(own)
    line = Text.assemble(
        ("working point", "bold"), f": {value}, ", (str(own.verdict), words.STYLES[own.verdict])
    )
    line.append(f"; {', '.join(words.facts_of(found, point))}; from the {point.source}")
    console.print(line)
    if own.value is None:
        note(console, "working point:", own.reason, words.STYLES[own.verdict])
    if point.prediction95:
        console.print(Text(f"the next press: {words.interval(point.prediction95, own.unit)} (95 %)"))


def _fit(found: Identification) -> str:
    text = f"{found.model}: R2 {found.r2:.4f}, rms misfit {plain(found.rmse, 3)}, {found.n} samples"
    text += f", filters {found.cutoff:.3g} Hz"
    return f"{text}, {words.lag_of(found)}" if found.lag else text


def _parameters(found: Identification) -> Table:
    table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0))
    for title in ("", "value ± 95 %", "if the model holds", "unit", "verdict", "limited by"):
        justify: Literal["left", "right"] = "right" if title == "value ± 95 %" else "left"
        table.add_column(
            title, justify=justify, no_wrap=title != "limited by", min_width=3 if title != "unit" else 5
        )
    for name, p in found.parameters.items():
        style = words.STYLES[p.verdict]
        limit = next(iter(p.budget), NONE)
        table.add_row(name, _value(p), _own(p), words.unit(p), Text(str(p.verdict), style=style), limit)
    return table


def _value(p: Parameter) -> str:
    return NONE if p.value is None else words.number(p)


def _own(p: Parameter) -> str:
    return NONE if p.ci95_if_model_holds is None else between(*p.ci95_if_model_holds)


def note(console: Console, label: str, text: str, style: str) -> None:
    """A label and a text that hangs beside it."""
    grid = Table.grid(padding=(0, 1, 0, 0))
    grid.add_column(no_wrap=True)
    grid.add_column()
    grid.add_row(Text(label, style=style), Text(printable(text)))
    console.print(grid)


BUDGET_HEAD = ("source", "type", "law", "input ± u(x)", "sensitivity", "u(y)", "ν", "share")
BUDGET_WORDS = 3
"""Columns of words, the first of them."""
_LEAST = 1e-6
"""Share of the variance below which a source is not listed."""
METHOD = (
    "Follows the GUM (JCGM 100). u(y) is the standard uncertainty of the result by one source, ν its degrees of"
    " freedom. A source without an input has its effect estimated in the result's own unit: its sensitivity is 1. At"
    " the working point each source is expanded by its own ν, so that k is Student's t of ν_eff or more."
)


class BudgetTable(NamedTuple):
    """The uncertainty budget of one result.

    Args:
        title: the result with its value.
        rows: cells below `BUDGET_HEAD`, one row for each source.
        total: combined uncertainty, degrees of freedom, coverage factor, expanded uncertainty.
    """

    title: str
    rows: list[tuple[str, ...]]
    total: str


def budgets(found: Identification) -> Iterator[BudgetTable]:
    """Of the working point, then of each parameter that has a number."""
    own = found.uncertainty_json()
    point = own["working_point"]
    if point is not None:
        yield _budget("stiffness at the working point", point)
    for name, one in own["parameters"].items():
        yield _budget(f"{name}, {words.CALLED[name]}" if name in words.CALLED else name, one)


def correlation(found: Identification) -> str:
    """One line on the correlation of the fit's parameters; empty where fewer than two have a number."""
    pairs = [f"r({pair.replace(',', ', ')}) = {r:.2f}" for pair, r in found.correlation.items()]
    return f"Correlation of the fit's estimates: {'; '.join(pairs)}." if pairs else ""


def show_budgets(found: Identification, console: Console) -> None:
    """Print the budgets; a log without a number has none."""
    for own in budgets(found):
        console.print(Text(f"\n{own.title}", style="bold"))
        table = Table(box=None, pad_edge=False, padding=(0, 1, 0, 0))
        for column, title in enumerate(BUDGET_HEAD):
            table.add_column(title, justify="left" if column < BUDGET_WORDS else "right", no_wrap=True)
        for row in own.rows:
            table.add_row(*row)
        console.print(table)
        console.print(Text(own.total), soft_wrap=True)
    if found.correlation:
        console.print(Text(f"\n{correlation(found)}"), soft_wrap=True)
    console.print(Text(f"\n{METHOD}"), soft_wrap=True)


def _budget(title: str, own: dict[str, Any]) -> BudgetTable:
    unit = own["unit"]
    u, k, expanded = (
        own[name] for name in ("combined_standard_uncertainty", "coverage_factor", "expanded_uncertainty")
    )
    freedom = _freedom(own["effective_degrees_of_freedom"])
    return BudgetTable(
        printable(f"{title}: {quantity(own['value'], unit, expanded, 4)}"),
        [_row(source, unit) for source in own["sources"] if source["share"] >= _LEAST],
        f"u_c = {quantity(u, unit)}, ν_eff = {freedom}, k = {k:.2f}, U = k u_c = {quantity(expanded, unit)} (95 %)",
    )


def _row(source: dict[str, Any], unit: str) -> tuple[str, ...]:
    read = source["input"]
    return (
        printable(source["source"]),
        source["type"],
        source["distribution"],
        quantity(read["value"], read["unit"], read["std"]) if read else NONE,
        plain(source["sensitivity"], 3),
        quantity(source["standard_uncertainty"], unit),
        _freedom(source["degrees_of_freedom"]),
        f"{100 * source['share']:.2g} %",
    )


def _freedom(value: float | None) -> str:
    return "∞" if value is None else plain(value, 3)
