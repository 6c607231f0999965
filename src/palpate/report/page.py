"""A page that opens without a network: everything it shows is in it."""

from __future__ import annotations

import base64
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.text import Text

from palpate.files import SIGNATURE
from palpate.text import OPTION

if TYPE_CHECKING:
    from markupsafe import Markup


@dataclass(frozen=True)
class Table:
    """A table of text: the first column names, the others hold figures."""

    title: str
    head: Sequence[str]
    rows: Sequence[Sequence[str]]

    def read(self, column: int) -> bool:
        """Whether a column holds sentences, which begin at its left, and not figures, which end at its right."""
        return any(len(row[column]) > _SENTENCE for row in self.rows)


@dataclass(frozen=True)
class CommandAnswer:
    """The answer of a command, as a terminal and a program show it.

    Args:
        json: for a program.
        title: what it is of.
        sentence: the answer, with what stands between it and the title.
        tables: below it.
        notes: warnings.
        doubts: warnings that stand before the answer.
        show: prints it on a terminal instead of title, sentence, tables and notes, where its lines have a layout of
            their own.
    """

    json: Mapping[str, Any]
    title: str = ""
    sentence: str = ""
    tables: Sequence[Table] = ()
    notes: Sequence[str] = ()
    doubts: Sequence[str] = ()
    show: Callable[[Console], None] | None = None


_SENTENCE = 32
"""Letters of a cell from which on it is a sentence; a value with its interval and unit is shorter."""


def with_captions(figures: Mapping[Path, str]) -> list[dict[str, str]]:
    """PNG files with a caption each, as a page holds them."""
    return [{"source": png(path), "caption": caption} for path, caption in figures.items()]


def render(template: str, *packages: str, **values: Any) -> str:
    """A page from a template, which may extend `base.html`: how every page of palpate looks.

    Args:
        template: its file's name.
        packages: where it and those that it extends lie, besides this one.
        values: what it shows; `base.html` itself wants a `title` and the `command` that made the page, and takes the
            `seconds` it took, what the page is of (`room`), the date it was `made` (now, if none is given), further
            lines of its foot (`origin`, pairs of name and text), and `scripts`, which alone may run.
    """
    from importlib.metadata import version

    from jinja2 import ChoiceLoader, Environment, PackageLoader

    from palpate.report.look.assets import TABLES, policy, scripts, styles

    codes = tuple(values.pop("scripts", scripts(*TABLES)))
    now = datetime.now(UTC).isoformat(timespec="seconds")
    values = {"styles": styles(), "scripts": codes, "policy": policy(codes), "made": now, **values}
    folders = dict.fromkeys((*packages, "palpate.report"))
    loader = ChoiceLoader([PackageLoader(folder, "") for folder in folders])
    environment = Environment(loader=loader, autoescape=True, trim_blocks=True, lstrip_blocks=True)
    environment.filters["advice"] = advice
    return environment.get_template(template).render(
        version=version("palpate"), signature=SIGNATURE, **values
    )


def advice(text: str) -> Markup:
    """A text for a page, on which nobody types: options as code, and the first of them with its command."""
    from markupsafe import Markup, escape

    code = OPTION.sub(lambda option: f"<code>{option[0]}</code>", str(escape(text)))
    if "palpate " not in text:
        code = code.replace("</code>", "</code> (option of <code>palpate identify</code>)", 1)
    return Markup(code)  # noqa: S704 - escaped above


def png(path: Path) -> str:
    """A PNG file as the source of an image that lies in the page itself."""
    return data_address(path.read_bytes(), "image/png")


def data_address(data: bytes, kind: str) -> str:
    """Anything as the source of an image that lies in the page itself; `kind` is its media type."""
    return f"data:{kind};base64,{base64.b64encode(data).decode()}"


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
