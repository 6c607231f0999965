"""The page of a study: what was run, the best settings, maps and curves, and the study's own file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from palpate.report.page import Table, captioned, render


def study_page(
    *,
    title: str,
    about: str,
    notes: Sequence[str],
    tables: Sequence[Table],
    figures: Mapping[Path, str],
    command: str,
    study: str,
) -> str:
    """The page as HTML.

    Args:
        title: of the study.
        about: what it asks.
        notes: what a reader must not miss.
        tables: in the order to be read.
        figures: PNG files with a caption each, put into the page.
        command: that makes it.
        study: its file.
    """
    return render(
        "study.html",
        room="study",
        title=title,
        about=about,
        notes=notes,
        tables=tables,
        figures=captioned(figures),
        command=command,
        study=study,
    )
