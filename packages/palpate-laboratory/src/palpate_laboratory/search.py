"""From the sentences to the laboratories under which they are most probable."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

import msgspec
import numpy as np

import palpate_thesis
from palpate._jit import sources_stamp
from palpate.arrays import Array
from palpate_laboratory import archive, sampler
from palpate_laboratory.archive import Archive, SearchIdentity, Tried
from palpate_laboratory.laboratory import laboratory_at
from palpate_laboratory.sampler import Sample, Settings
from palpate_laboratory.sentences import HOLDS, Sentence
from palpate_laboratory.trial import STEPS, Trial
from palpate_laboratory.unknowns import UNKNOWNS
from palpate_studies.run_one import map_unordered

if TYPE_CHECKING:
    from palpate_studies.cluster import Cluster

Progress = Callable[[float, int, int], None]
MOST_WRONG = 0.5
"""At most so probable is it that a sentence does not hold in the very laboratory it was written in: beyond, it would
tell the contrary of what it says."""
WRONG = 0.5 * MOST_WRONG
"""How probable it is, not knowing which sentence is how reliable: the mean of an even prior from 0 to `MOST_WRONG`,
each sentence having a probability of its own. Integrated over, that is all that remains of it."""
MISS = math.log((1.0 - WRONG) / WRONG)
"""Decrease of the log-likelihood by one false sentence."""


class Job(msgspec.Struct, frozen=True):
    """A laboratory to be tried until it misses more sentences than are allowed."""

    number: int
    shares: tuple[float, ...]
    allowed: float


class Runner(Protocol):
    """Tries laboratories: here, or on a cluster."""

    def try_all(self, jobs: Iterable[Job], ids: tuple[str, ...]) -> Iterator[Tried]:
        """Results of the jobs, in any order, by the sentences of these names."""
        ...


class Threads:
    """This machine's cores: compiled loops release the interpreter."""

    def __init__(self, threads: int):
        self._threads = threads

    def try_all(self, jobs: Iterable[Job], ids: tuple[str, ...]) -> Iterator[Tried]:
        """As they are done; who stops asking stops the runs that are under way."""
        stop = threading.Event()
        try:
            yield from map_unordered(lambda job: attempt(job, ids, stop.is_set), jobs, self._threads)
        finally:
            stop.set()


class Workers:
    """The workers of a Dask cluster, which have the same sources."""

    def __init__(self, cluster: Cluster):
        self._cluster = cluster

    def try_all(self, jobs: Iterable[Job], ids: tuple[str, ...]) -> Iterator[Tried]:
        """As they are done."""
        return self._cluster.map(partial(attempt, ids=ids), jobs)


@dataclass(frozen=True)
class PosteriorSearch:
    """A search.

    Args:
        sentences: that decide, in the order in which they are tried.
        settings: of the sampler.
        runner: who tries.
        progress: told the power of the likelihood, and how many laboratories of how many are done there.
        borrowed: verdicts of these sentences from another search that began with the same laboratories.
    """

    sentences: Sequence[Sentence]
    settings: Settings
    runner: Runner
    progress: Progress = lambda _power, _done, _of: None
    borrowed: Mapping[int, Tried] = field(default_factory=dict)

    def run(self, path: Path) -> Sample:
        """The posterior; every laboratory is in the archive at `path` as soon as it is tried.

        Raises:
            InputError: the archive is of another search.
        """
        with archive.open_archive(path, self.head()) as book:
            redrawn = np.array([unknown.redrawn for unknown in UNKNOWNS])
            asked = _Likelihood(self, book)
            return sampler.sample(asked, redrawn, self.settings, asked.begin)

    def survey(self, path: Path) -> None:
        """Tries the laboratories of the prior alone, with which `run` begins."""
        self.try_points(path, sampler.prior(self.settings, len(UNKNOWNS)), 0)

    def try_points(self, path: Path, points: Array, first: int) -> None:
        """Tries these laboratories, shape (n, d), each by all sentences, numbered from `first` on."""
        with archive.open_archive(path, self.head()) as book:
            asked = _Likelihood(self, book, first)
            asked.begin(0.0, len(points))
            asked(points, np.full(len(points), -np.inf))

    def head(self) -> SearchIdentity:
        """Identity of its archive."""
        from palpate import __version__

        told = f"{self.settings} steps {STEPS} {[u.name for u in UNKNOWNS]}"
        ids = tuple(s.id for s in self.sentences)
        return SearchIdentity(str(__version__), told, stamp(), ids)


@dataclass
class _Likelihood:
    """The likelihood as the sampler asks for it; what the archive knows is not tried again."""

    search: PosteriorSearch
    book: Archive
    number: int = 0
    power: float = 0.0
    done: int = 0  # at this power
    of: int = 0

    def begin(self, power: float, count: int) -> None:
        """From now on at this power of the likelihood, so many laboratories."""
        self.power, self.done, self.of = power, 0, count

    def __call__(self, points: Array, floor: Array) -> Array:
        allowed = np.floor(-floor / MISS + 1e-9)
        jobs = [
            Job(self.number + i, tuple(point.tolist()), float(most))
            for i, (point, most) in enumerate(zip(points, allowed, strict=True))
        ]
        self.number += len(jobs)
        for job in jobs:
            other = self.search.borrowed.get(job.number)
            if other is not None and other.shares == job.shares and job.number not in self.book.known:
                self.book.add(other)
        missing = [job for job in jobs if job.number not in self.book.known]
        self._progress(len(jobs) - len(missing))
        self._try(missing)
        return np.array([-MISS * self._misses(job) for job in jobs])

    def _try(self, jobs: Sequence[Job]) -> None:
        for tried in self.search.runner.try_all(jobs, tuple(s.id for s in self.search.sentences)):
            self.book.add(tried)
            self._progress(1)

    def _progress(self, more: int) -> None:
        self.done += more
        self.search.progress(self.power, self.done, self.of)

    def _misses(self, job: Job) -> float:
        """Of the sentences; of one that was given up, more than are allowed."""
        verdicts = self.book.known[job.number].verdicts
        return float(verdicts.count(False))


def borrow(
    path: Path, head: SearchIdentity, of: Sequence[Sentence], wanted: Sequence[Sentence]
) -> dict[int, Tried]:
    """Verdicts on the wanted sentences in another search's archive, if not given up; nothing without one."""
    if not path.exists():
        return {}
    there, known = archive.read(path)
    if there != head:
        return {}
    at = [of.index(sentence) for sentence in wanted]
    return {
        number: Tried(number, one.shares, tuple(one.verdicts[i] for i in at))
        for number, one in known.items()
        if len(one.verdicts) == len(of)
    }


@cache
def stamp() -> str:
    """Hash of the sources that a trial consists of."""
    return sources_stamp(*sources())


def sources() -> list[Path]:
    """The files that a trial consists of: parts of the figures, and what asks them."""
    here, thesis = Path(__file__).parent, Path(palpate_thesis.__file__).parent
    of_figures = ("figures", "force_control", "least_squares", "neural_identifier")
    files = [path for folder in of_figures for path in sorted((thesis / folder).rglob("*.py"))]
    return [*files, *(here / f"{name}.py" for name in ("trial", "sentences", "laboratory", "unknowns"))]


def attempt(job: Job, ids: Sequence[str], stopped: Callable[[], bool] = lambda: False) -> Tried:
    """One laboratory, sentence by sentence in the order of their names, until it misses more than are allowed.

    Each has a noise of its own, so that what is found does not hang on one draw of it.
    """
    trial = Trial(laboratory_at(job.shares), job.number, stopped=stopped)
    verdicts: list[bool] = []
    missed = 0
    for id_ in ids:
        verdicts.append(bool(HOLDS[id_](trial)))
        missed += not verdicts[-1]
        if missed > job.allowed:
            break
    return Tried(job.number, job.shares, tuple(verdicts))
