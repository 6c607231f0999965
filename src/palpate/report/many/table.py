"""Many logs on the terminal: the sentence, a row each, and what they say together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

from palpate.identification.causes import cause_of
from palpate.identification.pooling import Pooled, PooledParameter, PooledPoint
from palpate.identification.result import Identification, Parameter, Verdict
from palpate.report.identification.answer import STYLES
from palpate.report.identification.table import note
from palpate.report.identification.words import (
    Source,
    as_json,
    facts_of,
    formatted,
    interval,
    number,
    unit,
    units_of,
)
from palpate.report.numbers import NONE, plain, quantity
from palpate.report.terminal import bare_table

POINT = "working point"


@dataclass(frozen=True)
class LogRow:
    """One log of many.

    Args:
        source: where it is from.
        found: None if the log could not be read.
        error: why not, in one line.
    """

    source: Source
    found: Identification | None
    error: str = ""

    def value_of(self, name: str) -> Parameter | None:
        """A parameter of it, or the stiffness at the working point; None if it has none."""
        if self.found is None:
            return None
        if name == POINT:
            return self.found.working_point.stiffness if self.found.working_point else None
        return self.found.parameters.get(name)

    def to_json(self) -> dict[str, Any]:
        """As of one log; a log that could not be read has an `error` and nothing else."""
        if self.found is None:
            return {"file": self.source.file, "error": self.error}
        return as_json(self.found, self.source)


def json_of(rows: Sequence[LogRow], pooled: Pooled) -> dict[str, Any]:
    """The object that `palpate identify --json` prints for many logs."""
    return {"logs": [row.to_json() for row in rows], "pooled": pooled.to_json()}


def quantities(pooled: Pooled) -> dict[str, PooledParameter]:
    """All that is pooled, the working point first."""
    first = {POINT: pooled.working_point.stiffness} if pooled.working_point else {}
    return first | pooled.parameters


def quantities_with_number(rows: Sequence[LogRow], pooled: Pooled) -> list[str]:
    """The quantities that at least one log gives a number."""
    return [name for name in quantities(pooled) if any(has_number(row, name) for row in rows)]


def has_number(row: LogRow, name: str) -> bool:
    """Whether a log gives a quantity a number."""
    p = row.value_of(name)
    return p is not None and p.value is not None


def sentence(rows: Sequence[LogRow], pooled: Pooled) -> str:
    """The pooled stiffness, the prediction of the next press, its place, its largest cause, and the next step."""
    point = pooled.working_point
    if point is None:
        return f"None of {len(rows)} logs shows a stiffness at a working point."
    own = point.stiffness.parameter
    where = place(rows, point)
    if own.value is None:
        return f"The {len(rows)} logs show no stiffness together {where}: {own.reason}."
    limit = cause_of(next(iter(own.budget), None))
    after = point.stiffness.prediction95
    again = f", the next press is predicted at {interval(after, own.unit)} (95 %)" if after else ""
    return (
        f"Over {len(point.stiffness.logs)} of {len(rows)} logs the stiffness is {formatted(own)}{again}, {where};"
        f" its uncertainty is mostly due to {limit.described}: {limit.remedy}."
    )


def place(rows: Sequence[LogRow], point: PooledPoint) -> str:
    """The ranges of force, depth and frequency that it belongs to."""
    found = next((row.found for row in rows if row.found is not None), None)
    force, position = units_of(found) if found else ("N", "m")

    def spread(ends: tuple[float, float], unit: str) -> str:
        low, high = (f"{plain(x, 2)} Hz" if unit == "Hz" else quantity(x, unit) for x in ends)
        return low if low == high else f"{low} to {high}"

    depth, frequency = spread(point.depth_m, position), spread(point.frequency_Hz, "Hz")
    return f"at {spread(point.force_N, force)}, {depth} deep and {frequency}"


def failures(rows: Sequence[LogRow]) -> str:
    """How many logs could not be read; nothing if all could."""
    count = sum(row.found is None for row in rows)
    if not count:
        return ""
    return f"{count} of {len(rows)} logs could not be identified; their rows say why."


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
    names = quantities_with_number(rows, pooled)
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
