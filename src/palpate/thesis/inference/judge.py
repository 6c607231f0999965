"""Every sentence judged in one laboratory, over many seeds and with the figures' own time step."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

from palpate.studies.running.local import unordered
from palpate.thesis.inference.sentences import Sentence, sentences, verdicts
from palpate.thesis.inference.trial import Trial
from palpate.thesis.laboratory.laboratory import Laboratory

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
    """The validation half."""
    return tuple(s for s in sentences() if not s.calibrates)


def judged(
    laboratory: Laboratory,
    seeds: Sequence[int] = SEEDS,
    *,
    threads: int = 1,
    told: Callable[[], None] = lambda: None,
) -> Judged:
    """Every sentence in a laboratory; `told` after each seed."""
    held = dict.fromkeys((s.id for s in sentences()), 0)
    for found in unordered(lambda seed: verdicts(Trial(laboratory, seed, FINE), sentences()), seeds, threads):
        for sentence, holds in zip(sentences(), found, strict=True):
            held[sentence.id] += holds
        told()
    return Judged(laboratory, len(seeds), held)
