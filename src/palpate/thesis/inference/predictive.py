"""How many sentences hold in laboratories that were drawn, not chosen: of the prior, and of a posterior."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from palpate.thesis.inference.contradictions import Table
from palpate.thesis.inference.judge import Judged
from palpate.thesis.inference.sentences import Sentence


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


def drawn_shares(name: str, table: Table, of: Sequence[Sentence]) -> Predictive:
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
