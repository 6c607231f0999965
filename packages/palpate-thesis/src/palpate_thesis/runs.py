"""Many runs of an experiment: over seeds, parameters, surfaces, friction and poses, on all cores."""

import hashlib
import threading
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

from palpate.bench import Experiment, build
from palpate.bench.speed import cores
from palpate.bench.summary import INTERRUPTED
from palpate.records import Record
from palpate.studies.journal import sources
from palpate_thesis.laboratory import BENCH, Laboratory

K = TypeVar("K")
T = TypeVar("T")

VARIED_SEEDS = 3
"""Runs of each variation; the nominal case is run with all seeds."""


def sources_digest() -> str:
    """Digest of all sources that decide a measurement: those of palpate's runs, and this package."""
    digest = hashlib.sha256(str(sorted(sources().items())).encode())
    for path in sorted(Path(__file__).parent.rglob("*.py")):
        digest.update(str(path.relative_to(Path(__file__).parent)).encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()


@dataclass(frozen=True)
class Runs:
    """Run experiments on the bench; compiled loops release the interpreter, so threads fill the cores."""

    seeds: Sequence[int] = tuple(range(10))  # of the noise; every claim is measured over all of them
    waiting: Callable[[], None] | None = None  # called when a loop has to be compiled first
    laboratory: Laboratory = BENCH  # in which every experiment is run
    _stopped: threading.Event = field(default_factory=threading.Event, compare=False, repr=False)

    def record(self, experiment: Experiment, seed: int | None = None) -> Record:
        """Record of one run, with the first seed unless another is given."""
        number = self.seeds[0] if seed is None else seed
        run = experiment.run
        record = build(self.laboratory.adapt(experiment)).run(
            run.duration, number, press=run.press, waiting=self.waiting, progress=self._poll
        )
        if record.meta["end"] == INTERRUPTED:  # a part of a run would be measured as if it were all of it
            raise KeyboardInterrupt
        return record

    def over_seeds(self, experiment: Experiment, measure: Callable[[Record], T]) -> list[T]:
        """`measure` of each seed's record; the records (some 12 MB each) are not stored."""
        return self.by_name({"": experiment}, measure)[""]

    def by_name(
        self, experiments: Mapping[K, Experiment], measure: Callable[[Record], T], seeds: int | None = None
    ) -> dict[K, list[T]]:
        """`measure` of each experiment's records, by name; over the first `seeds` seeds, or over all."""
        return self.map_each(
            lambda case: measure(self.record(*case)),
            {name: [(e, s) for s in self.seeds[:seeds]] for name, e in experiments.items()},
        )

    def map_each(self, work: Callable[[Any], T], items: Mapping[K, Sequence[Any]]) -> dict[K, list[T]]:
        """`work` of each item of each name; all names at once, on all cores."""
        results = iter(self.map(work, [item for group in items.values() for item in group]))
        return {name: [next(results) for _ in group] for name, group in items.items()}

    def map(self, work: Callable[[Any], T], items: Sequence[Any]) -> list[T]:
        """`work` of each item, in their order, on all cores."""
        with ThreadPoolExecutor(cores()) as pool:
            try:
                return list(pool.map(work, items))
            except BaseException:
                self._stopped.set()  # ends the runs of the other threads
                raise

    def _poll(self, _: float, __: str) -> None:
        if self._stopped.is_set():
            raise KeyboardInterrupt


SHORT = {"robot.start": (0.462, 0.0, 0.0), "approach.first": 0.467, "approach.hold": 0.3}
"""Start of the run close to the wall: the full approach takes sixteen seconds and changes errors in contact by 4 %."""
RELAXING_FOAM = {
    "surface": {
        "kind": "standard-linear-solid",
        "stiffness": 5600.0,
        "damping": 13.0,
        "mass": 0.02,
        "branch_stiffness": 6900.0,
        "branch_time": 0.23,
    }
}
LUGRE = ("coulomb", "static", "bristle_stiffness", "bristle_damping")


def rougher(experiment: Experiment, factor: float, *names: str) -> Mapping[str, Any]:
    """Changes that multiply parameters of the joints' friction: those of these names, or all."""
    f = experiment.friction
    return {f"friction.{n}": tuple(factor * v for v in getattr(f, n)) for n in names or LUGRE}
