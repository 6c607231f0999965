"""Tables on a terminal."""

from __future__ import annotations

from collections.abc import Container

from rich.table import Table
from rich.text import Text


def bare_table(*titles: str, wrapped: Container[str] = ()) -> Table:
    """A table without lines: columns of figures, which end at their right, and `wrapped` ones of words."""
    table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0))
    for title in titles:
        words = title in wrapped
        table.add_column(
            Text(title), justify="left" if words else "right", no_wrap=not words, overflow="fold"
        )
    return table
