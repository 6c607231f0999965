"""Parts of commands, for those of other distributions too: output, progress, the answer as JSON."""

from palpate.cli._program import command, option_of, print_answer, print_result
from palpate.cli._terminal import (
    COMPILING,
    STYLE,
    bar,
    confirmed,
    console,
    head,
    place,
    print_lines,
    progress_of_pieces,
    say,
    show_table,
)

__all__ = [
    "COMPILING",
    "STYLE",
    "bar",
    "command",
    "confirmed",
    "console",
    "head",
    "option_of",
    "place",
    "print_answer",
    "print_lines",
    "print_result",
    "progress_of_pieces",
    "say",
    "show_table",
]
