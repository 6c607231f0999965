"""Predicted duration of a study, from a part of its first run."""

from __future__ import annotations

import time
from collections.abc import Callable

from palpate.bench.any_experiment import AnyExperiment, build_any
from palpate.bench.speed import cores
from palpate.errors import InputError
from palpate.studies.definition.plan import Plan
from palpate.studies.running.run_one import Stopped

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
            return _timed(setting.experiment, setting.seed)
        except InputError:
            continue
    return 0.0


def _timed(experiment: AnyExperiment, seed: int) -> float:
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
