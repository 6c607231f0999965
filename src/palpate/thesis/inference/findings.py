"""Results of an inference, as a page, a document, a figure and JSON."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from palpate.files import MADE, signed, write_json, write_text
from palpate.report import style
from palpate.report.page import Table, page
from palpate.thesis.inference import tables
from palpate.thesis.inference.posterior import named, worth
from palpate.thesis.inference.result import Result, as_json
from palpate.thesis.inference.sampler import Sample
from palpate.thesis.inference.search import WRONG
from palpate.thesis.inference.sentences import sentences
from palpate.thesis.laboratory.unknowns import UNKNOWNS

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PAGE, DOCUMENT, FIGURE, FOUND = "index.html", "found.md", "posterior.png", "found.json"


def present(result: Result, folder: Path, command: str) -> None:
    """Writes page, document, figure and JSON into the folder."""
    style.save(drawn_figure(result.posterior), folder / FIGURE)
    write_json(folder / FOUND, signed(as_json(result, command)))
    notes, found = [_cross_validated(result), _worth(result.posterior)], tables.found(result)
    whole = page(
        title="The thesis' laboratory, inferred",
        about=(
            f"{len(sentences())} sentences report results of the thesis' own laboratory. The search looks for values "
            f"of {len(UNKNOWNS)} unknowns under which most of them are true at once. It assumes that a sentence is "
            f"wrong about its own laboratory with a probability of {100 * WRONG:g} %. The thresholds are unchanged."
        ),
        notes=notes,
        tables=[*found, *tables.details(result)],
        figures={
            folder / FIGURE: "The posterior of each unknown in shares of its prior (grey: the prior itself)."
        },
        command=command,
    )
    write_text(folder / PAGE, whole)
    write_text(folder / DOCUMENT, document(notes, found, command))


def document(notes: Sequence[str], shown: Sequence[Table], command: str) -> str:
    """Notes and tables as Markdown."""
    shown_parts = (part for table in shown for part in (f"### {table.title}", _rows(table)))
    parts = [f"{MADE} laboratory", f"Of `{command}`.", *notes, *shown_parts]
    return "\n\n".join(parts) + "\n"


def _rows(table: Table) -> str:
    lines = [table.head, ["---"] * len(table.head), *table.rows]
    return "\n".join(f"| {' | '.join(cell.replace('|', '/') for cell in line)} |" for line in lines)


def _cross_validated(result: Result) -> str:
    there, here = result.cross_validation
    follows = "It could replace the bench." if result.better else "The bench stays the default."
    return (
        f"On the validation half, {there} sentences are true only in the laboratory inferred from the other "
        f"half, {here} only on the hand-chosen bench. If the two were equally good, a result as good as this would "
        f"have a probability of {result.by_chance:.2g}. {follows} The largest set of sentences true at once has "
        f"{result.largest.count(sentences())} of {len(sentences())}; {len(result.table.true)} laboratories were tried. "
        f"{_never(len(result.never))}"
    )


def _never(count: int) -> str:
    if not count:
        return "Each sentence of the search is true in some of them."
    return f"{count} {'sentence is' if count == 1 else 'sentences are'} true in none of them."


def _worth(sample: Sample) -> str:
    own, visited = worth(sample), len(np.unique(sample.visited, axis=0))
    return (
        f"The posterior has {len(sample.points)} particles, which visited {visited} laboratories and descend from "
        f"{sample.stages[-1].ancestors} points of the prior. The effective number of independent laboratories for the "
        f"mean of an unknown is {np.median(own):.0f} (median of the unknowns; {own.min():.0f} to {own.max():.0f}). "
        "If it is small, a narrow posterior may reflect the path of the search and not the thesis; more --particles "
        "increase it."
    )


def drawn_figure(sample: Sample) -> Figure:
    """A small panel for each unknown: where its posterior lies in shares of its prior."""
    columns, bins = 6, 10
    rows = -(-len(UNKNOWNS) // columns)
    drawing, axes = style.grid((11.0, 1.3 * rows), rows, columns)
    for axis in axes[len(UNKNOWNS) :]:
        axis.remove()
    for i, (axis, unknown) in enumerate(zip(axes, UNKNOWNS, strict=False)):
        count = len(unknown.choices) or bins
        axis.hist(
            sample.visited[:, i], bins=count, range=(0.0, 1.0), density=True, color=style.SERIES[0], alpha=0.8
        )
        axis.axhline(1.0, color=style.MEASURED, linewidth=1.0)
        axis.set_title(unknown.name.replace("_", " "), fontsize=8, loc="left")
        axis.set(xlim=(0.0, 1.0), yticks=[])
        if unknown.choices:
            middles = (np.arange(count) + 0.5) / count
            axis.set_xticks(
                middles,
                [
                    named(unknown, v).removeprefix("the ").removeprefix("seed ").split()[0]
                    for v in unknown.choices
                ],
                fontsize=6,
            )
        else:
            axis.set_xticks([0.0, 1.0], [f"{unknown.low:g}", f"{unknown.high:g}"], fontsize=6)
    return drawing
