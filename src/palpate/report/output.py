"""A result outside a page: its plain text, its table in a notebook, its files."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

from palpate.files import check_place, write_text
from palpate.text import printable

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from rich.console import Console

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
