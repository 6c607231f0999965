"""Search for the laboratory in which most of the thesis' sentences hold at once; resumable."""

from __future__ import annotations

import json
import threading
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import msgspec
import numpy as np

from palpate.errors import InputError
from palpate.files import MADE, check_place, kept_folder, with_author, write_json, write_text
from palpate.studies.plan import Sobol
from palpate.studies.run_one import map_unordered
from palpate_thesis.claims import Sentence
from palpate_thesis.inference.sentences import halves, searched, sentences, true_ids
from palpate_thesis.inference.trial import Trial
from palpate_thesis.laboratory import (
    BENCH,
    UNKNOWNS,
    Laboratory,
    laboratory_at,
    laboratory_text,
    load_laboratory,
    prior_fractions,
)
from palpate_thesis.printed_facts import contradictions
from palpate_thesis.runs import sources_digest

T = TypeVar("T")
Fractions = tuple[float, ...]
"""A point of the search: for each unknown the fraction of its prior below the value, 0 to 1."""
STATE, INFERRED, SENSITIVITY = "laboratory.json", "inferred.toml", "sensitivity.toml"
GENERATION = 16
"""Laboratories tried before parents are chosen again; fixed, so that no result depends on the number of threads."""
PRIOR_FRACTION = 0.25
"""Fraction of the tries that are drawn from the prior, before children of the best are tried."""
PARENTS, RANK_SCALE = 25, 2.5
"""Number of the best laboratories that have children, and the scale of the exponential distribution of their rank."""
MAX_REDRAWN = 4
"""Maximum unknowns in which a child differs from its parent."""
STEP = 0.1
"""Standard deviation of a small change of an unknown, as a fraction of its prior; half of the changes are small."""
CANDIDATES = 8
"""Best laboratories of the search that are judged over all seeds."""
PLAUSIBLE = 0.5
"""Least fraction of the sentences that hold in a plausible laboratory: less shows one sentence against all others."""
PLAUSIBLE_ABOUT = "For sentences that do not hold in the inferred one; within the printed values too."
ATTEMPTS = 4
"""Tried laboratories that are judged for a sentence that does not hold in the inferred one."""
VALUES = (0.05, 0.275, 0.5, 0.725, 0.95)
"""Fractions of its prior at which an unknown is tried alone."""
SEEDS, FULL_STEPS = range(10), 20
"""Seeds of the noise, and steps of the physics in a tick, of a judgement: those of the figures."""


class TriedLaboratory(msgspec.Struct, frozen=True):
    """A point of the search and the sentences that held there, by their names."""

    fractions: Fractions
    true: tuple[str, ...]


class SearchState(msgspec.Struct):
    """Content of the state file."""

    stamp: str  # identity of the search
    tried: list[TriedLaboratory] = []  # laboratories in the order of their numbers
    judged: dict[str, dict[str, int]] = {}  # `SEEDS` in which each sentence held, by laboratory


@dataclass(frozen=True)
class JudgedLaboratory:
    """A laboratory and the number of `SEEDS` in which each sentence held, by the sentence's name."""

    laboratory: Laboratory
    held: Mapping[str, int]

    def count_true(self, among: Iterable[Sentence]) -> int:
        """Number of sentences that hold by their claims' own rules."""
        return sum(s.is_true(self.held[s.id], len(SEEDS)) for s in among)

    def count_runs(self, among: Iterable[Sentence]) -> int:
        """Number of runs in which a sentence holds, over all of them: the margin between equal counts."""
        return sum(self.held[s.id] for s in among)


@dataclass(frozen=True)
class SearchResult:
    """The best laboratory of a search and the hand-chosen bench, both over all seeds."""

    tried: int  # number of laboratories
    laboratories: Mapping[str, JudgedLaboratory]  # both by name
    plausible: tuple[tuple[Laboratory, tuple[str, ...]], ...]  # with the sentences that hold in each
    sensitivity: Mapping[str, tuple[str, ...]]  # by unknown, the sentences that it decides alone

    @property
    def inferred(self) -> JudgedLaboratory:
        """The best laboratory of the search."""
        return self.laboratories["inferred"]

    def as_json(self) -> dict[str, Any]:
        """Results as the numbers of --json."""
        return {
            "tried": self.tried,
            "true": {
                name: {half: {"true": lab.count_true(of), "of": len(of)} for half, of in halves().items()}
                for name, lab in self.laboratories.items()
            },
            "plausible": [{"sentences": ids, "unknowns": lab.numbers()} for lab, ids in self.plausible],
            "sensitivity": dict(self.sensitivity),
            "laboratories": {name: lab.laboratory.numbers() for name, lab in self.laboratories.items()},
            "sentences": {
                s.id: {name: lab.held[s.id] for name, lab in self.laboratories.items()} for s in sentences()
            },
        }


@dataclass(frozen=True)
class LaboratorySearch:
    """Settings of a search."""

    folder: Path  # for the state and the inferred laboratory
    command: str  # command line that is written into the laboratory
    tries: int  # number of laboratories; rounded up to whole generations
    seed: int = 1  # of everything drawn
    half: bool = False  # True to search by the sentences of the calibration half alone
    start: str | None = None  # laboratory that is tried first; None to start from the prior alone
    threads: int = 1  # number of threads
    progress: Callable[[str, int, int], None] = lambda _name, _done, _total: None

    @property
    def sentences(self) -> tuple[Sentence, ...]:
        """Sentences of the thesis that decide the search."""
        return searched(self.half)

    def run(self, *, replace: bool = False) -> SearchResult:
        """Search on from the state of the folder, and write the best laboratory.

        Raises:
            InputError: the folder holds another search or something else, and `replace` is off.
        """
        with kept_folder(self.folder, STATE, replace=replace):
            state = self._load()
            self._save(state)
            while len(state.tried) < self.tries:
                state.tried += self._try_generation(self.propose(state.tried), len(state.tried))
                self._save(state)
            bench, *judged = [
                JudgedLaboratory(laboratory, self._count_seeds(state, laboratory, sentences()))
                for laboratory in (BENCH, *map(laboratory_at, find_best(state.tried)))
            ]
            wanted = halves()["calibration" if self.half else "all"]
            inferred = max(judged, key=lambda lab: (lab.count_true(wanted), lab.count_runs(wanted)))
            plausible = self._find_plausible(state, inferred)
            sensitivity = self._find_sensitivity(inferred.laboratory)
            both = {"hand-chosen bench": bench, "inferred": inferred}
            result = SearchResult(len(state.tried), both, plausible, sensitivity)
            self._write(result)
            return result

    def propose(self, tried: Sequence[TriedLaboratory]) -> list[Fractions]:
        """Points of the next generation: the start and the prior at first, then children of the best.

        A child that contradicts a printed value is drawn again.
        """
        done = len(tried)
        if done < PRIOR_FRACTION * self.tries:
            sobol = Sobol(len(UNKNOWNS), self.seed)
            points = [tuple(sobol.point(number)) for number in range(done, done + GENERATION)]
            if done == 0 and self.start is not None:
                points[0] = prior_fractions(load_laboratory(self.start))
            return points
        parents = _rank(tried)[:PARENTS]
        rng = np.random.default_rng([self.seed, done])
        children: list[Fractions] = []
        while len(children) < GENERATION:
            child = _make_child(parents, rng)
            if not contradictions(laboratory_at(child)):
                children.append(child)
        return children

    def _try_generation(self, points: Sequence[Fractions], first: int) -> list[TriedLaboratory]:
        """Try the points with a noise of their own each."""

        def attempt(number: int, stopped: Callable[[], bool]) -> TriedLaboratory:
            point = points[number - first]
            if contradictions(laboratory_at(point)):
                return TriedLaboratory(point, ())
            trial = Trial(laboratory_at(point), number, stopped=stopped)
            return TriedLaboratory(point, true_ids(trial, self.sentences))

        end = first + len(points)
        return self._in_parallel("laboratories", attempt, range(first, end), max(self.tries, end))

    def _in_parallel(
        self, name: str, attempt: Callable[[int, Callable[[], bool]], T], numbers: range, total: int
    ) -> list[T]:
        """Results of each number, in their order; the runs under way stop with the caller."""
        stop = threading.Event()
        results: dict[int, T] = {}
        try:
            work = map_unordered(lambda n: (n, attempt(n, stop.is_set)), numbers, self.threads)
            for number, result in work:
                results[number] = result
                self.progress(name, numbers.start + len(results), total)
        finally:
            stop.set()
        return [results[number] for number in numbers]

    def _find_plausible(
        self, state: SearchState, inferred: JudgedLaboratory
    ) -> tuple[tuple[Laboratory, tuple[str, ...]], ...]:
        """For each sentence that does not hold in the inferred laboratory, a tried one where it does.

        Of the plausible laboratories in which it held once, those with most true sentences are judged over all seeds.
        """
        missing = {s.id: s for s in self.sentences if not inferred.count_true([s])}
        enough = PLAUSIBLE * len(self.sentences)
        ranked = [lab for lab in _rank(state.tried) if len(lab.true) >= enough]
        plausible: dict[Laboratory, tuple[str, ...]] = {}
        for name in missing:
            if any(name in ids for ids in plausible.values()):
                continue
            for tried in [lab for lab in ranked if name in lab.true][:ATTEMPTS]:
                elsewhere = {id_ for ids in plausible.values() for id_ in ids}
                laboratory = laboratory_at(tried.fractions)
                among = [s for s in missing.values() if s.id in tried.true and s.id not in elsewhere]
                counts = self._count_seeds(state, laboratory, among)
                true = tuple(s.id for s in among if s.is_true(counts[s.id], len(SEEDS)))
                if name in true:
                    plausible[laboratory] = true
                    break
        return tuple(plausible.items())

    def _find_sensitivity(self, laboratory: Laboratory) -> dict[str, tuple[str, ...]]:
        """Change one unknown at a time to values of its prior, and find the sentences whose truth changes."""
        among, point = searched(half=False), prior_fractions(laboratory)
        reference = set(true_ids(Trial(laboratory), among))

        def attempt(i: int, stopped: Callable[[], bool]) -> tuple[str, ...]:
            others = {laboratory_at([*point[:i], fraction, *point[i + 1 :]]) for fraction in VALUES}
            true = (true_ids(Trial(other, stopped=stopped), among) for other in others)
            differing = set().union(*(reference.symmetric_difference(ids) for ids in true))
            return tuple(s.id for s in sentences() if s.id in differing)

        numbers = range(len(UNKNOWNS))
        changed = self._in_parallel("unknowns, one at a time", attempt, numbers, len(UNKNOWNS))
        return {u.name: ids for u, ids in zip(UNKNOWNS, changed, strict=True)}

    def _count_seeds(
        self, state: SearchState, laboratory: Laboratory, among: Sequence[Sentence]
    ) -> Counter[str]:
        """Number of seeds in which each sentence holds; from the state if it has been counted before."""
        key = f"{laboratory.numbers()} {len(among)} {among[0].id}"
        if key not in state.judged:

            def attempt(seed: int, stopped: Callable[[], bool]) -> tuple[str, ...]:
                return true_ids(Trial(laboratory, seed, FULL_STEPS, stopped), among)

            runs = self._in_parallel("a laboratory over all seeds", attempt, SEEDS, len(SEEDS))
            state.judged[key] = dict(Counter(id_ for ids in runs for id_ in ids))
            self._save(state)
        return Counter(state.judged[key])

    def _load(self) -> SearchState:
        path = self.folder / STATE
        stamp = f"{sources_digest()} tries {self.tries} seed {self.seed} half {self.half} start {self.start}"
        if not path.exists():
            return SearchState(stamp)
        check_place(path)
        try:
            state = msgspec.json.decode(path.read_bytes(), type=SearchState)
        except (OSError, msgspec.DecodeError) as error:
            raise InputError(
                f"{path} is damaged ({error}); remove it, and the search starts again"
            ) from error
        if state.stamp != stamp:
            raise InputError(
                f"{path} is of another search, or of other sources; choose another --out, or add --replace to "
                "start again"
            )
        return state

    def _save(self, state: SearchState) -> None:
        write_json(self.folder / STATE, with_author(msgspec.to_builtins(state)))

    def _write(self, result: SearchResult) -> None:
        inferred, head = result.inferred.laboratory, {"command": self.command}
        true = [s.id for s in sentences() if result.inferred.count_true([s]) and not self.half]
        text = laboratory_text(inferred, BENCH, about=self._about(result), sentences=true, **head)
        texts = {INFERRED: text}
        for number, (laboratory, ids) in enumerate(result.plausible, 1):
            head["base"] = str(self.folder / INFERRED)
            texts[f"plausible-{number}.toml"] = laboratory_text(
                laboratory, inferred, about=PLAUSIBLE_ABOUT, sentences=ids, **head
            )
        by_unknown = [f"{name} = {json.dumps(ids)}" for name, ids in result.sensitivity.items()]
        texts[SENSITIVITY] = "\n".join(by_unknown) + "\n"
        for name, text in texts.items():
            write_text(self.folder / name, f"{MADE} laboratory --laboratory\n{text}")

    def _about(self, result: SearchResult) -> str:
        """Counts of the inferred laboratory, and which of them are in-sample."""
        counts = {name: (result.inferred.count_true(among), len(among)) for name, among in halves().items()}
        if self.half:
            (searched, first), (kept_out, second) = counts["calibration"], counts["validation"]
            return (
                f"A search by {first} of the sentences alone reached {searched} of these, "
                f"and {kept_out} of the {second} that were kept out of it."
            )
        true, total = counts["all"]
        return f"In its search {true} of {total} sentences held; all took part, so the count is in-sample."


def find_best(tried: Sequence[TriedLaboratory]) -> list[Fractions]:
    """Points with most true sentences; of equal ones the earliest."""
    return [laboratory.fractions for laboratory in _rank(tried)[:CANDIDATES]]


def _rank(tried: Sequence[TriedLaboratory]) -> list[TriedLaboratory]:
    return sorted(tried, key=lambda laboratory: -len(laboratory.true))


def _make_child(parents: Sequence[TriedLaboratory], rng: np.random.Generator) -> Fractions:
    """A parent, chosen by its rank, with a few unknowns moved a little or drawn anew from the prior."""
    rank = min(int(rng.exponential(RANK_SCALE)), len(parents) - 1)
    point = list(parents[rank].fractions)
    count = int(rng.integers(1, MAX_REDRAWN + 1))
    for i in rng.choice(len(point), count, replace=False):
        near = min(max(point[i] + STEP * float(rng.standard_normal()), 0.0), 1.0)
        point[i] = near if rng.random() < 0.5 else float(rng.random())
    return tuple(point)
