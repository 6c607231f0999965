"""Many logs on the terminal: the sentence, a row each, and what they say together."""

from __future__ import annotations

from collections.abc import Sequence

from rich.console import Console
from rich.table import Table
from rich.text import Text

from palpate.identification.pooling import Pooled, PooledParameter
from palpate.identification.result import Parameter, Verdict
from palpate.report.identification.answer import STYLES
from palpate.report.identification.table import note
from palpate.report.identification.words import facts_of, formatted, interval, number, unit
from palpate.report.many.rows import POINT, LogRow, drawn, quantities
from palpate.report.many.words import failures, sentence
from palpate.report.numbers import NONE, quantity
from palpate.report.terminal import bare_table

_WIDE = 110
"""Letters of a terminal that has room for force, depth and frequency of each log."""


def show(rows: Sequence[LogRow], pooled: Pooled, console: Console) -> None:
    """Print what many logs give.

    Args:
        rows: one of each log.
        pooled: what they say together.
        console: where to.
    """
    console.print(Text(sentence(rows, pooled), style="bold"))
    if failures(rows):
        console.print(Text(failures(rows), style="yellow"))
    console.print(_logs(rows, pooled, console.width >= _WIDE))
    console.print(_together(pooled))
    for name, own in quantities(pooled).items():
        if own.parameter.verdict is not Verdict.IDENTIFIED:
            note(console, f"{name}:", own.parameter.reason, STYLES[own.parameter.verdict])
    for row in rows:
        if row.found is None:
            note(console, f"{row.source.title}:", row.error, "red")


def _logs(rows: Sequence[LogRow], pooled: Pooled, wide: bool) -> Table:
    """A row a log; where it belongs to only if there is room."""
    names = drawn(rows, pooled)
    own = quantities(pooled)
    units = [f"{'stiffness' if name == POINT else name}{_unit(own[name].parameter)}" for name in names]
    table = bare_table("log", *units, *(["at"] if wide else []), "verdict", wrapped=("log", "at", "verdict"))
    for row in rows:
        point = row.found.working_point if row.found else None
        cells = [_cell(row.value_of(name)) for name in names]
        if wide:
            cells.append(", ".join(facts_of(row.found, point)) if row.found and point else NONE)
        table.add_row(row.source.title, *cells, _verdict(row))
    return table


def _verdict(row: LogRow) -> Text:
    """Of its working point."""
    if row.found is None:
        return Text("not identified", style="red")
    point = row.found.working_point
    if point is None:
        return Text("no contact" if not row.found.contacts else "no working point", style="yellow")
    return Text(str(point.stiffness.verdict), style=STYLES[point.stiffness.verdict])


def _together(pooled: Pooled) -> Table:
    heads = ("pooled", "mean ± 95 %", "next press", "between", "logs", "verdict")
    table = bare_table(*heads, wrapped=("pooled", "verdict"))
    for name, own in quantities(pooled).items():
        p = own.parameter
        table.add_row(
            name,
            NONE if p.value is None else formatted(p),
            interval(own.prediction95, p.unit) or NONE,
            _between(own),
            f"{len(own.logs)} of {pooled.count}",
            Text(str(p.verdict), style=STYLES[p.verdict]),
        )
    return table


def _between(own: PooledParameter) -> str:
    return NONE if own.between is None else quantity(own.between, own.parameter.unit, digits=2)


def _cell(p: Parameter | None) -> str:
    return NONE if p is None or p.value is None else number(p)


def _unit(p: Parameter) -> str:
    return f" [{unit(p)}]" if unit(p) else ""
