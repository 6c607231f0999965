"""The pages of `--help`: texts fill the terminal's width, and an example is a command that can be copied."""

import re
import textwrap
from typing import Any

from attrs import evolve
from cyclopts.help import DefaultFormatter, HelpPanel
from rich.console import Console, ConsoleOptions
from rich.text import Text

_EXAMPLE = "palpate "
"""First letters of a paragraph that is an example."""
_INDENT = "    "
"""Indentation of a command under the text."""


def example(text: str, width: int) -> list[str]:
    """Lines of an indented command, continued with a backslash before an option where it is too long."""
    parts = re.split(r" (?=--?\w|> )", " ".join(text.split()))
    lines = [_INDENT + parts[0]]
    for part in parts[1:]:
        if len(lines[-1]) + len(f" {part} \\") > width:
            lines[-1] += " \\"
            lines.append(2 * _INDENT + part)
        else:
            lines[-1] += f" {part}"
    return lines


def page(text: str, width: int) -> str:
    """A command's description: paragraphs and examples."""
    parts = [" ".join(part.split()) for part in re.split(r"\n\s*\n", text) if part.strip()]
    return "\n\n".join(
        "\n".join(example(part, width)) if part.startswith(_EXAMPLE) else textwrap.fill(part, width)
        for part in parts
    )


class HelpFormatter(DefaultFormatter):
    """Pages whose examples can be copied, and whose texts ignore the line breaks of their sources."""

    def __call__(self, console: Console, options: ConsoleOptions, panel: HelpPanel) -> None:
        """Render a panel of options."""
        entries = [evolve(entry, description=_description(entry), required=False) for entry in panel.entries]
        super().__call__(console, options, panel.copy(entries=entries))

    def render_description(self, console: Console, options: ConsoleOptions, description: Any) -> None:
        """Render what a command does, with its examples."""
        text = _letters(description)
        if text:
            console.print(page(text, console.width), soft_wrap=True, markup=False, highlight=False)
            console.print()


def _description(entry: Any) -> Text:
    """An entry's text on one line, for the terminal to wrap; a column of its own for required ones takes room."""
    words = [*_letters(entry.description).split(), *["[required]"] * entry.required]
    return Text(" ".join(words))


def _letters(description: Any) -> str:
    """The letters of a description, which cyclopts may have made an object of rich."""
    inner = getattr(description, "primary_renderable", description)
    return getattr(inner, "plain", str(inner) if inner else "").strip()
