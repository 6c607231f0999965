"""A designed excitation on the terminal: the wave, its predicted uncertainty on each surface, the remedies."""

from __future__ import annotations

from math import ceil

from rich.console import Console
from rich.table import Table
from rich.text import Text

from palpate.excitation import Design, Remedy
from palpate.excitation.force_loops import Prediction
from palpate.excitation.problem import LONGEST
from palpate.references import Multisine
from palpate.report.terminal import bare_table


def show(found: Design, remedies: list[Remedy], console: Console) -> None:
    """Print a design, and for an infeasible one what would help."""
    console.print(describe_wave(found))
    console.print(_table(found))
    console.print(_verdict(found))
    for remedy in remedies:
        console.print(f"  {remedy.change}: {describe_remedy(remedy, found)}")


def describe_remedy(remedy: Remedy, found: Design) -> str:
    """Whether a change would be enough, in words."""
    to = reached(remedy.reached, found)
    if remedy.enough:
        return f"enough, {to}"
    later = f"; enough after {ceil(remedy.needed)} s" if remedy.needed <= LONGEST else ""
    return f"not enough, {to}{later}"


def describe_wave(found: Design) -> str:
    """The request, in a line."""
    budget, wave = found.problem.budget, found.wave
    if isinstance(wave, Multisine):
        low, high = wave.frequencies[0], wave.frequencies[-1]
        kind = f"multisine of {len(wave.frequencies)} sines, {low:g} to {high:.4g} Hz"
    else:
        how = "logarithmic" if wave.logarithmic else "linear"
        kind = f"{how} chirp, {wave.low:.4g} to {wave.high:.4g} Hz"
    _, force = found.force()
    lasts = f"{found.seconds:g} s" + (f" after {found.settle:g} s of settling" if found.settle else "")
    return f"{kind}: {force.min():.1f} to {force.max():.1f} N about {budget.mean:g} N, {lasts}"


def _table(found: Design) -> Table:
    names = found.predictions[0].names
    units = {"K": "N/m", "B": "N s/m", "M": "kg"}
    known, widths = [f"{name} [{units[name]}]" for name in names], [f"± {name}" for name in names]
    table = bare_table(*known, *widths, "force [N]", "travel")
    for prediction in found.predictions:
        table.add_row(*_row(prediction, found))
    return table


def _row(prediction: Prediction, found: Design) -> list[str | Text]:
    widths = prediction.half_widths(found.seconds)
    values = dict(zip(("K", "B", "M"), prediction.surface.values, strict=True))
    low, high = prediction.force
    return [
        *(f"{values[name]:.4g}" for name in prediction.names),
        *(_width(widths[name], found.problem.precision.get(name)) for name in prediction.names),
        f"{low:.1f}-{high:.1f}",
        f"{1e6 * prediction.travel:.0f} um",
    ]


def _width(width: float, asked: float | None) -> Text:
    style = "" if asked is None else "green" if width <= asked else "red"
    return Text(percent(width), style=style)


def percent(share: float) -> str:
    """A share in per cent."""
    return f"{100 * share:.2g} %" if share < 1 else "> 100 %"


def _verdict(found: Design) -> str:
    worst = found.made.worst(found.seconds)
    asked = ", ".join(f"{name} {percent(share)}" for name, share in found.problem.precision.items())
    if found.feasible:
        return f"every surface to within {asked} (95 %): yes, predicted {reached(worst, found)}"
    return f"every surface to within {asked} (95 %): no; the best is {reached(worst, found)}. Remedies:"


def reached(widths: dict[str, float], found: Design) -> str:
    """The half-widths of what was asked for."""
    return ", ".join(f"{name} {percent(widths[name])}" for name in found.problem.precision)
