"""Before a study's hundreds of runs: its plug-ins are tried, a run of each case is made, its duration is predicted."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.bench import Experiment, build
from palpate.bench.from_experiment import AnyExperiment, build_any, check_parts
from palpate.bench.speed import cores
from palpate.bench.summary import DONE, NO_CONTACT
from palpate.errors import InputError, PluginError
from palpate.plugins import is_plugin
from palpate.text import duration
from palpate_studies.metrics import Window, metric_of
from palpate_studies.metrics.verdicts import try_metric
from palpate_studies.parameters import Label
from palpate_studies.plan import MAIN, TRIED, RunPlan, RunSetting, samples
from palpate_studies.run_one import FAILED, REFUSED, RunJob, Stopped, run_one, uninterrupted

if TYPE_CHECKING:
    from polars import DataFrame

PRESS = 0.1
"""Contact after which a run is long enough to ask a metric of it [s]."""


def check_parts_of(plan: RunPlan, waiting: Callable[[], None] | None = None) -> None:
    """Tries every combination of the user's parts once, and every metric of theirs on a short press.

    Args:
        plan: of the study.
        waiting: called when a loop has to be compiled first.

    Raises:
        InputError: one of them cannot do what the study asks of it; one line says which and why.
    """
    if not plan.plugins:
        return
    metrics = [metric_of(name) for name in plan.study.metrics if is_plugin(name)]
    first = True
    for experiment in _combinations(plan):
        bench = build(experiment)
        check_parts(bench, waiting)
        if first and metrics:
            run = experiment.run
            record = bench.run(run.duration, press=min(PRESS, run.press), waiting=waiting)
            for metric in metrics:
                try_metric(metric, Window(record))
        first = False


def _combinations(plan: RunPlan) -> Iterator[Experiment]:
    """An experiment for each combination of parts that the study's values come to."""
    seen = set()
    for part in plan.parts:
        for values in islice(samples(part), TRIED):
            try:
                experiment = part.experiment(values)
                if not isinstance(experiment, Experiment):
                    continue  # along one direction nothing is the user's
                build(experiment)
            except PluginError:
                raise
            except InputError:  # a value that is refused is a row of its own
                continue
            kinds = tuple(map(type, (experiment.controller, experiment.surface, experiment.identifier)))
            if kinds not in seen:
                seen.add(kinds)
                yield experiment


LOOKED_AT = 0.5
"""Seconds of this machine's time that the piece may take [s]."""
MANY, LONG = 200_000, 6 * 3600.0
"""From where on a study is not begun unasked: runs; seconds on this machine's cores."""
SAMPLES = 20
"""How many settings are tried for one that runs."""


def seconds_a_run(plan: RunPlan, waiting: Callable[[], None] | None = None) -> float:
    """Time of a run on one core [s], from the first setting that runs; 0 if none of the first does.

    Args:
        plan: of the study.
        waiting: called when the loop has to be compiled first.
    """
    if plan.study.search is not None:
        part = plan.parts[0]
        middle = {a.name: a.between(0.5) if a.drawn else a.settings[0] for a in part.axes}
        tried = [part.setting(0, middle, 0, False)]
    else:
        step = max(1, len(plan) // SAMPLES)
        tried = [plan.setting(i) for i in range(0, len(plan), step)[:SAMPLES]]
    for setting in tried:
        if setting.experiment is None:
            continue
        try:
            # Compiled now, if it was not.
            uninterrupted(build_any(setting.experiment).run(0.1, press=0.1, waiting=waiting))
            return _time_run(setting.experiment, setting.seed)
        except InputError:
            continue
    return 0.0


def _time_run(experiment: AnyExperiment, seed: int) -> float:
    bench = build_any(experiment)
    run = experiment.run
    begun, reached = time.perf_counter(), [0.0]

    def progress(at: float, _: str) -> None:
        reached[0] = at
        if time.perf_counter() - begun > LOOKED_AT:
            raise Stopped

    try:
        uninterrupted(bench.run(run.duration, seed, press=run.press, progress=progress))
    except Stopped:
        share = reached[0] / min(run.duration, reached[0] + run.press)
        return (time.perf_counter() - begun) / share
    return time.perf_counter() - begun


def too_much(plan: RunPlan, seconds: float) -> str:
    """A sentence that says how many runs there are and how long they take, where that is more than one would expect."""
    total = seconds * len(plan) / cores()
    if len(plan) < MANY and total < LONG:
        return ""
    return f"the study has {len(plan):,} runs, which take some {duration(total)} on the {cores()} cores here"


MANY_RUNS = 100
"""Runs from which on each case is tried first."""
USELESS = {NO_CONTACT, REFUSED, FAILED}
"""Results that say nothing of what is studied."""


def check_cases(plan: RunPlan, waiting: Callable[[], None] | None = None) -> None:
    """Runs each case of a long study once.

    Args:
        plan: of the study.
        waiting: called when a loop has to be compiled first.

    Raises:
        InputError: a case touches nothing, is refused or fails; one line says which and why.
    """
    if len(plan) < MANY_RUNS or plan.study.search is not None:
        return
    for name, setting in _cases(plan):
        row, _ = run_one(
            RunJob(setting, tuple(plan.study.metrics), plan.study.window, False, plan.plugins),
            waiting=waiting,
        )
        if row.result in USELESS:
            raise InputError(
                f"the first run{name}, a try before {len(plan):,} runs, ends so: {row.why}; --yes does them all"
            )


def _cases(plan: RunPlan) -> Iterator[tuple[str, RunSetting]]:
    """The middle setting of each part for each of its cases."""
    for part in plan.parts:
        middle = {a.name: a.between(0.5) if a.drawn else a.settings[len(a.settings) // 2] for a in part.axes}
        own = "" if part.name == MAIN else f" of {part.name}"
        cases = next((a for a in part.axes if a.parameter.cases is not None), None)
        if cases is None:
            yield own, part.setting(0, middle, part.seeds[0], False)
            continue
        for value, label in zip(cases.settings, cases.labels(), strict=True):
            yield (
                f"{own} with {cases.name} {label}",
                part.setting(0, middle | {cases.name: value}, part.seeds[0], False),
            )


LEVEL = 0.95


@dataclass(frozen=True)
class MetricMean:
    """A mean over seeds, with its 95 % interval by Student's t; without one for a single seed."""

    value: float
    half: float | None

    @property
    def excludes_zero(self) -> bool:
        """Whether it is known to differ from zero."""
        return self.half is not None and abs(self.value) > self.half


@dataclass(frozen=True)
class Ranked:
    """A setting with all its runs completed.

    Args:
        at: the parameters' values, the seed aside.
        runs: how many seeds.
        metric: of the ranking.
        behind: by how much it is worse than the best one, seed by seed: the noise that they share falls out.
    """

    at: dict[str, Label]
    runs: int
    metric: MetricMean
    behind: MetricMean


@dataclass(frozen=True)
class Ranking:
    """Settings of a part by their metric, the best one first.

    Args:
        of: the values of the parameters that are given, [best] each.
        settings: those with all runs completed.
        failed: how many settings had a run that was not.
    """

    of: dict[str, Label]
    settings: tuple[Ranked, ...]
    failed: int

    @property
    def alike(self) -> tuple[Ranked, ...]:
        """The best one, and those that do not differ significantly."""
        return tuple(s for i, s in enumerate(self.settings) if i == 0 or not s.behind.excludes_zero)

    def spans(self) -> dict[str, Sequence[Label]]:
        """Of each parameter the values, in order, among the settings that cannot be told from the best one."""
        names = self.settings[0].at if self.settings else {}
        return {name: sorted({s.at[name] for s in self.alike}, key=_order) for name in names}


def rankings(frame: DataFrame, plan: RunPlan, part: str = MAIN) -> list[Ranking]:
    """The settings of a part by the study's [best]: a ranking for each combination of what is given."""
    best = plan.study.best
    if best is None:
        return []
    sign = 1.0 if best.least else -1.0
    found: dict[tuple[tuple[str, Label], ...], list[tuple[dict[str, Label], dict[int, float] | None]]] = {}
    for at, seeds in _settings(frame, plan, part, best.metric):
        given = {name: at.pop(name) for name in best.each if name in at}
        found.setdefault(tuple(given.items()), []).append((at, seeds))
    return [_ranking(dict(given), settings, sign) for given, settings in found.items()]


def _ranking(
    given: dict[str, Label], settings: Sequence[tuple[dict[str, Label], dict[int, float] | None]], sign: float
) -> Ranking:
    done = [(at, seeds) for at, seeds in settings if seeds]
    done.sort(key=lambda one: sign * sum(one[1].values()) / len(one[1]))
    ranked = tuple(_rank(at, seeds, done[0][1], sign) for at, seeds in done)
    return Ranking(given, ranked, len(settings) - len(done))


def _settings(
    frame: DataFrame, plan: RunPlan, part: str, metric: str
) -> list[tuple[dict[str, Label], dict[int, float] | None]]:
    """Each setting and its metric by seed; None where a run failed."""
    import polars

    if "part" in frame.columns:
        frame = frame.filter(polars.col("part") == part)
    axes = next(p.axes for p in plan.parts if p.name == part)
    names = [a.name for a in axes if "seed" not in a.targets]
    columns = [polars.col("seed"), polars.col("result"), polars.col(metric).alias("of")]
    grouped = frame.group_by(names, maintain_order=True).agg(*columns) if names else None
    rows = grouped.rows(named=True) if grouped is not None else [_lone(frame, metric)]
    signed = metric_of(metric).signed
    return [({name: row[name] for name in names}, _by_seed(row, signed=signed)) for row in rows]


def _lone(frame: DataFrame, metric: str) -> dict[str, Any]:
    return {
        key: frame[name].to_list() for key, name in (("seed", "seed"), ("result", "result"), ("of", metric))
    }


def _by_seed(row: Mapping[str, Any], *, signed: bool) -> dict[int, float] | None:
    if any(result != DONE for result in row["result"]) or any(value is None for value in row["of"]):
        return None
    values = map(abs, row["of"]) if signed else row["of"]
    return dict(zip(row["seed"], values, strict=True))


def _rank(at: dict[str, Label], seeds: Mapping[int, float], top: Mapping[int, float], sign: float) -> Ranked:
    shared = [sign * (value - top[seed]) for seed, value in seeds.items() if seed in top]
    return Ranked(at, len(seeds), mean(list(seeds.values())), mean(shared))


def mean(values: Sequence[float]) -> MetricMean:
    """The mean of some values with its interval."""
    from scipy.special import stdtrit

    n = len(values)
    if n == 0:
        return MetricMean(math.nan, None)
    half = float(stdtrit(n - 1, 0.5 + LEVEL / 2) * np.std(values, ddof=1) / math.sqrt(n)) if n > 1 else None
    return MetricMean(float(np.mean(values)), half)


def _order(value: Label) -> tuple[int, float, str]:
    return (0, float(value), "") if isinstance(value, int | float) else (1, 0.0, str(value))
