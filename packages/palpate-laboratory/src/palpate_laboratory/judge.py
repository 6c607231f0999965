"""Every sentence judged in one laboratory, over many seeds and with the figures' own time step."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from palpate_laboratory.contradictions import VerdictTable
from palpate_laboratory.laboratory import Laboratory
from palpate_laboratory.sentences import Sentence, sentences, verdicts
from palpate_laboratory.trial import Trial
from palpate_studies.run_one import map_unordered


@dataclass(frozen=True)
class Share:
    """Of some sentences, the share that holds in one run of a laboratory.

    Args:
        mean: over laboratories.
        spread: standard deviation from one laboratory to the next; 0 of a single one.
        of: sentences.
    """

    mean: float
    spread: float
    of: int

    def in_words(self) -> str:
        """Such as "0.54 ± 0.08"."""
        return f"{self.mean:.2f} ± {self.spread:.2f}" if self.spread else f"{self.mean:.2f}"


@dataclass(frozen=True)
class Predictive:
    """Shares of true sentences over laboratories, in the calibration half and in the validation half."""

    name: str
    laboratories: int
    calibration: Share
    validation: Share


def drawn_shares(name: str, table: VerdictTable, of: Sequence[Sentence]) -> Predictive:
    """Of the laboratories of a table that were tried by all sentences."""
    full = table.known.all(axis=1)

    def share(half: bool) -> Share:
        at = [table.ids.index(s.id) for s in of if s.calibrates is half]
        shares = table.true[full][:, at].mean(axis=1)
        return Share(float(shares.mean()), float(shares.std(ddof=1)), len(at))

    return Predictive(name, int(full.sum()), share(True), share(False))


def judged_shares(name: str, one: Judged, of: Sequence[Sentence]) -> Predictive:
    """Of one laboratory, over its seeds."""

    def share(half: bool) -> Share:
        held = [one.held[s.id] / one.seeds for s in of if s.calibrates is half]
        return Share(float(np.mean(held)), 0.0, len(held))

    return Predictive(name, 1, share(True), share(False))


FINE = 20
"""Steps of the physics in a tick, as the figures have it."""
SEEDS = tuple(range(10))


@dataclass(frozen=True)
class Judged:
    """A laboratory, and for how many of so many seeds each sentence held there, by its claim's name."""

    laboratory: Laboratory
    seeds: int
    held: Mapping[str, int]

    def true(self, sentence: Sentence) -> bool:
        """Whether a sentence holds by its claim's own rule."""
        return sentence.enough(self.held[sentence.id], self.seeds)

    def count(self, of: Iterable[Sentence]) -> int:
        """How many of them hold."""
        return sum(self.true(sentence) for sentence in of)


def calibration() -> tuple[Sentence, ...]:
    """The half of the sentences that calibrates."""
    return tuple(s for s in sentences() if s.calibrates)


def validation() -> tuple[Sentence, ...]:
    """The half of the sentences that validates."""
    return tuple(s for s in sentences() if not s.calibrates)


def judge_laboratory(
    laboratory: Laboratory,
    seeds: Sequence[int] = SEEDS,
    *,
    threads: int = 1,
    told: Callable[[], None] = lambda: None,
) -> Judged:
    """Every sentence in a laboratory; `told` after each seed."""
    held = dict.fromkeys((s.id for s in sentences()), 0)
    for found in map_unordered(
        lambda seed: verdicts(Trial(laboratory, seed, FINE), sentences()), seeds, threads
    ):
        for sentence, holds in zip(sentences(), found, strict=True):
            held[sentence.id] += holds
        told()
    return Judged(laboratory, len(seeds), held)
