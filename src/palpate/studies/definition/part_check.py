"""A study's plug-ins are tried before its first run."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import islice

from palpate.bench import Experiment, build
from palpate.bench.any_experiment import check_parts
from palpate.bench.metrics import Look, metric_of
from palpate.bench.metrics.verdicts import try_metric
from palpate.errors import InputError, PluginError
from palpate.plugins import is_plugin
from palpate.studies.definition.plan import TRIED, Plan, samples

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
