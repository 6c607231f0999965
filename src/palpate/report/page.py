"""One `Answer` for each result, and its renderers: text, a table in a notebook, a page that opens without a network."""

from __future__ import annotations

import base64
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

from palpate.files import SIGNATURE
from palpate.report.look import assets
from palpate.text import printable

if TYPE_CHECKING:
    from rich.console import Console

_MAX_NUMBER_LENGTH = 32
"""Longest cell that is aligned as a number [letters]: a value with interval and unit fits."""


@dataclass(frozen=True)
class Table:
    """A table of text: the first column names, the others hold figures."""

    title: str
    head: Sequence[str]
    rows: Sequence[Sequence[str]]

    def read(self, column: int) -> bool:
        """True if a column holds sentences, which are aligned at the left."""
        return any(len(row[column]) > _MAX_NUMBER_LENGTH for row in self.rows)


@dataclass(frozen=True)
class Card:
    """One number of a page: its name, its unit and half-width, its verdict, and a comment.

    Args:
        name: of the quantity.
        number: text; empty for none.
        unit, half: of the number.
        why: a sentence.
        tone: `ok`, `warn`, `none` or `fail`; empty without a verdict.
        verdict: the word for it.
        colour: the quantity's, `K`, `B` or `M`.
    """

    name: str
    number: str = ""
    unit: str = ""
    half: str = ""
    why: str = ""
    tone: str = ""
    verdict: str = ""
    colour: str = ""


@dataclass(frozen=True)
class Answer:
    """A result as every medium shows it: terminal, notebook, page, JSON.

    Args:
        json: the object for a program.
        title: what the answer is about.
        context: what stands between title and sentence on a terminal.
        sentence: the answer.
        tables: the numbers.
        notes: warnings.
        doubts: warnings that a terminal prints before the answer.
        show: prints the answer on a terminal where its lines have a layout of their own.
        about: a page's remark on how the result came about.
        alerts: a page's warnings with tone, title, text and advice; made from `notes` if empty.
        cards: a page's numbers, each in a frame of its own.
        pairs: a page's pictures that stand beside each other: source and caption.
        figures: a page's figures, each with a caption and either `panels` (`report.chart.panels`) or a `source`.
        folds: a page's folded tables: title, remark, rows.
        source: the title and the text of a file on the page.
    """

    json: Mapping[str, Any] = field(default_factory=dict)
    title: str = ""
    context: str = ": "
    sentence: str = ""
    tables: Sequence[Table] = ()
    notes: Sequence[str] = ()
    doubts: Sequence[str] = ()
    show: Callable[[Console], None] | None = None
    about: str = ""
    alerts: Sequence[Mapping[str, str]] = ()
    cards: Sequence[Card] = ()
    pairs: Sequence[Mapping[str, str]] = ()
    figures: Sequence[Mapping[str, Any]] = ()
    folds: Sequence[tuple[str, str, Sequence[Sequence[str]]]] = ()
    source: tuple[str, str] = ("", "")


def warning_alerts(notes: Iterable[str]) -> list[dict[str, str]]:
    """Warnings of a page, each a sentence with a capital and a full stop."""
    return [
        {"tone": "warn", "title": "", "text": f"{note[:1].upper()}{note[1:].removesuffix('.')}."}
        for note in notes
    ]


def with_captions(figures: Mapping[Path, str]) -> list[dict[str, str]]:
    """PNG files with a caption each, as figures of a page."""
    return [
        {"source": data_address(path.read_bytes(), "image/png"), "caption": caption}
        for path, caption in figures.items()
    ]


def data_address(data: bytes, kind: str) -> str:
    """Address of an image inside the page; `kind` is its media type."""
    return f"data:{kind};base64,{base64.b64encode(data).decode()}"


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

    codes = tuple(values.pop("scripts", assets.scripts(*assets.TABLES)))
    now = datetime.now(UTC).isoformat(timespec="seconds")
    values = {
        "styles": assets.styles(),
        "scripts": codes,
        "policy": assets.policy(codes),
        **values,
        "made": values.get("made") or now,
    }
    folders = dict.fromkeys((*packages, "palpate.report"))
    loader = ChoiceLoader([PackageLoader(folder, "") for folder in folders])
    environment = Environment(loader=loader, autoescape=True, trim_blocks=True, lstrip_blocks=True)
    return environment.get_template(template).render(
        version=version("palpate"), signature=SIGNATURE, **values
    )


def answer_page(
    answer: Answer,
    *,
    room: str,
    command: str,
    **values: Any,
) -> str:
    """The page of an answer as HTML.

    Args:
        answer: its content.
        room: what it is of, in the page's head.
        command: that made it.
        values: what `base.html` shows besides; with `live` true the page loads itself again every 2 s.
    """
    panels = {str(i): figure["panels"] for i, figure in enumerate(answer.figures, 1) if "panels" in figure}
    scripts = (*assets.TABLES, *((*assets.CHARTS, "panels.js") if panels else ()))
    return render(
        "page.html",
        title=printable(answer.title),
        sentence=printable(answer.sentence),
        about=printable(answer.about),
        alerts=answer.alerts or warning_alerts(map(printable, answer.notes)),
        cards=answer.cards,
        pairs=answer.pairs,
        figures=answer.figures,
        panels=assets.data(panels) if panels else "",
        folds=[{"title": title, "about": about, "rows": rows} for title, about, rows in answer.folds if rows],
        source=answer.source[1],
        source_title=answer.source[0],
        tables=answer.tables,
        room=room,
        command=printable(command),
        scripts=assets.scripts(*scripts),
        **values,
    )


def answer_html(answer: Answer) -> str:
    """The answer for a notebook: sentence, tables and notes, escaped and without a script."""
    parts = [f"<p><b>{safe(_head(answer))}</b></p>"]
    for table in answer.tables:
        rows = [_html_row(table.head, "th"), *(_html_row(row, "td") for row in table.rows)]
        parts.append(f"<table>{''.join(rows)}</table>")
    return f"<div>{''.join([*parts, *(f'<p>{safe(note)}</p>' for note in answer.notes)])}</div>"


def _head(answer: Answer) -> str:
    return ": ".join(filter(None, [answer.title, answer.sentence]))


def _html_row(cells: Sequence[str], tag: str) -> str:
    inside = "".join(f'<{tag} style="text-align:left">{safe(cell)}</{tag}>' for cell in cells)
    return f"<tr>{inside}</tr>"


def safe(text: str) -> str:
    """The text for HTML: escaped, nothing invisible in it."""
    return escape(printable(text), quote=True)
