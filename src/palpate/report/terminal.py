"""An answer on a terminal, or as plain text: its title and sentence, its tables, its warnings."""

from __future__ import annotations

from collections.abc import Sequence
from io import StringIO
from typing import TYPE_CHECKING

from palpate.text import printable

if TYPE_CHECKING:
    from rich.console import Console

    from palpate.report.page import Answer, Table

_GAP = 3
"""Letters between two columns; one where a table would not fit."""
STYLE = "yellow"
"""Style of warnings."""


def show_answer(answer: Answer, console: Console) -> None:
    """Print an answer: by its `show`, or title, sentence, tables and warnings."""
    if answer.show is not None:
        answer.show(console)
        return
    for doubt in answer.doubts:
        console.print(doubt, style=STYLE, soft_wrap=True)
    if answer.title:
        head(console, answer.title, f"{answer.context}{answer.sentence}")
    else:
        head(console, answer.sentence, "")
    for table in answer.tables:
        show_table(console, table)
    for note in answer.notes:
        console.print(note, style=STYLE, soft_wrap=True)


def head(console: Console, title: str, rest: str) -> None:
    """Print a title and its details on one line."""
    from rich.text import Text

    console.print(Text.assemble((title, "bold"), rest))


def show_table(console: Console, table: Table, styles: Sequence[str] = ()) -> None:
    """Print a table: the first column names, the others hold figures.

    Args:
        console: where to.
        table: its contents.
        styles: of the rows' last cells, to distinguish them.
    """
    from rich import box
    from rich.table import Table as RichTable
    from rich.text import Text

    if table.title:
        console.print(Text(table.title, style="italic"))
    widths = [max(map(len, column)) for column in zip(table.head, *table.rows, strict=True)]
    narrow = sum(widths) + _GAP * len(widths) > console.width
    rich_table = RichTable(
        box=box.SIMPLE_HEAD,
        show_edge=False,
        show_header=any(table.head),
        collapse_padding=narrow,
        pad_edge=not narrow,
    )
    for i, title in enumerate(table.head):
        rich_table.add_column(
            title, justify="left" if i == 0 or styles or table.read(i) else "right", overflow="fold"
        )
    for i, row in enumerate(table.rows):
        last = Text(row[-1], style=styles[i] if styles else "")
        rich_table.add_row(*row[:-1], last)
    console.print(rich_table)
    console.print()


_NOTEBOOK_WIDTH = 100
"""Letters of a line in a notebook."""


def answer_text(answer: Answer) -> str:
    """The answer as plain text: what its command prints."""
    from rich.console import Console

    file = StringIO()
    # In a notebook's kernel, rich would show each line as an output of its own and write none into the file; and
    # FORCE_COLOR, which a kernel sets, would put codes for bold letters into it.
    console = Console(
        file=file,
        width=_NOTEBOOK_WIDTH,
        force_jupyter=False,
        force_terminal=False,
        markup=False,
        emoji=False,
        highlight=False,
    )
    show_answer(answer, console)
    return printable("\n".join(line.rstrip() for line in file.getvalue().rstrip().splitlines()))
