"""Results of an inference, as a page, a document, a figure and JSON."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from palpate.files import MADE, with_author, write_json, write_text
from palpate.report import style
from palpate.report.page import PageAnswer, Table, answer_page, warning_alerts, with_captions
from palpate_laboratory.judge import Judged
from palpate_laboratory.result import (
    Contradiction,
    InferenceResult,
    as_json,
    halves,
    laboratories,
    marginals,
    reasons,
    samples,
    value_in_words,
    worth,
)
from palpate_laboratory.sampler import Sample
from palpate_laboratory.search import MISS, WRONG
from palpate_laboratory.sentences import Sentence, sentences
from palpate_laboratory.unknowns import UNKNOWNS, Unknown
from palpate_thesis.look import Figure


def main_tables(result: InferenceResult) -> list[Table]:
    """Tables of the page and of the document."""
    return [
        _counts(result),
        _predictive(result),
        posterior(result),
        _searches(result),
        _largest(result),
        *_never_true(result),
        *_exclusive(result),
    ]


def details(result: InferenceResult) -> list[Table]:
    """Tables of the page alone."""
    return [_sentences(result), _ranges()]


def _counts(result: InferenceResult) -> Table:
    rows = [
        [name, *(f"{one.count(of)} of {len(of)}" for of in halves().values())]
        for name, one in laboratories(result).items()
    ]
    head = ("laboratory", "true in the calibration half", "in the validation half", "in all")
    return Table("Sentences that are true, over ten seeds", head, rows)


def _predictive(result: InferenceResult) -> Table:
    rows = [
        [one.name, str(one.laboratories), one.calibration.in_words(), one.validation.in_words()]
        for one in result.predictive
    ]
    head = ("laboratories", "number", "in the calibration half", "in the validation half")
    return Table(
        "Share of the sentences that are true in one run: mean ± spread between laboratories",
        head,
        rows,
    )


def posterior(result: InferenceResult) -> Table:
    """Table of the posterior of each unknown."""
    rows = [
        [m.unknown.name.replace("_", " "), _prior(m.unknown), m.in_words(), m.verdict]
        for m in marginals(result.posterior.visited)
    ]
    head = ("unknown", "prior", "posterior: median (5 to 95 %)", "does the thesis tell it?")
    return Table("Posterior of the unknowns of the laboratory", head, rows)


def _prior(unknown: Unknown) -> str:
    if unknown.prior == "any seed":
        return "any"
    if unknown.choices:
        return " or ".join(value_in_words(unknown, v) for v in unknown.choices)
    return f"{unknown.low:g} to {unknown.high:g} {unknown.unit}, {unknown.prior}".replace(" ,", ",")


def _searches(result: InferenceResult) -> Table:
    rows = [[name, *_sizes(sample)] for name, sample in samples(result).items()]
    head = (
        *(
            "by",
            "particles",
            "laboratories visited",
            "ancestors in the prior",
            "effective number: median of the unknowns (least)",
        ),
        *("temperatures", "moves accepted at the last", "fewest misses", "most"),
    )
    return Table("The searches", head, rows)


def _sizes(sample: Sample) -> Sequence[str]:
    misses, last, own = -sample.likelihood / MISS, sample.stages[-1], worth(sample)
    effective = f"{np.median(own):.0f} ({own.min():.0f})"
    numbers = (len(sample.points), len(np.unique(sample.visited, axis=0)), last.ancestors)
    ends = f"{last.accepted:.0%}", f"{misses.min():.0f}", f"{misses.max():.0f}"
    return (*map(str, numbers), effective, str(len(sample.stages)), *ends)


def _largest(result: InferenceResult) -> Table:
    rows = [[s.figure, s.id] for s in sentences() if result.largest.true(s)]
    return Table(
        f"The largest set of sentences true at once: {len(rows)} of {len(sentences())}",
        ("figure", "sentence"),
        rows,
    )


def _never_true(result: InferenceResult) -> list[Table]:
    rows = [[a.id, f"{a.tried}", reasons().get(a.id, "none is known")] for a in result.never]
    head = ("sentence", "laboratories tried", "shortest reason")
    return [Table("Sentences that no laboratory in the ranges made true", head, rows)] if rows else []


def _exclusive(result: InferenceResult) -> list[Table]:
    rows = [_together_row(c) for c in result.contradictions]
    head = (
        *("sentences", "laboratories that judged all", "true separately (of three: each two)"),
        *("expected together", "bred for them", "verdict", "shortest reason"),
    )
    return [Table("Sentences that were never true together", head, rows)] if rows else []


def _together_row(c: Contradiction) -> list[str]:
    one = c.together
    parts = ", ".join(map(str, one.parts))
    counts = (str(one.tried), parts, f"{one.expected:.1f}", str(c.bred.tries))
    return [" + ".join(one.ids), *counts, c.verdict, c.reason or "none is known"]


def _sentences(result: InferenceResult) -> Table:
    alone = {a.id: a for a in result.table.alone()}
    rows = []
    for s in sentences():
        share = f"{alone[s.id].true} of {alone[s.id].tried}" if s.id in alone else "not searched"
        marks = [_mark(one, s) for one in laboratories(result).values()]
        rows.append([s.id, s.figure, "calibration" if s.calibrates else "validation", *marks, share])
    head = ("sentence", "figure", "half", *laboratories(result), "laboratories tried in which it is true")
    return Table("Each sentence: seeds of ten for which it is true", head, rows)


def _mark(one: Judged, sentence: Sentence) -> str:
    return f"{one.held[sentence.id]}{' true' if one.true(sentence) else ''}"


def _ranges() -> Table:
    rows = [[unknown.name.replace("_", " "), unknown.reason] for unknown in UNKNOWNS]
    return Table("Reasons for the unknowns and their ranges", ("unknown", "reason"), rows)


PAGE, DOCUMENT, FIGURE, FOUND = "index.html", "found.md", "posterior.png", "found.json"


def present(result: InferenceResult, folder: Path, command: str) -> None:
    """Writes page, document, figure and JSON into the folder."""
    style.save(drawn_figure(result.posterior), folder / FIGURE)
    write_json(folder / FOUND, with_author(as_json(result, command)))
    notes, found = [_cross_validated(result), _worth(result.posterior)], main_tables(result)
    caption = "The posterior of each unknown in shares of its prior (grey: the prior itself)."
    answer = PageAnswer(
        title="The thesis' laboratory, inferred",
        sentence=(
            f"{len(sentences())} sentences report results of the thesis' own laboratory. The search looks for values "
            f"of {len(UNKNOWNS)} unknowns under which most of them are true at once. It assumes that a sentence is "
            f"wrong about its own laboratory with a probability of {100 * WRONG:g} %. The thresholds are unchanged."
        ),
        alerts=warning_alerts(notes),
        tables=[*found, *details(result)],
        figures=with_captions({folder / FIGURE: caption}),
    )
    write_text(folder / PAGE, answer_page(answer, room="laboratory", command=command))
    write_text(folder / DOCUMENT, document(notes, found, command))


def document(notes: Sequence[str], shown: Sequence[Table], command: str) -> str:
    """Notes and tables as Markdown."""
    shown_parts = (part for table in shown for part in (f"### {table.title}", _rows(table)))
    parts = [f"{MADE} laboratory", f"Of `{command}`.", *notes, *shown_parts]
    return "\n\n".join(parts) + "\n"


def _rows(table: Table) -> str:
    lines = [table.head, ["---"] * len(table.head), *table.rows]
    return "\n".join(f"| {' | '.join(cell.replace('|', '/') for cell in line)} |" for line in lines)


def _cross_validated(result: InferenceResult) -> str:
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
        axis.set_title(unknown.name.replace("_", " "), loc="left")
        axis.set(xlim=(0.0, 1.0), yticks=[])
        if unknown.choices:
            middles = (np.arange(count) + 0.5) / count
            axis.set_xticks(
                middles,
                [
                    value_in_words(unknown, v).removeprefix("the ").removeprefix("seed ").split()[0]
                    for v in unknown.choices
                ],
                fontsize=6,
            )
        else:
            axis.set_xticks([0.0, 1.0], [f"{unknown.low:g}", f"{unknown.high:g}"], fontsize=6)
    return drawing
