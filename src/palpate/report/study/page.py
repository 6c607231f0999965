"""The page of a study: the answer, what failed, settings against each other, every metric, and the study's own file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from palpate.report.look.assets import CHARTS, TABLES, data, scripts, text_of
from palpate.report.page import Table, captioned, render


@dataclass(frozen=True)
class StudyPage:
    """Content of the page.

    Args:
        title, about: of the study.
        sentence, answers: the answer, and further ones.
        notes: warnings.
        tables: in the order to be read.
        below: tables that stand below the figures.
        charts: plain values from which the page draws; empty where there is nothing to draw.
        figures: the same as PNG files with a caption each, for a browser that runs no scripts.
        command: that makes it.
        study: its file.
        origin: lines of its foot, name and text.
    """

    title: str
    about: str
    sentence: str
    answers: Sequence[str]
    notes: Sequence[str]
    tables: Sequence[Table]
    below: Sequence[Table]
    charts: Mapping[str, Any]
    figures: Mapping[Path, str]
    command: str
    study: str
    origin: Sequence[tuple[str, str]]


def study_page(of: StudyPage) -> str:
    """The page as HTML."""
    worth = bool(of.charts.get("figures") or of.charts.get("comparisons"))
    own = text_of("study.js", "palpate.report.study")
    return render(
        "study.html",
        "palpate.report.study",
        room="study",
        title=of.title,
        about=of.about,
        sentence=of.sentence,
        answers=of.answers,
        notes=of.notes,
        tables=of.tables,
        below=of.below,
        charts=data(of.charts) if worth else "",
        figures=captioned(of.figures),
        command=of.command,
        study=of.study,
        origin=of.origin,
        scripts=(*scripts(*TABLES, *CHARTS), own) if worth else scripts(*TABLES),
    )
