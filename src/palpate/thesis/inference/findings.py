"""What an inference found, as a page, a figure and JSON."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import cache
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec
import numpy as np

from palpate.files import signed, write_json, write_text
from palpate.report import style
from palpate.report.page import Table as Shown
from palpate.report.page import page
from palpate.thesis.inference import judge
from palpate.thesis.inference.contradictions import Alone, Pair, Table
from palpate.thesis.inference.judge import Judged
from palpate.thesis.inference.posterior import Marginal, marginals, named
from palpate.thesis.inference.sampler import Sample
from palpate.thesis.inference.search import MISS, WRONG
from palpate.thesis.inference.sentences import Sentence, sentences
from palpate.thesis.laboratory.laboratory import values
from palpate.thesis.laboratory.unknowns import UNKNOWNS, Unknown

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PAGE, FIGURE, FOUND = "index.html", "posterior.png", "found.json"


@dataclass(frozen=True)
class Result:
    """What was found.

    Args:
        half: the posterior by the half that calibrates.
        all: by all sentences; None where only the half was asked for.
        bench: the hand-chosen laboratory, judged.
        by_half, by_all: the laboratory of each posterior that misses fewest sentences, over ten seeds.
        table: verdicts of all laboratories that were tried.
    """

    half: Sample
    all: Sample | None
    bench: Judged
    by_half: Judged
    by_all: Judged
    table: Table

    @property
    def posterior(self) -> Sample:
        """By as many sentences as were asked for."""
        return self.half if self.all is None else self.all

    @property
    def better(self) -> bool:
        """Whether the laboratory by half is better than the bench on the half that was held out."""
        return self.by_half.count(judge.validation()) > self.bench.count(judge.validation())

    @property
    def largest(self) -> Judged:
        """The laboratory with the largest set of sentences that hold at once over ten seeds."""
        return max((self.by_all, self.by_half, self.bench), key=lambda j: j.count(sentences()))

    @property
    def never(self) -> list[Alone]:
        """Sentences that no laboratory of the search made true, nor one of those that were judged."""
        found = {s.id for j in (self.bench, self.by_half, self.by_all) for s in sentences() if j.held[s.id]}
        return [one for one in self.table.alone() if one.true == 0 and one.id not in found]

    @property
    def contradictions(self) -> list[Pair]:
        """Pairs of sentences that no laboratory made true together."""
        held = [{s.id for s in sentences() if j.true(s)} for j in (self.bench, self.by_half, self.by_all)]
        return [p for p in self.table.pairs() if not any({p.first, p.second} <= ids for ids in held)]


def present(result: Result, folder: Path, command: str) -> None:
    """Writes page, figure and JSON into the folder."""
    style.save(drawn_figure(result.posterior), folder / FIGURE)
    write_json(folder / FOUND, signed(as_json(result, command)))
    whole = page(
        title="The thesis' laboratory, inferred",
        about=(
            f"{len(sentences())} sentences tell what the thesis' own laboratory showed. Searched are the "
            f"{len(UNKNOWNS)} unknowns under which most of them are true at once; a sentence is taken to be wrong "
            f"about its own laboratory with a probability of {100 * WRONG:g} %. No threshold of a claim is changed."
        ),
        notes=[_told(result), _worth(result.posterior)],
        tables=[
            _counts(result),
            _posterior(result),
            *_never(result),
            *_pairs(result),
            _sentences(result),
            _searches(result),
            _ranges(),
        ],
        figures={
            folder / FIGURE: "The posterior of each unknown in shares of its prior (grey: the prior itself)."
        },
        command=command,
    )
    write_text(folder / PAGE, whole)


def _told(result: Result) -> str:
    better = "is better than" if result.better else "is not better than"
    follows = "could take its place" if result.better else "stays the default"
    return (
        f"On the half that was held out, the laboratory inferred from the other half {better} the hand-chosen bench, "
        f"which {follows}. The largest set of sentences found true at once has {result.largest.count(sentences())} of "
        f"{len(sentences())}."
    )


def _worth(sample: Sample) -> str:
    last = sample.stages[-1]
    return (
        f"The posterior is {len(sample.points)} particles, {last.distinct} of which differ; they come from "
        f"{last.ancestors} points of the prior, and are worth at least so many independent laboratories. With few of "
        "them a narrow range tells where the search went as much as what the thesis tells; more --particles are surer."
    )


def halves() -> dict[str, tuple[Sentence, ...]]:
    """The two halves and all."""
    return {"calibration": judge.calibration(), "validation": judge.validation(), "all": sentences()}


def laboratories(result: Result) -> dict[str, Judged]:
    """Those that are compared."""
    found = {"hand-chosen bench": result.bench, "inferred from the half": result.by_half}
    return found if result.all is None else {**found, "inferred from all": result.by_all}


def _counts(result: Result) -> Shown:
    rows = [
        [name, *(f"{one.count(of)} of {len(of)}" for of in halves().values())]
        for name, one in laboratories(result).items()
    ]
    head = ("laboratory", "true in the half that calibrates", "in the half held out", "in all")
    return Shown("Sentences that are true, over ten seeds", head, rows)


def _posterior(result: Result) -> Shown:
    rows = [
        [m.unknown.name.replace("_", " "), _prior(m.unknown), m.in_words(), m.verdict]
        for m in marginals(result.posterior.points)
    ]
    head = ("unknown", "prior", "posterior: middle (5 to 95 %)", "the thesis tells it?")
    return Shown("What the thesis tells of its laboratory", head, rows)


def _ranges() -> Shown:
    rows = [[unknown.name.replace("_", " "), unknown.reason] for unknown in UNKNOWNS]
    return Shown("Why these unknowns, and these ranges", ("unknown", "reason"), rows)


def _prior(unknown: Unknown) -> str:
    if unknown.prior == "any seed":
        return "any"
    if unknown.choices:
        return " or ".join(named(unknown, v) for v in unknown.choices)
    return f"{unknown.low:g} to {unknown.high:g} {unknown.unit}, {unknown.prior}".replace(" ,", ",")


@cache
def reasons() -> dict[str, str]:
    """Why a sentence is never true, or two exclude each other: by its name, or both joined by " + "."""
    text = resources.files("palpate.thesis.inference").joinpath("reasons.toml").read_text("utf-8")
    return msgspec.toml.decode(text, type=dict[str, str])


def _never(result: Result) -> list[Shown]:
    rows = [[a.id, f"{a.tried}", reasons().get(a.id, "not found")] for a in result.never]
    head = ("sentence", "laboratories tried", "shortest reason")
    return [Shown("Sentences that no laboratory in the ranges made true", head, rows)] if rows else []


def _pairs(result: Result) -> list[Shown]:
    rows = [
        [
            p.first,
            p.second,
            f"{p.expected:.0f} of {p.tried}",
            reasons().get(f"{p.first} + {p.second}", "not found"),
        ]
        for p in result.contradictions
    ]
    head = ("sentence", "never together with", "expected together, were they independent", "shortest reason")
    return [Shown("Sentences that exclude each other", head, rows)] if rows else []


def _sentences(result: Result) -> Shown:
    alone = {a.id: a for a in result.table.alone()}
    rows = []
    for s in sentences():
        share = f"{alone[s.id].true} of {alone[s.id].tried}" if s.id in alone else "not searched"
        marks = [_mark(one, s) for one in laboratories(result).values()]
        rows.append([s.id, s.figure, "calibration" if s.calibrates else "validation", *marks, share])
    head = (
        "sentence",
        "figure",
        "half",
        *laboratories(result),
        "laboratories of the search that made it true",
    )
    return Shown("Sentence by sentence: seeds of ten for which it holds", head, rows)


def _mark(one: Judged, sentence: Sentence) -> str:
    return f"{one.held[sentence.id]}{' true' if one.true(sentence) else ''}"


def _searches(result: Result) -> Shown:
    samples = {"the calibration half": result.half, "all": result.all}
    rows = [[name, *_sizes(sample)] for name, sample in samples.items() if sample is not None]
    head = (
        *("by", "particles", "that differ", "ancestors in the prior"),
        *("temperatures", "moves accepted at the last", "fewest misses", "most"),
    )
    return Shown("The searches", head, rows)


def _sizes(sample: Sample) -> Sequence[str]:
    misses = -sample.likelihood / MISS
    last = sample.stages[-1]
    numbers = (len(sample.points), last.distinct, last.ancestors, len(sample.stages))
    return (*map(str, numbers), f"{last.accepted:.0%}", f"{misses.min():.0f}", f"{misses.max():.0f}")


def as_json(result: Result, command: str) -> dict[str, Any]:
    """The page's numbers."""
    return {
        "command": command,
        "better_on_validation_half": result.better,
        "true": {
            name: {half: {"true": one.count(of), "of": len(of)} for half, of in halves().items()}
            for name, one in laboratories(result).items()
        },
        "laboratories": {name: values(one.laboratory) for name, one in laboratories(result).items()},
        "posterior": [_told_of(m) for m in marginals(result.posterior.points)],
        "never": [asdict(a) for a in result.never],
        "never_together": [asdict(p) for p in result.contradictions],
        "stages_of_half": [asdict(stage) for stage in result.half.stages],
        "stages_of_all": [asdict(stage) for stage in result.all.stages] if result.all else None,
        "sentences": {
            s.id: {name: one.held[s.id] for name, one in laboratories(result).items()} for s in sentences()
        },
    }


def _told_of(m: Marginal) -> dict[str, Any]:
    own = {"low": m.low, "middle": m.middle, "high": m.high, "width": m.width}
    return {"unknown": m.unknown.name, "unit": m.unknown.unit, **own, "verdict": m.verdict}


def drawn_figure(sample: Sample) -> Figure:
    """A small panel for each unknown: where its posterior lies in shares of its prior."""
    from matplotlib.figure import Figure

    columns, bins = 6, 10
    rows = -(-len(UNKNOWNS) // columns)
    drawing = Figure(figsize=(11.0, 1.3 * rows), dpi=style.DPI, layout="constrained")
    axes = drawing.subplots(rows, columns).ravel()
    for axis in axes[len(UNKNOWNS) :]:
        axis.remove()
    for i, (axis, unknown) in enumerate(zip(axes, UNKNOWNS, strict=False)):
        style.plain(axis)
        count = len(unknown.choices) or bins
        axis.hist(
            sample.points[:, i], bins=count, range=(0.0, 1.0), density=True, color=style.SERIES[0], alpha=0.8
        )
        axis.axhline(1.0, color=style.MEASURED, linewidth=1.0)
        axis.set_title(unknown.name.replace("_", " "), fontsize=8, loc="left")
        axis.set(xlim=(0.0, 1.0), yticks=[])
        if unknown.choices:
            middles = (np.arange(count) + 0.5) / count
            axis.set_xticks(middles, [named(unknown, v).split()[0] for v in unknown.choices], fontsize=6)
        else:
            axis.set_xticks([0.0, 1.0], [f"{unknown.low:g}", f"{unknown.high:g}"], fontsize=6)
    return drawing
