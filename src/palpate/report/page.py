"""A page that opens without a network: everything it shows is in it."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Table:
    """A table of text: the first column names, the others hold figures."""

    title: str
    head: Sequence[str]
    rows: Sequence[Sequence[str]]


def page(
    *,
    title: str,
    about: str,
    tables: Sequence[Table],
    figures: Mapping[Path, str],
    command: str,
    source: str = "",
    notes: Sequence[str] = (),
) -> str:
    """The page as HTML; `figures` are PNG files with a caption each, put into the page."""
    from jinja2 import Environment, PackageLoader

    from palpate import __version__

    template = Environment(loader=PackageLoader("palpate.report", ""), autoescape=True).get_template(
        "page.html"
    )
    return template.render(
        title=title,
        about=about,
        notes=notes,
        tables=tables,
        figures=[
            {"data": base64.b64encode(path.read_bytes()).decode(), "caption": caption}
            for path, caption in figures.items()
        ],
        source=source,
        command=command,
        version=__version__,
    )
