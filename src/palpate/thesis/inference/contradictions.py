"""Which sentences no laboratory made true, alone or together, among all that were tried."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from palpate.thesis.inference.archive import Tried

EXPECTED = 10.0
"""Laboratories in which two sentences would both hold if they had nothing to do with each other; with fewer, that none
was found says nothing (at 10, chance alone finds none once in 20,000)."""


@dataclass(frozen=True)
class Alone:
    """A sentence by itself."""

    id: str
    true: int
    tried: int


@dataclass(frozen=True)
class Pair:
    """Two sentences that were never true together, though each was by itself."""

    first: str
    second: str
    expected: float  # laboratories with both, were they independent
    tried: int


@dataclass(frozen=True)
class Table:
    """Verdicts of laboratories, rows, on sentences, columns; `known` where it was not given up before."""

    ids: tuple[str, ...]
    true: NDArray[np.bool_]
    known: NDArray[np.bool_]

    def alone(self) -> list[Alone]:
        """Each sentence by itself."""
        return [
            Alone(id_, int((self.true[:, i] & self.known[:, i]).sum()), int(self.known[:, i].sum()))
            for i, id_ in enumerate(self.ids)
        ]

    def pairs(self) -> list[Pair]:
        """Pairs that exclude each other, the surest first."""
        found = (self._pair(i, j) for i, j in combinations(range(len(self.ids)), 2))
        return sorted((p for p in found if p is not None), key=lambda p: -p.expected)

    def _pair(self, i: int, j: int) -> Pair | None:
        both = self.known[:, i] & self.known[:, j]
        first, second, tried = self.true[both, i], self.true[both, j], int(both.sum())
        expected = float(first.mean() * second.mean() * tried) if tried else 0.0
        if expected < EXPECTED or bool((first & second).any()):
            return None
        return Pair(self.ids[i], self.ids[j], expected, tried)


def table(ids: Sequence[str], tried: Mapping[int, Tried]) -> Table:
    """The table of an archive."""
    rows = [tried[number].verdicts for number in sorted(tried)]
    true = np.zeros((len(rows), len(ids)), dtype=np.bool_)
    known = np.zeros_like(true)
    for i, verdicts in enumerate(rows):
        true[i, : len(verdicts)] = verdicts
        known[i, : len(verdicts)] = True
    return Table(tuple(ids), true, known)


def joined(whole: Table, part: Table) -> Table:
    """Both tables one above the other, by the columns of `whole`; what only it has is not known in `part`."""
    at = [whole.ids.index(id_) for id_ in part.ids]
    true, known = (np.zeros((len(part.true), len(whole.ids)), dtype=np.bool_) for _ in range(2))
    true[:, at], known[:, at] = part.true, part.known
    return Table(whole.ids, np.vstack([whole.true, true]), np.vstack([whole.known, known]))
