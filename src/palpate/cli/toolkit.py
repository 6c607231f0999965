"""Parts of commands, for those of other distributions too: output, progress, the answer as JSON."""

from palpate.cli._program import OutputFile, command, print_answer, print_result
from palpate.cli._terminal import (
    COMPILING,
    bar,
    console,
    guard_picture,
    place,
    print_lines,
    progress_of_pieces,
    say,
)
from palpate.report.terminal import STYLE, head, show_table

__all__ = [
    "COMPILING",
    "STYLE",
    "OutputFile",
    "bar",
    "command",
    "console",
    "guard_picture",
    "head",
    "place",
    "print_answer",
    "print_lines",
    "print_result",
    "progress_of_pieces",
    "say",
    "show_table",
]
