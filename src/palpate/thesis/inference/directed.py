"""A directed search: laboratories bred from those that come nearest to making some sentences true at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from palpate.arrays import Array, Mask
from palpate.thesis.inference.archive import Tried
from palpate.thesis.inference.contradictions import Table
from palpate.thesis.inference.sampler import JITTER
from palpate.thesis.inference.search import Job, Runner

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


def bred(wanted: Sequence[str], among: Table, runner: Runner, tries: int, seed: int) -> Bred:
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
        found: dict[int, Tried] = {one.number: one for one in runner.tried(jobs, tuple(wanted))}
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
