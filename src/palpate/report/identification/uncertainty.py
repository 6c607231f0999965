"""The uncertainty budgets of an identification as tables (follows JCGM 100): on the terminal and on the page."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

from rich.console import Console
from rich.table import Table
from rich.text import Text

from palpate.identification.result import Identification
from palpate.report.identification.words import CALLED
from palpate.report.numbers import NONE, plain, quantity
from palpate.text import printable

HEAD = ("source", "type", "law", "input ± u(x)", "sensitivity", "u(y)", "ν", "share")
WORDS = 3
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
        rows: cells below `HEAD`, one row for each source.
        total: combined uncertainty, degrees of freedom, coverage factor, expanded uncertainty.
    """

    title: str
    rows: list[tuple[str, ...]]
    total: str


def tables(found: Identification) -> Iterator[BudgetTable]:
    """Of the working point, then of each parameter that has a number."""
    budgets = found.uncertainty_json()
    point = budgets["working_point"]
    if point is not None:
        yield _table("stiffness at the working point", point)
    for name, own in budgets["parameters"].items():
        yield _table(f"{name}, {CALLED[name]}" if name in CALLED else name, own)


def correlation(found: Identification) -> str:
    """One line on the correlation of the fit's parameters; empty where fewer than two have a number."""
    pairs = [f"r({pair.replace(',', ', ')}) = {r:.2f}" for pair, r in found.correlation.items()]
    return f"Correlation of the fit's estimates: {'; '.join(pairs)}." if pairs else ""


def show(found: Identification, console: Console) -> None:
    """Print the budgets; a log without a number has none."""
    for own in tables(found):
        console.print(Text(f"\n{own.title}", style="bold"))
        table = Table(box=None, pad_edge=False, padding=(0, 1, 0, 0))
        for column, title in enumerate(HEAD):
            table.add_column(title, justify="left" if column < WORDS else "right", no_wrap=True)
        for row in own.rows:
            table.add_row(*row)
        console.print(table)
        console.print(Text(own.total), soft_wrap=True)
    if found.correlation:
        console.print(Text(f"\n{correlation(found)}"), soft_wrap=True)
    console.print(Text(f"\n{METHOD}"), soft_wrap=True)


def _table(title: str, own: dict[str, Any]) -> BudgetTable:
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
