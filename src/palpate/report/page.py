"""A result as text, as a table in a notebook, and as a page that opens without a network."""

from __future__ import annotations

import base64
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime
from html import escape
from io import StringIO
from math import ceil, floor, inf, isfinite, log10
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console

from palpate.files import SIGNATURE, check_place, write_text
from palpate.report import style
from palpate.report.chart import page_figures
from palpate.report.look import assets
from palpate.text import OPTION, printable
from palpate.units import quantity

if TYPE_CHECKING:
    from markupsafe import Markup
    from matplotlib.figure import Figure


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

    codes = tuple(values.pop("scripts", assets.scripts(*assets.TABLES)))
    now = datetime.now(UTC).isoformat(timespec="seconds")
    values = {
        "styles": assets.styles(),
        "scripts": codes,
        "policy": assets.policy(codes),
        "made": now,
        **values,
    }
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


@dataclass(frozen=True)
class Card:
    """One number: its name, its unit and half-width, its verdict, and what limits it or what it is of.

    Args:
        name: of the quantity.
        number: text; empty for none.
        unit, half: of it.
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
class Extent:
    """A stretch of a logarithmic scale.

    Args:
        name: of the row.
        low, high: ends; 0 and infinite are open.
        kind: `proved`, `estimate`, `assumed` or `exact`.
        text: what stands at the row's right.
    """

    name: str
    low: float
    high: float
    kind: str
    text: str


@dataclass(frozen=True)
class PageAnswer:
    """Content of a page.

    Args:
        title: what it is of.
        sentence: the answer.
        about: how it came about.
        alerts: what is wrong: tone, title, text and advice.
        cards: groups of cards, by the title of each, which may be empty.
        lower: likewise, below the figures.
        scale: `log_scale`; None without.
        pairs: pictures that stand beside each other: source and caption.
        figures: as `report.chart.page_figures` takes them.
        tables: below the cards, above the figures.
        folds: tables that are folded: title, a word about them, rows.
        source: a file's text, and its title.
    """

    title: str
    sentence: str
    about: str = ""
    alerts: Sequence[Mapping[str, str]] = ()
    cards: Mapping[str, Sequence[Card]] = field(default_factory=dict)
    lower: Mapping[str, Sequence[Card]] = field(default_factory=dict)
    scale: Mapping[str, Any] | None = None
    pairs: Sequence[Mapping[str, str]] = ()
    figures: Sequence[Mapping[str, Any]] = ()
    tables: Sequence[Table] = ()
    folds: Sequence[tuple[str, str, Sequence[Sequence[str]]]] = ()
    source: tuple[str, str] = ("", "")


def warning_alerts(notes: Iterable[str]) -> list[dict[str, str]]:
    """Warnings of a page, each a sentence, whether its capital and its full stop are there or not."""
    return [
        {"tone": "warn", "title": "", "text": f"{note[:1].upper()}{note[1:].removesuffix('.')}."}
        for note in notes
    ]


def answer_page(
    answer: PageAnswer,
    *,
    room: str,
    command: str,
    package: str = "",
    codes: Sequence[str] = (),
    **values: Any,
) -> str:
    """The page as HTML.

    Args:
        answer: its content.
        room: what it is of, in the page's head.
        command: that made it.
        package: of a template with the room's name, which extends `page.html`; none where there is nothing to add.
        codes: scripts of that template, beside the page's own.
        values: what that template shows.
    """
    shown = page_figures(answer.figures)
    return render(
        f"{room}.html" if package else "page.html",
        *filter(None, [package]),
        title=printable(answer.title),
        sentence=printable(answer.sentence),
        about=printable(answer.about),
        alerts=answer.alerts,
        cards=_groups(answer.cards),
        lower=_groups(answer.lower),
        scale=answer.scale,
        pairs=answer.pairs,
        folds=[{"title": title, "about": about, "rows": rows} for title, about, rows in answer.folds if rows],
        source=answer.source[1],
        source_title=answer.source[0],
        tables=answer.tables,
        room=room,
        command=printable(command),
        **shown | {"scripts": (*shown["scripts"], *codes)},
        **values,
    )


def _groups(groups: Mapping[str, Sequence[Card]]) -> list[dict[str, Any]]:
    return [
        {"title": title, "cards": [asdict(card) for card in cards]}
        for title, cards in groups.items()
        if cards
    ]


def log_scale(
    title: str, caption: str, unit: str, extents: Sequence[Extent], mark: float | None = None
) -> dict[str, Any]:
    """Stretches under each other over one logarithmic axis, as plain values in per cent of its width.

    Args:
        title: of the whole.
        caption: under it.
        unit: of the axis.
        extents: the rows.
        mark: where a line goes through all of them; None for none.
    """
    ends = [end for e in extents for end in (e.low, e.high) if 0.0 < end < inf] + ([mark] if mark else [])
    low, high = floor(log10(min(ends)) - 0.2), ceil(log10(max(ends)) + 0.2)

    def place(value: float) -> float:
        if not isfinite(value):
            return 100.0
        return (
            round(100.0 * min(max((log10(value) - low) / (high - low), 0.0), 1.0), 2) if value > 0.0 else 0.0
        )

    rows = [
        {
            "name": e.name,
            "text": e.text,
            "kind": e.kind,
            "left": place(e.low),
            "width": round(place(e.high) - place(e.low), 2),
            "open_low": e.low <= 10.0**low,
            "open_high": e.high >= 10.0**high,
        }
        for e in extents
    ]
    powers = range(low, high + 1)
    ticks = [{"at": place(10.0**n), "text": quantity(10.0**n, unit)} for n in powers]
    return {
        "title": title,
        "caption": caption,
        "rows": rows,
        "ticks": ticks,
        "mark": place(mark) if mark else None,
    }


_NOTEBOOK = 100
"""Letters of a line in a notebook."""


def console_text(show: Callable[[Console], None]) -> str:
    """Console output of a function, as plain text."""
    file = StringIO()
    show(Console(file=file, width=_NOTEBOOK, no_color=True, markup=False, emoji=False, highlight=False))
    return printable("\n".join(line.rstrip() for line in file.getvalue().rstrip().splitlines()))


def as_text(head: str, rows: Sequence[Sequence[str]]) -> str:
    """A line, and a table of text under it, its columns as wide as they need to be."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)] if rows else []
    lines = [
        "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows
    ]
    return printable("\n".join([head, *(f"  {line}" for line in lines)]))


def as_html(head: str, rows: Sequence[Sequence[str]], notes: Sequence[str] = ()) -> str:
    """A line and a table for a notebook, the first row being the table's head: escaped, and without a script."""
    table = [_html_row(row, "th" if i == 0 else "td") for i, row in enumerate(rows)]
    parts = [f"<p><b>{_safe(head)}</b></p>", f"<table>{''.join(table)}</table>" if rows else ""]
    return "<div>" + "".join([*parts, *(f"<p>{_safe(note)}</p>" for note in notes)]) + "</div>"


def write_page(result: Any, page: Callable[[Any], str], path: Path) -> Path:
    """Make and write a page of a result, atomically; a place that will not do is refused before.

    Raises:
        InputError: palpate may not write there, or the name has another ending.
    """
    check_place(path, ending=".html")
    write_text(path, page(result))
    return path


def write_figure(result: Any, draw: Callable[[Any], Figure], path: Path) -> Figure:
    """Draw and write a figure of a result, atomically; a place that will not do is refused before.

    Raises:
        InputError: palpate may not write there, or the name has another ending.
    """
    check_place(path)
    drawn = draw(result)
    style.save(drawn, path)
    return drawn


def _html_row(cells: Sequence[str], tag: str) -> str:
    return (
        "<tr>" + "".join(f'<{tag} style="text-align:left">{_safe(cell)}</{tag}>' for cell in cells) + "</tr>"
    )


def _safe(text: str) -> str:
    return escape(printable(text), quote=True)
