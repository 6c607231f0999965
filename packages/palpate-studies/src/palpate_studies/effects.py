"""The effect of each factor of a study by itself, and paired comparisons: in words, as tables and as plain values.

A factor's values are compared with each other, all else the same. The data of the page's charts are plain values.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.report.page import Table
from palpate_studies.metrics import metric_of
from palpate_studies.pairing import (
    Drawn,
    Entrant,
    PairedComparison,
    PairedDifference,
    comparison_of,
    conditions_of,
    sentence,
    short,
    with_unit,
)
from palpate_studies.plan import MAIN, RunPlan
from palpate_studies.report.plain import MOST, numbers, plain_panels

if TYPE_CHECKING:
    from polars import DataFrame

ENTRANTS = 12
"""Settings that are drawn against each other at most, the best ones."""


def charts(
    plan: RunPlan, comparisons: Sequence[PairedComparison], figures: Sequence[Drawn]
) -> dict[str, Any]:
    """Comparisons and figures, by metric."""
    shown = [
        {
            "metric": one.metric.name,
            "label": with_unit(one.metric),
            "caption": one.caption,
            "panels": plain_panels(one.panels()),
        }
        for one in figures
    ]
    first = [plan.study.best.metric] if plan.study.best else []
    names = dict.fromkeys([*first, *plan.study.metrics])
    drawn = {one["metric"] for one in shown} | {one.metric for one in comparisons}
    return {
        "metrics": [{"name": n, "text": sentence(metric_of(n))} for n in names if n in drawn],
        "comparisons": [_comparison(one) for one in comparisons],
        "figures": [one for one in shown if one["panels"]],
    }


def _comparison(one: PairedComparison) -> dict[str, Any]:
    n = len(one.entrants[0].values)
    rows = np.unique(np.linspace(0, n - 1, min(MOST, n)).astype(int))
    few = range(min(len(one.entrants), ENTRANTS))
    return {
        "of": one.of,
        "metric": one.metric,
        "label": with_unit(metric_of(one.metric)),
        "most": one.most,
        "entrants": [
            {
                "name": one.entrants[i].name,
                "values": numbers(one.entrants[i].values[rows]),
                "pairs": [None if i == j else _finite(asdict(one.pair(i, j))) for j in few],
            }
            for i in few
        ],
        "conditions": {name: [values[i] for i in rows] for name, values in one.conditions.items()},
    }


def _finite(pair: dict[str, Any]) -> dict[str, Any]:
    """Infinities as the largest numbers that there are: a page's values are finite."""
    return {
        name: max(-1e308, min(1e308, value)) if isinstance(value, float) else value
        for name, value in pair.items()
    }


NONE = "–"
SHOWN = 12
"""Settings in a table."""


def comparison_sentence(comparison: PairedComparison) -> str:
    """Which setting is the best, on how many surfaces, by how much."""
    first, metric = comparison.entrants[0], metric_of(comparison.metric)
    pair, next_one = comparison.pair(0, 1), comparison.entrants[1].name
    n, unit = pair.surfaces, "" if metric.unit == "1" else f" {metric.unit}"
    place = "".join(f" for {name} {short(value)}" for name, value in comparison.of.items())
    count = f"{round(pair.won * n)} of {n} surfaces"
    if not pair.decided:
        return (
            f"{first.name} and {next_one} do not differ significantly in {metric.phrase}{place}: {first.name} is "
            f"better on {count}, worse on {round(pair.lost * n)}."
        )
    more = "larger" if comparison.most else "smaller"
    which = "" if len(comparison.entrants) == 2 else f" than {next_one}, the next,"
    lead = f"{first.name} has the {more} {metric.phrase}{place}{which} on {count}"
    ends = (pair.median, pair.low, pair.high)
    if not all(end is not None and math.isfinite(end) for end in ends):
        return f"{lead}; on the others {first.name} or {next_one} fails." if pair.lost else f"{lead}."
    middle, low, high = (abs(end or 0.0) for end in ends)
    return f"{lead}, by {number(middle)}{unit} (95 %: {number(min(low, high))} to {number(max(low, high))})."


def fraction_won(pair: PairedDifference) -> str:
    """The share won, with its interval."""
    return f"{100 * pair.won:.0f} % ({100 * pair.won_low:.0f} to {100 * pair.won_high:.0f})"


def comparison_table(comparison: PairedComparison) -> Table:
    """Each setting against the best one, on the same surfaces."""
    rows = [
        (
            one.name,
            _quantile(one, 0.5),
            _quantile(one, 0.1 if comparison.most else 0.9),
            NONE if i == 0 else difference(pair),
            NONE if i == 0 else fraction_won(pair),
            f"{comparison.ranks[i]:.2f}",
            f"{int(one.failed.sum())} of {len(one.values)}",
        )
        for i, (one, pair) in enumerate(zip(comparison.entrants, comparison.behind, strict=True))
    ][:SHOWN]
    label = with_unit(metric_of(comparison.metric))
    place = "".join(f", {name} {short(value)}" for name, value in comparison.of.items())
    title = f"On the same surfaces: {label}{place}, 95 % intervals"
    head = (
        "setting",
        "median",
        "worst tenth",
        "difference from the best",
        "better than the best on",
        "mean rank",
        "failed or without it",
    )
    return Table(title, head, rows)


def difference(pair: PairedDifference) -> str:
    """The median difference with its interval."""
    if pair.median is None:
        return NONE
    if math.isinf(pair.median):
        return "fails on most" if pair.won < pair.lost else "the best fails on most"
    if pair.low is None or pair.high is None:
        return f"{with_sign(pair.median)} (too few surfaces)"
    return f"{with_sign(pair.median)} ({with_sign(pair.low)} to {with_sign(pair.high)})"


def with_sign(value: float) -> str:
    """A difference in three digits, with its sign."""
    if math.isinf(value):
        return "failure"
    return f"{'+' if value > 0 else '−' if value < 0 else ''}{number(abs(value))}"


def number(value: float) -> str:
    """Three digits, no powers of ten for what a reader can read without."""
    if value == 0.0 or not 1e-4 <= abs(value) < 1e6:
        return f"{value:.3g}"
    digits = max(0, 2 - math.floor(math.log10(abs(value))))
    return f"{value:.{digits}f}"


def as_json(comparisons: Sequence[PairedComparison]) -> list[dict[str, Any]]:
    """The comparison as plain values."""
    return [
        {
            "of": one.of,
            "metric": one.metric,
            "better": "most" if one.most else "least",
            "surfaces": len(one.entrants[0].values),
            "settings": [
                {
                    "name": e.name,
                    "at": e.at,
                    "median": _nan(np.nanmedian(e.values)) if not e.failed.all() else None,
                    "mean_rank": one.ranks[i],
                    "failed": int(e.failed.sum()),
                    "less_the_best": asdict(one.behind[i]) if i else None,
                }
                for i, e in enumerate(one.entrants)
            ],
        }
        for one in comparisons
    ]


def _nan(value: Any) -> float | None:
    return float(value) if math.isfinite(value) else None


def _quantile(one: Entrant, share: float) -> str:
    good = one.values[~one.failed]
    return number(float(np.quantile(good, share))) if len(good) else NONE


EFFECTS_SHOWN = 3
"""Factors in the headline, those that change most first."""


def effects(frame: DataFrame, plan: RunPlan) -> list[PairedComparison]:
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


def _metric(plan: RunPlan) -> tuple[str, bool] | None:
    """The metric by which factors are judged, and whether more of it is better; None where none has a better side."""
    best = plan.study.best
    if best is not None:
        return best.metric, bool(best.most)
    sided = ((name, metric_of(name).side) for name in plan.study.metrics)
    return next(((name, side == "most") for name, side in sided if side), None)


def _change(one: PairedComparison) -> float:
    """How much the metric changes from the best value to the worst; a failure more than any number."""
    median = one.pair(0, len(one.entrants) - 1).median
    return 0.0 if median is None else abs(median)


def effect_sentence(one: PairedComparison, what: str) -> str:
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
            f"{factor} does not change {metric.phrase} significantly: {best} is better on {better}, worse on {behind} "
            f"of {pair.surfaces} {what}."
        )
    count = f"{round(pair.won * pair.surfaces)} of {pair.surfaces} {what}"
    if pair.median is None or math.isinf(pair.median):
        return f"{best} is better{against} on {count}: with {worst} most runs fail."
    if last == 1:
        return f"{best} has the {more} {metric.phrase} on {count}, by {by(pair, metric.unit)}."
    return f"{best} has the {more} {metric.phrase}: {by(pair, metric.unit)} better{against} and better on {count}."


def by(pair: PairedDifference, unit: str) -> str:
    """The median difference with its interval, without a sign."""
    if pair.median is None or math.isinf(pair.median):
        return "failures"
    ends = sorted(abs(end) for end in (pair.low, pair.high) if end is not None and math.isfinite(end))
    known = f" (95 %: {number(ends[0])} to {number(ends[1])})" if len(ends) == 2 else ""
    return f"{number(abs(pair.median or 0.0))}{'' if unit == '1' else f' {unit}'}{known}"


def effects_table(found: Sequence[PairedComparison]) -> Table:
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
                fraction_won(pair),
                _median(one, 0),
                _median(one, last),
            )
        )
    label = with_unit(metric_of(found[0].metric))
    head = ("factor", "best", "worst", "differ by", "best better on", "median, best", "median, worst")
    return Table(f"Effect of each factor on {label}, all else the same, 95 % intervals", head, rows)


def _median(one: PairedComparison, i: int) -> str:
    values = one.entrants[i].values
    known = values[np.isfinite(values)]
    return number(float(np.median(known))) if len(known) else NONE
