"""Results of an inference, as tables of text."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from palpate.report.page import Table
from palpate.thesis.inference.judge import Judged
from palpate.thesis.inference.posterior import marginals, named, worth
from palpate.thesis.inference.result import Contradiction, Result, halves, laboratories, reasons, samples
from palpate.thesis.inference.sampler import Sample
from palpate.thesis.inference.search import MISS
from palpate.thesis.inference.sentences import Sentence, sentences
from palpate.thesis.laboratory.unknowns import UNKNOWNS, Unknown


def found(result: Result) -> list[Table]:
    """Tables of the page and of the document."""
    return [
        _counts(result),
        _predictive(result),
        posterior(result),
        _searches(result),
        _largest(result),
        *_never(result),
        *_together(result),
    ]


def details(result: Result) -> list[Table]:
    """Tables of the page alone."""
    return [_sentences(result), _ranges()]


def _counts(result: Result) -> Table:
    rows = [
        [name, *(f"{one.count(of)} of {len(of)}" for of in halves().values())]
        for name, one in laboratories(result).items()
    ]
    head = ("laboratory", "true in the calibration half", "in the validation half", "in all")
    return Table("Sentences that are true, over ten seeds", head, rows)


def _predictive(result: Result) -> Table:
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


def posterior(result: Result) -> Table:
    """Of each unknown."""
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
        return " or ".join(named(unknown, v) for v in unknown.choices)
    return f"{unknown.low:g} to {unknown.high:g} {unknown.unit}, {unknown.prior}".replace(" ,", ",")


def _searches(result: Result) -> Table:
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


def _largest(result: Result) -> Table:
    rows = [[s.figure, s.id] for s in sentences() if result.largest.true(s)]
    return Table(
        f"The largest set of sentences true at once: {len(rows)} of {len(sentences())}",
        ("figure", "sentence"),
        rows,
    )


def _never(result: Result) -> list[Table]:
    rows = [[a.id, f"{a.tried}", reasons().get(a.id, "none is known")] for a in result.never]
    head = ("sentence", "laboratories tried", "shortest reason")
    return [Table("Sentences that no laboratory in the ranges made true", head, rows)] if rows else []


def _together(result: Result) -> list[Table]:
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


def _sentences(result: Result) -> Table:
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
