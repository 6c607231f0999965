"""The effect of each factor of a study by itself: its values against each other, all else the same."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from palpate.bench.metrics import metric_of
from palpate.report.page import Table
from palpate.studies.definition.plan import MAIN, Plan
from palpate.studies.findings.comparison_table import NONE, number, won
from palpate.studies.findings.figures.rows import short, with_unit
from palpate.studies.findings.pairing import Comparison, Pair, comparison_of, conditions_of

if TYPE_CHECKING:
    from polars import DataFrame

SHOWN = 3
"""Factors in the headline, those that change most first."""


def effects(frame: DataFrame, plan: Plan) -> list[Comparison]:
    """Of each factor its values compared by the study's metric, on the same surfaces, seeds and other factors.

    The factor that changes the metric most comes first. Parameters drawn at random are surfaces, not factors.
    """
    asked = _metric(plan)
    if asked is None or plan.study.search is not None:
        return []
    metric, most = asked
    import polars

    own = frame.filter(polars.col("part") == MAIN) if "part" in frame.columns else frame
    names = [a.name for a in plan.parts[0].axes if "seed" not in a.targets]
    conditions = set(conditions_of(plan))
    found = []
    for axis in plan.parts[0].axes:
        values = own[axis.name].unique(maintain_order=True).to_list() if axis.name in names else []
        if axis.name in conditions or len(values) < 2 or not len(own):
            continue
        title = axis.parameter.label or axis.name
        rows = {
            value if isinstance(value, str) else f"{title} {short(value)}": (
                {axis.name: value},
                own.filter(polars.col(axis.name) == value),
            )
            for value in values
        }
        others = [name for name in (*names, "seed") if name != axis.name]
        found.append(comparison_of({axis.name: axis.parameter.label}, rows, metric, most, others))
    return sorted(found, key=lambda one: -_change(one))


def _metric(plan: Plan) -> tuple[str, bool] | None:
    """The metric by which factors are judged, and whether more of it is better; None where none has a better side."""
    best = plan.study.best
    if best is not None:
        return best.metric, bool(best.most)
    sided = ((name, metric_of(name).side) for name in plan.study.metrics)
    return next(((name, side == "most") for name, side in sided if side), None)


def _change(one: Comparison) -> float:
    """How much the metric changes from the best value to the worst; a failure more than any number."""
    median = one.pair(0, len(one.entrants) - 1).median
    return 0.0 if median is None else abs(median)


def sentence(one: Comparison, what: str) -> str:
    """Effect of a factor: `PI has the smaller error on 50 of 50 surfaces, by 1.40 N (95 %: 0.17 to 2.40)`.

    Args:
        one: its values.
        what: a pair of runs is of, `surfaces` or `pairs of runs`.
    """
    last = len(one.entrants) - 1
    pair, best, worst = one.pair(0, last), one.entrants[0].name, one.entrants[last].name
    metric = metric_of(one.metric)
    (factor,) = one.of
    more = ("larger" if one.most else "smaller") if last == 1 else ("largest" if one.most else "smallest")
    against = "" if last == 1 else f" than with {worst}, the worst,"
    if not pair.decided:
        better, behind = round(pair.won * pair.surfaces), round(pair.lost * pair.surfaces)
        return (
            f"{factor} does not change {metric.called} significantly: {best} is better on {better}, worse on {behind} "
            f"of {pair.surfaces} {what}."
        )
    count = f"{round(pair.won * pair.surfaces)} of {pair.surfaces} {what}"
    if pair.median is None or math.isinf(pair.median):
        return f"{best} is better{against} on {count}: with {worst} most runs fail."
    if last == 1:
        return f"{best} has the {more} {metric.called} on {count}, by {by(pair, metric.unit)}."
    return f"{best} has the {more} {metric.called}: {by(pair, metric.unit)} better{against} and better on {count}."


def by(pair: Pair, unit: str) -> str:
    """The median difference with its interval, without a sign."""
    if pair.median is None or math.isinf(pair.median):
        return "failures"
    ends = sorted(abs(end) for end in (pair.low, pair.high) if end is not None and math.isfinite(end))
    known = f" (95 %: {number(ends[0])} to {number(ends[1])})" if len(ends) == 2 else ""
    return f"{number(abs(pair.median or 0.0))}{'' if unit == '1' else f' {unit}'}{known}"


def effects_table(found: Sequence[Comparison]) -> Table:
    """A row a factor: its best value, and by how much the next and the worst are behind, all else the same."""
    rows = []
    for one in found:
        last = len(one.entrants) - 1
        pair = one.pair(0, last)
        rows.append(
            (
                str(next(iter(one.of.values())) or next(iter(one.of))),
                *(short(one.entrants[i].at[next(iter(one.of))]) for i in (0, last)),
                by(pair, "1") if pair.decided else "not significant",
                won(pair),
                _median(one, 0),
                _median(one, last),
            )
        )
    label = with_unit(metric_of(found[0].metric))
    head = ("factor", "best", "worst", "differ by", "best better on", "median, best", "median, worst")
    return Table(f"Effect of each factor on {label}, all else the same, 95 % intervals", head, rows)


def _median(one: Comparison, i: int) -> str:
    values = one.entrants[i].values
    known = values[np.isfinite(values)]
    return number(float(np.median(known))) if len(known) else NONE
