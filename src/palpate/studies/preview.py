"""Before a study's hundreds of runs: its plug-ins are tried, a run of each case is made, its duration is predicted."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from itertools import islice

from palpate.bench import Experiment, build
from palpate.bench.any_experiment import AnyExperiment, build_any, check_parts
from palpate.bench.metrics import Look, metric_of
from palpate.bench.metrics.verdicts import try_metric
from palpate.bench.sequence import NO_CONTACT
from palpate.bench.speed import cores
from palpate.errors import InputError, PluginError
from palpate.plugins import is_plugin
from palpate.studies.plan import MAIN, TRIED, Plan, Setting, samples
from palpate.studies.run_one import FAILED, REFUSED, RunJob, Stopped, run_one

PRESS = 0.1
"""Contact after which a run is long enough to ask a metric of it [s]."""


def check_parts_of(plan: Plan, waiting: Callable[[], None] | None = None) -> None:
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
                try_metric(metric, Look(record))
        first = False


def _combinations(plan: Plan) -> Iterator[Experiment]:
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


def seconds_a_run(plan: Plan, waiting: Callable[[], None] | None = None) -> float:
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
            build_any(setting.experiment).run(0.1, press=0.1, waiting=waiting)  # compiled now, if it was not
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
        bench.run(run.duration, seed, press=run.press, progress=progress)
    except Stopped:
        share = reached[0] / min(run.duration, reached[0] + run.press)
        return (time.perf_counter() - begun) / share
    return time.perf_counter() - begun


def too_much(plan: Plan, seconds: float) -> str:
    """A sentence that says how many runs there are and how long they take, where that is more than one would expect."""
    total = seconds * len(plan) / cores()
    if len(plan) < MANY and total < LONG:
        return ""
    return f"the study has {len(plan):,} runs, which take some {in_words(total)} on the {cores()} cores here"


def in_words(seconds: float) -> str:
    """A time in words of a fitting unit."""
    for size, unit in ((365.25 * 86400.0, "years"), (86400.0, "days"), (3600.0, "hours"), (60.0, "minutes")):
        if seconds >= 2.0 * size:
            return f"{seconds / size:,.0f} {unit}"
    return f"{seconds:.0f} seconds"


MANY_RUNS = 100
"""Runs from which on each case is tried first."""
USELESS = {NO_CONTACT, REFUSED, FAILED}
"""Results that say nothing of what is studied."""


def check_cases(plan: Plan, waiting: Callable[[], None] | None = None) -> None:
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


def _cases(plan: Plan) -> Iterator[tuple[str, Setting]]:
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
