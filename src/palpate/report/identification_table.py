"""An identification on the terminal: a small table, the warnings, and what the fit is worth."""

from __future__ import annotations

from rich.console import Console
from rich.table import Table
from rich.text import Text

from palpate.identification import Identification, Parameter, Verdict
from palpate.report.identification_words import number, unit
from palpate.report.numbers import NONE, between, plain

_STYLES = {Verdict.IDENTIFIED: "green", Verdict.NOT_IDENTIFIABLE: "yellow", Verdict.REJECTED: "red"}
_MANY = 6


def show(found: Identification, name: str, console: Console) -> None:
    """Print an identification.

    Args:
        found: what to print.
        name: of the log.
        console: where to.
    """
    console.print(Text.assemble((name, "bold"), f": {_contacts(found)}"))
    if found.n:
        console.print(_fit(found))
    console.print(_table(found))
    if found.resonance:
        frequency, ratio = found.resonance
        console.print(f"resonance {frequency:.4g} Hz, damping ratio {ratio:.3g}")
    for parameter, p in found.parameters.items():
        if p.verdict is not Verdict.IDENTIFIED:
            _note(console, f"{parameter}:", p.reason, _STYLES[p.verdict])
    for warn in found.warnings:
        _note(console, f"{warn.code.word}:", warn.text, "yellow")


def _contacts(found: Identification) -> str:
    spans = [f"{start:.4g}-{end:.4g} s" for start, end in found.contacts[:_MANY]]
    if len(found.contacts) > _MANY:
        spans.append("...")
    count = len(found.contacts)
    return f"{count} contact{'s' * (count != 1)}{': ' if spans else ''}{', '.join(spans)}"


def _fit(found: Identification) -> str:
    text = f"{found.model}: R2 {found.r2:.4f}, rms misfit {found.rmse:.3g}, {found.n} samples"
    text += f", filters {found.cutoff:.3g} Hz"
    if found.lag:
        text += f", lag {plain(1e3 * found.lag[0], 3)} ms (std {plain(1e3 * found.lag[1], 2)} ms)"
    return text


def _table(found: Identification) -> Table:
    table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0))
    for title in ("", "value", "95 % interval", "unit", "verdict"):
        table.add_column(title, justify="right" if title in ("value",) else "left", no_wrap=True)
    for name, p in found.parameters.items():
        style = _STYLES[p.verdict]
        table.add_row(name, _value(p), _interval(p), unit(p), Text(str(p.verdict), style=style))
    return table


def _value(p: Parameter) -> str:
    return NONE if p.value is None else number(p)


def _interval(p: Parameter) -> str:
    return NONE if p.ci95 is None else between(*p.ci95)


def _note(console: Console, label: str, text: str, style: str) -> None:
    grid = Table.grid(padding=(0, 1, 0, 0))
    grid.add_column(no_wrap=True)
    grid.add_column()
    grid.add_row(Text(label, style=style), Text(text))
    console.print(grid)
