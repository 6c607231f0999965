"""The page of the thesis, measured again: contents, a filter, and each figure beside its claims."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from palpate.report.chart import panel_scripts
from palpate.report.look.assets import data, text_of
from palpate.report.page import render
from palpate_thesis.claims import Done, count_in_words, count_verdicts, tables

TONES = {"reproduced": "ok", "differs": "warn", "not checkable": "none"}
_CHAPTERS = (("2.", "Earlier schemes"), ("3.", "The bench"), ("4.", "The controllers"))
_PARTS = ((5, "Least squares"), (9, "Neural identifier"), (17, "Force control"))
"""Of chapter 6, by the last figure of each."""
_OTHERS = "Explanations"


def index_page(
    done: Sequence[Done],
    panels: Mapping[str, Sequence[Mapping[str, Any]]],
    missing: Sequence[str],
    command: str,
) -> str:
    """The page as HTML, figures included; it opens without a network.

    Args:
        done: studies that are measured.
        panels: of each by its number, as `drawn_panels` makes them.
        missing: numbers of those still to come.
        command: that measures them.
    """
    claims = [claim for one in done for claim in one.claims]
    verdicts = count_verdicts(claims)
    return render(
        "index.html",
        "palpate_thesis",
        room="thesis",
        title="The thesis, measured again",
        chapters=_chapters(done),
        count=verdicts.total(),
        told=count_in_words(claims),
        verdicts=verdicts,
        tones=TONES,
        panels=data(dict(panels)),
        missing=missing,
        command=command,
        seconds=sum(one.seconds for one in done),
        scripts=(*panel_scripts(), text_of("index.js", "palpate_thesis")),
    )


def _chapters(done: Sequence[Done]) -> list[dict[str, Any]]:
    """Studies by chapter, each with its claims."""
    found: dict[str, list[dict[str, Any]]] = {}
    for one in done:
        found.setdefault(chapter_of(one.number), []).append({"study": one, "claims": one.claims})
    return [{"title": title, "studies": studies} for title, studies in found.items()]


def chapter_of(number: str) -> str:
    """Chapter of a figure, by its number in the thesis; a name of ours is an explanation if its texts name no other."""
    for start, title in _CHAPTERS:
        if number.startswith(start):
            return title
    head, _, tail = number.partition(".")
    if head != "6" or not tail.isdigit():
        return tables()["figures"].get(number, {}).get("chapter", _OTHERS)
    return next((title for last, title in _PARTS if int(tail) <= last), _OTHERS)
