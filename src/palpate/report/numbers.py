"""How numbers are written for people: with as many digits as mean something."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

from palpate.files import check_place, write_text
from palpate.text import printable

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from rich.console import Console

NONE = "-"
_LARGE, _SMALL = 1e7, 1e-4
"""Sizes from which on, and under which, a power of ten is written out of a number."""


def plain(value: float | None, digits: int = 4) -> str:
    """A number with four digits, or as many as are asked for; a dash for none."""
    if value is None or not math.isfinite(value):
        return NONE
    return f"{value:.{digits}g}" if abs(value) < 10**digits else f"{value:.0f}"


def with_half(value: float, half: float) -> str:
    """`5192 ± 18`: value and half-width of its interval, to two digits of the latter."""
    if not (half > 0 and math.isfinite(half)):
        return f"{plain(value)} ± ?"
    power = _power(max(abs(value), half))
    value, half = value / 10.0**power, half / 10.0**power
    decimals = _decimals(half)
    text = " ± ".join(f"{round(number, decimals):.{max(0, decimals)}f}" for number in (value, half))
    return f"({text})·10{_superscript(power)}" if power else text


def between(low: float, high: float) -> str:
    """`5173 to 5210`: the ends of an interval, to two digits of its half-width."""
    half = (high - low) / 2
    if not (half > 0 and math.isfinite(half)):
        return f"{plain(low)} to {plain(high)}"
    power = _power(max(abs(low), abs(high)))
    decimals = _decimals(half / 10.0**power)
    text = " to ".join(f"{round(end / 10.0**power, decimals):.{max(0, decimals)}f}" for end in (low, high))
    return f"({text})·10{_superscript(power)}" if power else text


def _decimals(half: float) -> int:
    """Behind the point, that two digits of `half` are seen; below zero before it."""
    return 1 - math.floor(math.log10(float(f"{half:.1e}")))


def _power(size: float) -> int:
    """The power of ten to take out of numbers that are too large or too small to read."""
    return 3 * math.floor(math.log10(size) / 3) if not _SMALL <= size < _LARGE else 0


def _superscript(power: int) -> str:
    return str(power).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))


_PREFIXED = {"N", "m", "s", "Pa", "N/m", "N s/m", "N m", "N m/rad"}
_SMALL_PREFIXED = {"N", "m", "s", "N m"}
_PREFIXES = ((1e9, "G"), (1e6, "M"), (1e3, "k"))


def quantity(value: float, unit: str, half: float | None = None, digits: int = 3) -> str:
    """`46.6 kN/m`, `2.36 mm` or `5244 ± 105 N/m`: a number in SI with the prefix that keeps it short.

    Args:
        value: in SI.
        unit: its own; `1` for none.
        half: half-width of its 95 % interval.
        digits: of a value without one.
    """
    factor, prefix = si_prefix(value, unit)
    number = plain(value / factor, digits) if half is None else with_half(value / factor, half / factor)
    return f"{number} {prefix}{unit}" if unit != "1" else number


def quantity_between(low: float, high: float, unit: str) -> str:
    """`5139 to 5348 N/m`: the ends of an interval, with the prefix of the larger."""
    factor, prefix = si_prefix(max(abs(low), abs(high)), unit)
    text = between(low / factor, high / factor)
    return f"{text} {prefix}{unit}" if unit != "1" else text


def si_prefix(value: float, unit: str) -> tuple[float, str]:
    """The factor and the letter of the SI prefix that keeps a number short."""
    size = abs(value)
    if unit in _PREFIXED:
        found = next(((f, p) for f, p in _PREFIXES if size >= 9.9995 * f), None)
        if found:
            return found
    if unit in _SMALL_PREFIXED and 0 < size < 0.1:
        return (1e-3, "m") if size >= 1e-4 else (1e-6, "µ")
    return 1.0, ""


_WIDTH = 100
"""Letters of a line in a notebook."""


def console_text(show: Callable[[Console], None]) -> str:
    """Console output of a function, as plain text."""
    from io import StringIO

    from rich.console import Console

    file = StringIO()
    show(Console(file=file, width=_WIDTH, no_color=True, markup=False, emoji=False, highlight=False))
    return printable("\n".join(line.rstrip() for line in file.getvalue().rstrip().splitlines()))


def as_text(head: str, rows: Sequence[Sequence[str]]) -> str:
    """A line, and a table of text under it, its columns as wide as they need to be."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)] if rows else []
    lines = [
        "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows
    ]
    return printable("\n".join([head, *(f"  {line}" for line in lines)]))


def as_html(head: str, rows: Sequence[Sequence[str]], notes: Sequence[str] = ()) -> str:
    """The same for a notebook, the first row being the table's head: escaped, and without a script."""
    table = [_row(row, "th" if i == 0 else "td") for i, row in enumerate(rows)]
    parts = [f"<p><b>{_safe(head)}</b></p>", f"<table>{''.join(table)}</table>" if rows else ""]
    return "<div>" + "".join([*parts, *(f"<p>{_safe(note)}</p>" for note in notes)]) + "</div>"


def write_page(result: Any, page: Callable[[Any], str], path: Path) -> Path:
    """Make and write a page of a result, atomically; a place that will not do is refused before.

    Raises:
        InputError: palpate may not write there, or the name has another ending.
    """
    check_place(path, ending=".html")
    write_text(path, page(result))
    return path


def write_figure(result: Any, draw: Callable[[Any], Figure], path: Path) -> Figure:
    """Draw and write a figure of a result in the same way.

    Raises:
        InputError: palpate may not write there, or the name has another ending.
    """
    from palpate.report.style import save

    check_place(path)
    drawn = draw(result)
    save(drawn, path)
    return drawn


def _row(cells: Sequence[str], tag: str) -> str:
    return (
        "<tr>" + "".join(f'<{tag} style="text-align:left">{_safe(cell)}</{tag}>' for cell in cells) + "</tr>"
    )


def _safe(text: str) -> str:
    return escape(printable(text), quote=True)
