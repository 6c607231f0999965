"""A search in place of a grid: Optuna proposes settings from the results of previous trials.

What it proposes depends on nothing but the study and the trials before, so that a search that was killed goes on as
if it had not been. The trials stand in a journal of Optuna's own (`JournalStorage`), for its tools.
"""

from __future__ import annotations

import hashlib
import warnings
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from palpate.errors import InputError
from palpate.files import SIGNATURE, check_place
from palpate_studies.parameters import Axis
from palpate_studies.plan import RunPlan

if TYPE_CHECKING:
    from optuna import Study as OptunaStudy
    from optuna.distributions import BaseDistribution
    from optuna.trial import FrozenTrial

NAME = "optuna.journal"

Trial = tuple[int, dict[str, Any]]
"""Its number, and the parameters' values as they are set."""


class Searching:
    """The trials of a search, batch after batch.

    Args:
        plan: of a study with a [search].
        path: of Optuna's journal; one that is not this search's, or is spoiled, is written anew from the study's own.
        name: tells the search from others.

    Raises:
        InputError: the extra is not installed.
    """

    def __init__(self, plan: RunPlan, path: Path, name: str):
        self._optuna = _optuna()
        study = plan.study
        assert study.search is not None
        assert study.best is not None
        self._search, self._axes = study.search, plan.parts[0].axes
        self._direction = "minimize" if study.best.least else "maximize"
        self._space = {a.name: _distribution(a) for a in self._axes}
        self._kept = self._open_or_renew(path, name)

    def batches(self) -> Iterator[list[Trial]]:
        """The trials of each batch; the results of all before have to be told first."""
        for first in range(0, self._search.trials, self._search.batch):
            yield self._propose(first, min(self._search.batch, self._search.trials - first))

    def tell(self, number: int, values: Mapping[str, Any], objective: float | None) -> None:
        """Value of a trial; None if it failed, which the search ranks last."""
        if number < len(self._kept.get_trials(deepcopy=False)):
            return
        optuna = self._optuna
        state = optuna.trial.TrialState.PRUNED if objective is None else optuna.trial.TrialState.COMPLETE
        self._kept.add_trial(
            optuna.trial.create_trial(
                params={a.name: _suggested_value(a, values[a.name]) for a in self._axes},
                distributions=self._space,
                value=objective,
                state=state,
            )
        )

    def _propose(self, first: int, count: int) -> list[Trial]:
        """The trials from the first on, from those before it alone."""
        seed = int.from_bytes(hashlib.sha256(f"{self._search.seed} {first}".encode()).digest()[:4], "big")
        fresh = self._optuna.create_study(
            direction=self._direction, sampler=self._optuna.samplers.TPESampler(seed=seed)
        )
        fresh.add_trials(self._kept.get_trials(deepcopy=False)[:first])
        asked = [fresh.ask(self._space).params for _ in range(count)]
        return [
            (first + i, {a.name: _value_of(a, p[a.name]) for a in self._axes}) for i, p in enumerate(asked)
        ]

    def _open_or_renew(self, path: Path, name: str) -> OptunaStudy:
        check_place(path)
        if path.exists() and not path.read_bytes().endswith(
            b"\n"
        ):  # torn: what is added would be spoiled too
            path.unlink()
        try:
            return self._open(path, name)
        except (ValueError, KeyError, TypeError):  # spoiled, or of another search
            path.unlink()
            return self._open(path, name)

    def _open(self, path: Path, name: str) -> OptunaStudy:
        storages = self._optuna.storages
        backend = storages.journal.JournalFileBackend(str(path), lock_obj=_no_lock(storages))
        study = self._optuna.create_study(
            storage=storages.JournalStorage(backend),
            study_name=f"{SIGNATURE} {name}",
            direction=self._direction,
            load_if_exists=True,
        )
        _check_trials(study.get_trials(deepcopy=False), self._space)
        return study


def objective(metrics: Sequence[tuple[str, float | None]]) -> float | None:
    """The mean of a metric over the runs of a trial, each with the word that it ended with; None if any run failed."""
    values = [value for result, value in metrics if result == "done" and value is not None]
    return sum(values) / len(values) if metrics and len(values) == len(metrics) else None


def _optuna() -> Any:
    try:
        import optuna
    except ImportError as error:
        raise InputError("a search needs the extra: pip install 'palpate[search]'") from error
    optuna.logging.set_verbosity(optuna.logging.ERROR)
    warnings.filterwarnings("ignore", category=optuna.exceptions.ExperimentalWarning)
    return optuna


def _no_lock(storages: Any) -> Any:
    """No lock: the study's folder is its process's alone, and a lock of Optuna's outlives a process that is killed."""

    class Unlocked(storages.journal.JournalFileOpenLock):
        def acquire(self) -> bool:
            return True

        def release(self) -> None:
            return None

    return Unlocked("")


def _distribution(axis: Axis) -> BaseDistribution:
    from optuna import distributions

    p = axis.parameter
    if not axis.drawn:
        return distributions.CategoricalDistribution(tuple(map(str, axis.labels())))
    low, high = axis.between(0.0), axis.between(1.0)
    if axis.whole:
        return distributions.IntDistribution(int(low), int(high), log=p.log is not None)
    return distributions.FloatDistribution(low, high, log=p.log is not None)


def _value_of(axis: Axis, told: Any) -> Any:
    """A value as it is set, from Optuna's."""
    if axis.drawn:
        return told
    return axis.settings[[str(one) for one in axis.labels()].index(told)]


def _suggested_value(axis: Axis, value: Any) -> Any:
    """Optuna's value, from one as it is set."""
    return value if axis.drawn else str(axis.labels()[axis.settings.index(value)])


def _check_trials(trials: Sequence[FrozenTrial], space: Mapping[str, BaseDistribution]) -> None:
    for i, trial in enumerate(trials):
        if trial.number != i or trial.distributions != space:
            raise ValueError("these are trials of another search")
