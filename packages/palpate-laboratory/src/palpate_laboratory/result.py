"""Results of an inference, and their numbers."""

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import cache
from importlib import resources
from typing import Any

import msgspec
import numpy as np

from palpate.arrays import Array
from palpate_laboratory import judge
from palpate_laboratory.contradictions import CHANCE, Alone, Bred, Together, VerdictTable
from palpate_laboratory.judge import Judged, Predictive
from palpate_laboratory.sampler import Sample
from palpate_laboratory.sentences import Sentence, sentences
from palpate_laboratory.unknowns import LAWS, LISTING, UNKNOWNS, Unknown

TOLD, HARDLY = 0.5, 0.8
"""The middle nine tenths of the posterior take at most this share of the prior's: told; hardly; beyond, not told."""
MIDDLE = (0.05, 0.5, 0.95)


@dataclass(frozen=True)
class Marginal:
    """One unknown.

    Args:
        unknown: which.
        low, middle, high: its value at 5, 50 and 95 % of the posterior; of one of a few, the likeliest in `middle`.
        width: of the middle nine tenths, as a share of the prior's; of one of a few, the share of the likeliest.
    """

    unknown: Unknown
    low: float
    middle: float
    high: float
    width: float

    @property
    def verdict(self) -> str:
        """Whether the thesis determines it, in a word."""
        if self.unknown.prior == "any seed":
            return "not told"
        if self.unknown.choices:
            even = 1.0 / len(self.unknown.choices)
            gained = (self.width - even) / (1.0 - even)
            return "told" if gained >= 1.0 - 0.5 * TOLD else "hardly told" if gained >= TOLD else "not told"
        return "told" if self.width <= TOLD else "hardly told" if self.width <= HARDLY else "not told"

    def in_words(self) -> str:
        """Value and range, with its unit."""
        unit = f" {self.unknown.unit}".rstrip()
        if self.unknown.prior == "any seed":
            return "any"
        if self.unknown.choices:
            return f"{value_in_words(self.unknown, self.middle)}{unit} ({100 * self.width:.0f} %)"
        low, middle, high = (f"{float(f'{v:.3g}'):g}" for v in (self.low, self.middle, self.high))
        return f"{middle} ({low} to {high}){unit}"


def worth(sample: Sample) -> Array:
    """As many independent laboratories would know the mean of each unknown as well, shape (d,).

    The variance of a mean is estimated by families, the particles of one ancestor, which are taken to be independent of
    each other and of nothing else (Chan and Lai, 2013): many moves make relatives strangers, few do not.
    """
    away = sample.visited - sample.visited.mean(axis=0)
    families = np.array([away[sample.ancestors == one].sum(axis=0) for one in np.unique(sample.ancestors)])
    most, count = len(away), len(families)
    if count == 1:
        return np.ones(away.shape[1])
    between = (families**2).sum(axis=0) * count / (count - 1.0)
    within = (away**2).sum(axis=0)
    return np.clip(np.where(between > 0.0, most * within / np.maximum(between, 1e-300), most), 1.0, most)


def value_in_words(unknown: Unknown, value: float) -> str:
    """A value of one of a few in words."""
    if unknown.name == "foam_law":
        return LAWS[value]
    if unknown.name == "controller_weights":
        return "the listing's" if value == LISTING else f"seed {value:g}"
    return f"{value:g}"


def marginals(points: Array) -> list[Marginal]:
    """Of each unknown, from points of the posterior in shares of the prior, shape (n, d)."""
    return [_marginal(unknown, points[:, i]) for i, unknown in enumerate(UNKNOWNS)]


def _marginal(unknown: Unknown, shares: Array) -> Marginal:
    if unknown.choices:
        values, counts = np.unique([unknown.at(float(s)) for s in shares], return_counts=True)
        best = int(np.argmax(counts))
        value = float(values[best])
        return Marginal(unknown, value, value, value, float(counts[best] / len(shares)))
    low, middle, high = (float(q) for q in np.quantile(shares, MIDDLE))
    return Marginal(unknown, unknown.at(low), unknown.at(middle), unknown.at(high), (high - low) / 0.9)


NOT_FOUND, EXCLUDED, IMPOSSIBLE = "not found", "exclude each other", "impossible in the ranges"


@dataclass(frozen=True)
class Contradiction:
    """Sentences that were never true together, and the result of a search for just them."""

    together: Together
    bred: Bred

    @property
    def stands(self) -> bool:
        """Whether the search for them found none either."""
        return self.bred.most < len(self.together.ids)

    @property
    def reason(self) -> str:
        """The shortest one, if one is known."""
        return reasons().get(" + ".join(self.together.ids), "")

    @property
    def verdict(self) -> str:
        """In words: impossible where a law says so, excluded where numbers do, else not found."""
        if self.reason:
            return IMPOSSIBLE
        return EXCLUDED if self.together.excluded else NOT_FOUND


@dataclass(frozen=True)
class InferenceResult:
    """Results of the inference.

    Args:
        half: the posterior by the calibration half.
        all: by all sentences; None where only the half was asked for.
        bench: the hand-chosen laboratory, judged.
        by_half, by_all: the best laboratory of each posterior, by the sentences it was inferred from, over ten seeds.
        judged: all laboratories that were looked at over ten seeds.
        predictive: shares of true sentences in drawn laboratories.
        sets: sentences never true together, each set searched for by itself.
        table: verdicts of all laboratories that were tried.
    """

    half: Sample
    all: Sample | None
    bench: Judged
    by_half: Judged
    by_all: Judged
    judged: Sequence[Judged]
    predictive: Sequence[Predictive]
    sets: Sequence[Contradiction]
    table: VerdictTable

    @property
    def posterior(self) -> Sample:
        """By as many sentences as were asked for."""
        return self.half if self.all is None else self.all

    @property
    def cross_validation(self) -> tuple[int, int]:
        """Sentences of the validation half that are true only in the laboratory by half, and only on the bench."""
        there, here = ({s.id for s in judge.validation() if j.true(s)} for j in (self.by_half, self.bench))
        return len(there - here), len(here - there)

    @property
    def by_chance(self) -> float:
        """Probability of so good a result on the validation half under equal quality of the bench: a sign test."""
        there, here = self.cross_validation
        return sum(math.comb(there + here, k) for k in range(there, there + here + 1)) / 2.0 ** (there + here)

    @property
    def better(self) -> bool:
        """Whether the laboratory by half is significantly better than the bench on the validation half."""
        return self.by_chance <= CHANCE

    @property
    def largest(self) -> Judged:
        """The laboratory with the largest set of sentences that hold at once over ten seeds."""
        return max(self.judged, key=lambda j: j.count(sentences()))

    @property
    def never(self) -> list[Alone]:
        """Sentences that no laboratory of the search made true, nor one of those that were judged."""
        found = {s.id for j in self.judged for s in sentences() if j.held[s.id]}
        return [one for one in self.table.alone() if one.true == 0 and one.id not in found]

    @property
    def contradictions(self) -> list[Contradiction]:
        """Sets of sentences that no laboratory made true together, in any run."""
        held = [{s.id for s in sentences() if j.true(s)} for j in self.judged]
        return [c for c in self.sets if c.stands and not any(set(c.together.ids) <= ids for ids in held)]


def halves() -> dict[str, tuple[Sentence, ...]]:
    """The two halves and all."""
    return {"calibration": judge.calibration(), "validation": judge.validation(), "all": sentences()}


def laboratories(result: InferenceResult) -> dict[str, Judged]:
    """Those that are compared."""
    found = {"hand-chosen bench": result.bench, "inferred from the half": result.by_half}
    if result.all is not None:
        found["inferred from all"] = result.by_all
    return found


def samples(result: InferenceResult) -> dict[str, Sample]:
    """Posteriors of both searches by name."""
    found = {"the calibration half": result.half}
    return found if result.all is None else {**found, "all sentences": result.all}


@cache
def reasons() -> dict[str, str]:
    """Why a sentence is never true, or several exclude each other: by its name, or all joined by " + "."""
    text = resources.files("palpate_laboratory").joinpath("reasons.toml").read_text("utf-8")
    return msgspec.toml.decode(text, type=dict[str, str])


def as_json(result: InferenceResult, command: str) -> dict[str, Any]:
    """Numbers of the page, for --json and found.json."""
    return {
        "command": command,
        "held_out": {
            "only_inferred": result.cross_validation[0],
            "only_bench": result.cross_validation[1],
            "by_chance": result.by_chance,
            "better": result.better,
        },
        "true": {
            name: {half: {"true": one.count(of), "of": len(of)} for half, of in halves().items()}
            for name, one in laboratories(result).items()
        },
        "predictive": [asdict(one) for one in result.predictive],
        "laboratories": {name: one.laboratory.numbers() for name, one in laboratories(result).items()},
        "largest": [s.id for s in sentences() if result.largest.true(s)],
        "posterior": [_numbers_of(m) for m in marginals(result.posterior.visited)],
        "never": [{**asdict(a), "reason": reasons().get(a.id, "")} for a in result.never],
        "never_together": [_contradiction(c) for c in result.contradictions],
        "tried": len(result.table.true),
        "searches": {name: _search(sample) for name, sample in samples(result).items()},
        "sentences": {
            s.id: {name: one.held[s.id] for name, one in laboratories(result).items()} for s in sentences()
        },
    }


def _numbers_of(m: Marginal) -> dict[str, Any]:
    own = {"low": m.low, "middle": m.middle, "high": m.high, "width": m.width}
    return {"unknown": m.unknown.name, "unit": m.unknown.unit, **own, "verdict": m.verdict}


def _contradiction(c: Contradiction) -> dict[str, Any]:
    return {
        "sentences": list(c.together.ids),
        "laboratories": c.together.tried,
        "parts": list(c.together.parts),
        "expected": c.together.expected,
        "bred": c.bred.tries,
        "verdict": c.verdict,
        "reason": c.reason,
    }


def _search(sample: Sample) -> dict[str, Any]:
    own = worth(sample)
    effective = {"least": float(own.min()), "median": float(np.median(own)), "most": float(own.max())}
    return {"effective": effective, "stages": [asdict(stage) for stage in sample.stages]}
