"""Which sentences no laboratory made true, alone or together, among all that were tried."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from palpate.arrays import Array, Mask
from palpate_laboratory.archive import Tried
from palpate_laboratory.sampler import JITTER
from palpate_laboratory.search import Job, Runner

POOL = 16
"""Laboratories kept for each sentence: those that make it true, and most of the others with it."""
BROOD = 16
"""Laboratories bred before the pools are looked at again."""
FIRST = 10_000_000
"""Number of the first of them, so that no noise of a search comes twice."""


@dataclass(frozen=True)
class Bred:
    """Result of a directed search.

    Args:
        tries: laboratories that were bred.
        most: sentences that the best of all, bred or not, makes true.
        shares: where it lies.
    """

    tries: int
    most: int
    shares: tuple[float, ...]


def breed(wanted: Sequence[str], among: VerdictTable, runner: Runner, tries: int, seed: int) -> Bred:
    """Breeds up to `tries` laboratories for as many of the wanted sentences as can be had; stops when it has all.

    Each is a child of two laboratories, one that makes this sentence true and one that makes another: each unknown is
    either's, and a few are moved besides. Only the sentences wanted are asked for.
    """
    rng = np.random.default_rng([seed, len(wanted), *(among.ids.index(one) for one in wanted)])
    columns = [among.ids.index(one) for one in wanted]
    known = among.known[:, columns].all(axis=1)
    shares, true = among.shares[known], among.true[known][:, columns]
    done = 0
    while done < tries and not true.all(axis=1).any():
        children = _children(shares, true, min(BROOD, tries - done), rng)
        jobs = [
            Job(FIRST + done + i, tuple(child.tolist()), float("inf")) for i, child in enumerate(children)
        ]
        found: dict[int, Tried] = {one.number: one for one in runner.try_all(jobs, tuple(wanted))}
        true = np.vstack([true, [found[job.number].verdicts for job in jobs]])
        shares = np.vstack([shares, children])
        done += len(jobs)
    best = int(np.argmax(true.sum(axis=1)))
    return Bred(done, int(true[best].sum()), tuple(shares[best].tolist()))


def _children(shares: Array, true: Mask, count: int, rng: np.random.Generator) -> Array:
    pools = [_pool(true, column) for column in range(true.shape[1]) if true[:, column].any()]
    return np.array([_child(shares, pools, rng) for _ in range(count)])


def _pool(true: Mask, column: int) -> NDArray[np.int64]:
    """Laboratories that make a sentence true, those with most of the others first; of equals the newest."""
    some = np.flatnonzero(true[:, column])[::-1]
    return some[np.argsort(-true[some].sum(axis=1), kind="stable")][:POOL]


def _child(shares: Array, pools: Sequence[NDArray[np.int64]], rng: np.random.Generator) -> Array:
    first, second = rng.choice(len(pools), 2, replace=len(pools) < 2)
    one, other = shares[rng.choice(pools[first])], shares[rng.choice(pools[second])]
    child = np.where(rng.random(len(one)) < 0.5, one, other)
    moved = rng.random(len(one)) < 1.0 / 8.0
    by = np.where(moved, 5.0 * JITTER * rng.standard_normal(len(one)), 0.0)
    there = 1.0 - np.abs(1.0 - np.mod(child + by, 2.0))
    return np.asarray(np.minimum(there, np.nextafter(1.0, 0.0)))


CHANCE = 0.05
"""How probable it may be that chance alone leaves one of all sets of a size without a laboratory."""
LARGEST = 3
"""Sentences in a set, at most: of larger ones too few laboratories make every part true."""


@dataclass(frozen=True)
class Alone:
    """A sentence by itself."""

    id: str
    true: int
    tried: int


@dataclass(frozen=True)
class Together:
    """Sentences that were never true together, though all but any one of them were.

    Args:
        ids: of the sentences.
        parts: laboratories that made true, of two sentences, each; of three, each two: all but the first, the second,
            the third.
        tried: laboratories by which all of them are known.
        expected: laboratories that would make all true, had they no more to do with each other than their parts have.
        enough: what `expected` has to be for chance to leave no such set without a laboratory.
    """

    ids: tuple[str, ...]
    parts: tuple[int, ...]
    tried: int
    expected: float
    enough: float

    @property
    def excluded(self) -> bool:
        """Whether they exclude each other significantly, given so many laboratories."""
        return self.expected >= self.enough


@dataclass(frozen=True)
class VerdictTable:
    """Verdicts of laboratories, rows, on sentences, columns; `known` where it was not given up before."""

    ids: tuple[str, ...]
    shares: Array  # of the priors, where the laboratories lie
    true: Mask
    known: Mask

    def alone(self) -> list[Alone]:
        """Each sentence by itself."""
        return [
            Alone(id_, int((self.true[:, i] & self.known[:, i]).sum()), int(self.known[:, i].sum()))
            for i, id_ in enumerate(self.ids)
        ]

    def counts(self) -> NDArray[np.int64]:
        """How many sentences each laboratory makes true, of those that are known."""
        return np.asarray((self.true & self.known).sum(axis=1))

    def never_together(self) -> list[Together]:
        """Sets of two and three that no laboratory made true, the surest of each size first."""
        found = [one for size in range(2, min(LARGEST, len(self.ids)) + 1) for one in self._sets(size)]
        return sorted(found, key=lambda one: (len(one.ids), -one.expected))

    def _sets(self, size: int) -> Iterator[Together]:
        enough = math.log(math.comb(len(self.ids), size) / CHANCE)
        for columns in combinations(range(len(self.ids)), size):
            both = self.known[:, columns].all(axis=1)
            true = self.true[both][:, columns]
            if not len(true) or true.all(axis=1).any():
                continue
            parts = tuple(int(np.delete(true, i, axis=1).all(axis=1).sum()) for i in range(size))
            if all(parts):
                told = parts[::-1] if size == 2 else parts
                yield Together(
                    tuple(self.ids[i] for i in columns), told, len(true), _expected_count(true, parts), enough
                )


def _expected_count(true: Mask, parts: Sequence[int]) -> float:
    """Laboratories with all, if each part is as frequent as it is and nothing else ties them (Kirkwood, 1935)."""
    n, alone = len(true), true.mean(axis=0)
    shares = np.array(parts) / n
    return float(n * np.prod(shares) / (np.prod(alone) if len(parts) > 2 else 1.0))


def table(ids: Sequence[str], tried: Mapping[int, Tried]) -> VerdictTable:
    """The table of an archive."""
    some = [tried[number] for number in sorted(tried)]
    true = np.zeros((len(some), len(ids)), dtype=np.bool_)
    known = np.zeros_like(true)
    for i, one in enumerate(some):
        true[i, : len(one.verdicts)] = one.verdicts
        known[i, : len(one.verdicts)] = True
    return VerdictTable(tuple(ids), np.array([one.shares for one in some]), true, known)


def join(whole: VerdictTable, *parts: VerdictTable) -> VerdictTable:
    """Tables one above the other, by the columns of `whole`; what only it has is not known in the others."""
    true, known = [whole.true], [whole.known]
    for part in parts:
        at = [whole.ids.index(id_) for id_ in part.ids]
        for stack, some in ((true, part.true), (known, part.known)):
            wide = np.zeros((len(some), len(whole.ids)), dtype=np.bool_)
            wide[:, at] = some
            stack.append(wide)
    shares = [one.shares for one in (whole, *parts) if len(one.shares)]
    return VerdictTable(whole.ids, np.vstack(shares), np.vstack(true), np.vstack(known))
