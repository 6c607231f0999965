"""Uncertainty budgets of an identification as tables, by the GUM (JCGM 100)."""

from typing import Any

from palpate.identification.result import Identification
from palpate.report.identification import words
from palpate.report.page import Table
from palpate.text import printable
from palpate.units import NONE, plain, quantity

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
