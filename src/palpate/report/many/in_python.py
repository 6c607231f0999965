"""Many identifications in Python: as the terminal has them, for a notebook, drawn, and as a page."""

from __future__ import annotations

from typing import TYPE_CHECKING

from palpate.errors import InputError
from palpate.identification.pooling import Pooled, PooledParameter
from palpate.report.identification.words import Source, formatted, interval
from palpate.report.many import forest
from palpate.report.many import page as pages
from palpate.report.many.table import LogRow, failures, quantities, quantities_with_number, sentence, show
from palpate.report.numbers import as_html, console_text
from palpate.text import printable

if TYPE_CHECKING:
    from matplotlib.figure import Figure

HEAD = ("pooled", "mean ± 95 %", "next press", "logs", "verdict", "why")


def line(pooled: Pooled) -> str:
    """Each quantity with its verdict."""
    values = [f"{name} {_value(own)} {own.parameter.verdict}" for name, own in quantities(pooled).items()]
    return printable(f"{pooled.count} logs; {', '.join(values) or 'nothing in common'}")


def text(pooled: Pooled) -> str:
    """The output of `palpate identify` for many logs."""
    return console_text(lambda console: show(_rows(pooled), pooled, console))


def html(pooled: Pooled) -> str:
    """The sentence, and a row a quantity."""
    rows = [HEAD, *(_row(name, own, pooled) for name, own in quantities(pooled).items())]
    failed = failures(_rows(pooled))
    return as_html(sentence(_rows(pooled), pooled), rows, [failed] if failed else [])


def draw(pooled: Pooled) -> Figure:
    """The forest plots of `palpate identify --figure`.

    Raises:
        InputError: no log gives anything a number.
    """
    rows = _rows(pooled)
    if not quantities_with_number(rows, pooled):
        raise InputError("none of these logs gives a number; there is nothing to draw")
    return forest.draw(rows, pooled)


def page(pooled: Pooled) -> str:
    """The page of `palpate identify --report`."""
    return pages.page(_rows(pooled), pooled)


def _rows(pooled: Pooled) -> list[LogRow]:
    """A row a log, by its name, or by its place."""
    names = pooled.names or [f"log {i + 1}" for i in range(pooled.count)]
    options = next((dict(found.options) for found in pooled.logs if found is not None), {})
    made = "palpate.identification.pool(...).report(...)"
    return [
        LogRow(Source(name, options, command=made), found, "" if found else "it was not identified")
        for name, found in zip(names, pooled.logs, strict=True)
    ]


def _row(name: str, own: PooledParameter, pooled: Pooled) -> tuple[str, ...]:
    p = own.parameter
    after = interval(own.prediction95, p.unit) or "-"
    return name, _value(own), after, f"{len(own.logs)} of {pooled.count}", str(p.verdict), p.reason


def _value(own: PooledParameter) -> str:
    return "-" if own.parameter.value is None else formatted(own.parameter)
