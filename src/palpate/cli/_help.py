"""The pages of `--help`: lines end between phrases where they can, and an example is a command that can be copied."""

import re
from collections.abc import Sequence
from typing import Any

from attrs import evolve
from cyclopts import App
from cyclopts.help import DefaultFormatter, HelpPanel
from rich.console import Console, ConsoleOptions, RenderResult

EXAMPLE = "palpate "
"""Begins a paragraph that is an example."""
_INDENT = 4
"""Letters by which a command stands in from the text."""
_WIDTH = 80
"""Letters of a line of the short help: the width with which a terminal opens."""
_PHRASE = (".", ",", ";", ":", ")", "]")
"""Last characters of a phrase."""
_BROKEN = 0.3
"""Share of the width that is rather left empty than a phrase broken."""


def wrap(text: str, width: int) -> list[str]:
    """Lines of at most `width` letters (a word alone may be longer), most of which end with a phrase.

    Of all ways to break the text, the one of least cost: the square of what each line but the last leaves empty, as a
    share of the width, and `_BROKEN` squared where a line ends within a phrase.
    """
    words = text.split()
    best: list[tuple[float, int]] = [(0.0, 0)] * (
        len(words) + 1
    )  # cost from this word on, and where its line ends
    for begin in reversed(range(len(words))):
        length, options = -1, []
        for end in range(begin + 1, len(words) + 1):
            length += 1 + len(words[end - 1])
            if length > width and end > begin + 1:
                break
            options.append((_cost(words[end - 1], length, width, last=end == len(words)) + best[end][0], end))
        best[begin] = min(options, key=lambda one: (one[0], -one[1]))
    lines, at = [], 0
    while at < len(words):
        end = best[at][1]
        lines.append(" ".join(words[at:end]))
        at = end
    return lines


def _cost(word: str, length: int, width: int, *, last: bool) -> float:
    if last:
        return 0.0
    empty = max(width - length, 0) / width
    return empty**2 + (0.0 if word.endswith(_PHRASE) else _BROKEN**2)


def example(text: str, width: int) -> list[str]:
    """A command, indented, continued with a backslash before an option where it is too long."""
    parts = re.split(r" (?=--?\w|> )", " ".join(text.split()))
    lines = [" " * _INDENT + parts[0]]
    for part in parts[1:]:
        if len(lines[-1]) + 1 + len(part) + 2 > width:
            lines[-1] += " \\"
            lines.append(" " * 2 * _INDENT + part)
        else:
            lines[-1] += f" {part}"
    return lines


def page(text: str, width: int) -> str:
    """A command's description: paragraphs and examples."""
    parts = [part for part in re.split(r"\n\s*\n", text) if part.strip()]
    return "\n\n".join(
        "\n".join(example(part, width) if part.lstrip().startswith(EXAMPLE) else wrap(part, width))
        for part in parts
    )


class Phrases:
    """A text that rich breaks between phrases, in whatever width it is given."""

    def __init__(self, text: str) -> None:
        self.text = " ".join(text.split())

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        from rich.text import Text

        yield Text("\n".join(wrap(self.text, options.max_width)))

    def __rich_measure__(self, console: Console, options: ConsoleOptions) -> Any:
        from rich.measure import Measurement

        longest = max((len(word) for word in self.text.split()), default=0)
        return Measurement(min(longest, options.max_width), min(len(self.text), options.max_width))


class PhraseFormatter(DefaultFormatter):
    """Panels of options whose texts are broken between phrases."""

    def __call__(self, console: Console, options: ConsoleOptions, panel: HelpPanel) -> None:
        """Render one panel of the help."""
        entries = [evolve(entry, **_describe(entry)) for entry in panel.entries]
        super().__call__(console, options, panel.copy(entries=entries))

    def render_description(self, console: Console, options: ConsoleOptions, description: Any) -> None:
        """Render what a command does, with its examples."""
        text = _plain(description)
        if text:
            console.print(page(text, console.width), soft_wrap=True, markup=False, highlight=False)
            console.print()


def _describe(entry: Any) -> dict[str, Any]:
    """An entry's text with what else is known of it, as one."""
    choices = [f"[choices: {', '.join(entry.choices)}]"] if entry.choices else []
    empty: Sequence[object] = (None, "False", "()", "('',)")
    default = [] if entry.default in empty else [f"[default: {entry.default}]"]
    required = ["[required]"] if entry.required else []
    text = " ".join([_plain(entry.description), *choices, *default, *required])
    return {"description": Phrases(text), "choices": (), "default": None, "required": False}


def _plain(description: Any) -> str:
    """The letters of what cyclopts makes of a text."""
    inner = getattr(description, "primary_renderable", description)
    return getattr(inner, "plain", str(inner) if inner else "").strip()


_SHOWN = {
    "identify": ("time", "position", "force-column", "lag", "indenter", "report", "table", "verbose"),
    "tune": ("arm", "force", "stiffness", "damping-max", "out", "report", "verbose", "json"),
    "press": ("arm", "force", "surface", "gains", "wire", "dry-run", "out", "json"),
}
"""Options that a short help shows, where they are not the first ones."""
_MOST = 8
"""Options of a short help: with usage, two examples and options of two lines it is some 24 lines, a terminal."""


def short_help(app: App, command: str) -> list[str]:
    """Usage, what a command does, two examples and eight options."""
    description, *rest = re.split(r"\n\s*\n", app[command].help)
    examples = [part for part in rest if part.startswith(EXAMPLE)][:2]
    arguments = [one for one in app[command].assemble_argument_collection(parse_docstring=True) if one.show]
    named = {name.removeprefix("--"): one for one in reversed([*arguments]) for name in one.names[:1]}
    places = [one.names[0] for one in arguments if not one.names[0].startswith("-")]
    options = [name for name, one in reversed(named.items()) if one.names[0].startswith("--")]
    required = [name for name in options if named[name].required]
    wanted = [name for name in _SHOWN.get(command, ()) if name in named] or [*required, *options]
    width = 2 + max((len(name) for name in wanted), default=0)
    lines = [
        f"Usage: palpate {' '.join([command, *places])} [OPTIONS]", "", *wrap(description, _WIDTH), "",
        *(line for text in examples for line in (*example(text, _WIDTH), "")),
    ]  # fmt: skip
    for name in [*dict.fromkeys(wanted)][:_MOST]:
        first = re.split(r"[.;](?: |$)", str(named[name].parameter.help or ""), maxsplit=1)[0]
        begin, *more = wrap(first, _WIDTH - width - 4) or [""]
        lines += [f"  --{name:<{width}}{begin}", *(" " * (width + 4) + line for line in more)]
    return [*lines, "", f"all options: palpate {command} --help"]
