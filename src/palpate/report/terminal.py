"""Tables on a terminal."""

import sys
from collections.abc import Container, Iterable

from rich.console import Console
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


def print_hanging(lines: Iterable[Text], console: Console) -> None:
    """Print lines; on a terminal, and in a text of Python's, a long one goes on under its own beginning."""
    narrow = console.is_terminal or console.file is not sys.stdout
    for line in lines:
        indent = line.cell_len - len(line.plain.lstrip())
        if narrow and line.cell_len > console.width > indent + 20:
            for part in line[indent:].wrap(console, console.width - indent):
                console.print(Text(" " * indent).append(part))
        else:
            console.print(line, soft_wrap=True)
