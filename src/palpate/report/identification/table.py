"""All evidence of an identification on the terminal: working point, parameters, reasons, warnings."""

from __future__ import annotations

from typing import Literal

from rich.console import Console
from rich.table import Table
from rich.text import Text

from palpate.identification.result import Identification
from palpate.identification.uncertainty import Parameter, Verdict
from palpate.report.identification.answer import STYLES
from palpate.report.identification.words import (
    facts_of,
    formatted,
    interval,
    lag_of,
    number,
    press_facts,
    sentence,
    unit,
)
from palpate.report.numbers import NONE, between, plain
from palpate.text import printable

_MANY = 6
"""Contacts that a line names."""


def show(found: Identification, name: str, console: Console) -> None:
    """Print an identification with every reason and warning.

    Args:
        found: what to print.
        name: of the log.
        console: where to.
    """
    console.print(Text(printable(sentence(found)), style="bold"))
    console.print(Text(printable(f"{name}: {_contacts(found)}")))
    _point(found, console)
    for fact in press_facts(found):
        console.print(Text(fact))
    if found.n:
        console.print(Text(_fit(found)))
    console.print(_table(found))
    if found.resonance:
        frequency, ratio = found.resonance
        console.print(Text(f"resonance {frequency:.4g} Hz, damping ratio {ratio:.3g}"))
    for parameter, p in found.parameters.items():
        if p.verdict is not Verdict.IDENTIFIED or parameter == "E":
            note(console, f"{parameter}:", p.reason, STYLES[p.verdict])
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
    value = NONE if own.value is None else formatted(own)
    line = Text.assemble(("working point", "bold"), f": {value}, ", (str(own.verdict), STYLES[own.verdict]))
    line.append(f"; {', '.join(facts_of(found, point))}; from the {point.source}")
    console.print(line)
    if own.value is None:
        note(console, "working point:", own.reason, STYLES[own.verdict])
    if point.prediction95:
        console.print(Text(f"the next press: {interval(point.prediction95, own.unit)} (95 %)"))


def _fit(found: Identification) -> str:
    text = f"{found.model}: R2 {found.r2:.4f}, rms misfit {plain(found.rmse, 3)}, {found.n} samples"
    text += f", filters {found.cutoff:.3g} Hz"
    return f"{text}, {lag_of(found)}" if found.lag else text


def _table(found: Identification) -> Table:
    table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0))
    for title in ("", "value ± 95 %", "if the model holds", "unit", "verdict", "limited by"):
        justify: Literal["left", "right"] = "right" if title == "value ± 95 %" else "left"
        table.add_column(
            title, justify=justify, no_wrap=title != "limited by", min_width=3 if title != "unit" else 5
        )
    for name, p in found.parameters.items():
        style = STYLES[p.verdict]
        limit = next(iter(p.budget), NONE)
        table.add_row(name, _value(p), _own(p), unit(p), Text(str(p.verdict), style=style), limit)
    return table


def _value(p: Parameter) -> str:
    return NONE if p.value is None else number(p)


def _own(p: Parameter) -> str:
    return NONE if p.ci95_if_model_holds is None else between(*p.ci95_if_model_holds)


def note(console: Console, label: str, text: str, style: str) -> None:
    """A label and a text that hangs beside it."""
    grid = Table.grid(padding=(0, 1, 0, 0))
    grid.add_column(no_wrap=True)
    grid.add_column()
    grid.add_row(Text(label, style=style), Text(printable(text)))
    console.print(grid)
