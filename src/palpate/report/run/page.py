"""The figures and the page of a run: the answer and what failed first, then tables, charts and the experiment."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from palpate.files import write_text
from palpate.identification.result import Identification
from palpate.records import Record
from palpate.report import style
from palpate.report.chart import Chart, build_figure, panels
from palpate.report.page import Answer, answer_page
from palpate.report.run.figures import run_figures
from palpate.report.run.table import alerts, sentence, tables
from palpate.text import printable

_MIN_ROWS = 2
"""Rows of a record up to which a page has no charts."""


def write_report(
    record: Record,
    summary: dict[str, Any],
    identification: Identification | None,
    source: str,
    folder: Path,
    endings: Sequence[str] = (".png",),
    dpi: int | None = None,
) -> dict[str, str]:
    """Write the figures and report.html of a run into a folder: file name and caption of each figure.

    Args:
        record: of the run.
        summary: as `summary.json` has it.
        identification: what `palpate identify` says of the record; None where it says nothing.
        source: the experiment's file.
        folder: where to.
        endings: of the figures' files, each of `style.FORMATS`.
        dpi: of a PNG; `style.DPI` if none is given.
    """
    figures = run_figures(record)
    captions = {}
    for name, (charts, caption) in figures.items():
        drawing = build_figure(charts)
        for ending in endings:
            style.save(drawing, folder / f"{name}{ending}", dpi)
            captions[f"{name}{ending}"] = caption
    write_text(folder / "report.html", page(record, summary, identification, source, figures))
    return captions


def page(
    record: Record,
    summary: dict[str, Any],
    identification: Identification | None,
    source: str,
    figures: dict[str, tuple[list[Chart], str]],
) -> str:
    """The page as HTML; arguments as of `write_report`, and the charts."""
    experiment = record.meta["experiment"]
    shown_figures = figures.values() if len(record) > _MIN_ROWS else ()
    reason = printable(summary.get("not_identified") or "")
    answer = Answer(
        title=experiment["title"],
        sentence=sentence(summary),
        about=" ".join(
            filter(
                None,
                [
                    experiment["about"],
                    reason and f"palpate identify of the record gives no answer: {reason}.",
                ],
            )
        ),
        alerts=alerts(summary),
        tables=tables(summary, identification),
        figures=[{"panels": panels(charts), "caption": caption} for charts, caption in shown_figures],
        source=("The experiment", source),
    )
    return answer_page(
        answer, room="run", command=summary["command"], origin=[("seed", str(summary["seed"]))]
    )
