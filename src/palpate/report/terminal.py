"""Lines on a terminal."""

import sys
from collections.abc import Iterable

from rich.console import Console
from rich.text import Text


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
