"""Many runs of an experiment: over seeds, over parameters, on all cores."""

import threading
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import Any, TypeVar

from palpate.bench import Experiment, build
from palpate.bench.speed import cores
from palpate.bench.summary import INTERRUPTED
from palpate.records import Record

K = TypeVar("K")
T = TypeVar("T")

VARIED_SEEDS = 3
"""Runs of each variation; the nominal case has all seeds."""


class HandChosen:
    """The bench as its experiments' files have it; a laboratory of `palpate_laboratory` changes them.

    It has the neural identifier's amplitude [N] and largest first weight, and the seed of those where it is one.
    """

    chosen, amplitude, weights, start = True, 40.0, 0.5, None

    def of(self, experiment: Experiment) -> Experiment:
        """The experiment as it is run."""
        return experiment


@dataclass(frozen=True)
class Runs:
    """Runs experiments on the bench. Compiled loops release the interpreter, so threads fill the cores.

    Args:
        seeds: every measured claim is looked at over all of them; at least ten.
        waiting: called when a loop has to be compiled first.
        laboratory: in which every experiment is run.
    """

    seeds: Sequence[int] = tuple(range(10))
    waiting: Callable[[], None] | None = None
    laboratory: Any = HandChosen()  # noqa: RUF009 - it holds nothing
    _stopped: threading.Event = field(default_factory=threading.Event, compare=False, repr=False)

    def one(self, experiment: Experiment, seed: int | None = None) -> Record:
        """The record of one run, for a figure; of the first seed unless another is given."""
        number = self.seeds[0] if seed is None else seed
        run = experiment.run
        record = build(self.laboratory.of(experiment)).run(
            run.duration, number, press=run.press, waiting=self.waiting, progress=self._look
        )
        if record.meta["end"] == INTERRUPTED:  # a part of a run would be measured as if it were all of it
            raise KeyboardInterrupt
        return record

    def over_seeds(self, experiment: Experiment, measure: Callable[[Record], T]) -> list[T]:
        """`measure` of each seed's record; the records themselves are not kept (some 12 MB each)."""
        return self.over([(experiment, seed) for seed in self.seeds], measure)

    def over(self, cases: Iterable[tuple[Experiment, int]], measure: Callable[[Record], T]) -> list[T]:
        """`measure` of the record of each case, an experiment and a seed, in their order."""

        def work(case: tuple[Experiment, int]) -> T:
            return measure(self.one(*case))

        return self.map(work, list(cases))

    def by_name(
        self, experiments: Mapping[K, Experiment], measure: Callable[[Record], T], seeds: int | None = None
    ) -> dict[K, list[T]]:
        """`measure` of each experiment's records, by its name; over the first so many seeds if not over all."""
        own = self.seeds[:seeds]
        return self.map_each(
            lambda case: measure(self.one(*case)),
            {name: [(e, s) for s in own] for name, e in experiments.items()},
        )

    def map_each(self, work: Callable[[Any], T], items: Mapping[K, Sequence[Any]]) -> dict[K, list[T]]:
        """`work` of each item of each name; all names at once, on all cores."""
        found = iter(self.map(work, [item for some in items.values() for item in some]))
        return {name: [next(found) for _ in some] for name, some in items.items()}

    def map(self, work: Callable[[Any], T], items: Sequence[Any]) -> list[T]:
        """`work` of each item, in their order, on all cores."""
        with ThreadPoolExecutor(cores()) as pool:
            try:
                return list(pool.map(work, items))
            except BaseException:
                self._stopped.set()  # the other threads' runs end at their next look
                raise

    def _look(self, _: float, __: str) -> None:
        if self._stopped.is_set():
            raise KeyboardInterrupt
