"""A paired comparison in words, as a table, and as plain values."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from palpate.bench.metrics import metric_of
from palpate.report.page import Table
from palpate.studies.findings.figures.rows import short, with_unit
from palpate.studies.findings.pairing import Comparison, Entrant, Pair

NONE = "–"
SHOWN = 12
"""Settings in a table."""


def sentence(comparison: Comparison) -> str:
    """Which setting is the best, on how many surfaces, by how much."""
    first, metric = comparison.entrants[0], metric_of(comparison.metric)
    pair, next_one = comparison.pair(0, 1), comparison.entrants[1].name
    n, unit = pair.surfaces, "" if metric.unit == "1" else f" {metric.unit}"
    place = "".join(f" for {name} {short(value)}" for name, value in comparison.of.items())
    count = f"{round(pair.won * n)} of {n} surfaces"
    if not pair.decided:
        return (
            f"{first.name} and {next_one} do not differ significantly in {metric.called}{place}: {first.name} is "
            f"better on {count}, worse on {round(pair.lost * n)}."
        )
    more = "larger" if comparison.most else "smaller"
    which = "" if len(comparison.entrants) == 2 else f" than {next_one}, the next,"
    lead = f"{first.name} has the {more} {metric.called}{place}{which} on {count}"
    ends = (pair.median, pair.low, pair.high)
    if not all(end is not None and math.isfinite(end) for end in ends):
        return f"{lead}; on the others {first.name} or {next_one} fails." if pair.lost else f"{lead}."
    middle, low, high = (abs(end or 0.0) for end in ends)
    return f"{lead}, by {number(middle)}{unit} (95 %: {number(min(low, high))} to {number(max(low, high))})."


def won(pair: Pair) -> str:
    """The share won, with its interval."""
    return f"{100 * pair.won:.0f} % ({100 * pair.won_low:.0f} to {100 * pair.won_high:.0f})"


def comparison_table(comparison: Comparison) -> Table:
    """Each setting against the best one, on the same surfaces."""
    rows = [
        (
            one.name,
            _quantile(one, 0.5),
            _quantile(one, 0.1 if comparison.most else 0.9),
            NONE if i == 0 else difference(pair),
            NONE if i == 0 else won(pair),
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


def difference(pair: Pair) -> str:
    """The median difference with its interval."""
    if pair.median is None:
        return NONE
    if math.isinf(pair.median):
        return "fails on most" if pair.won < pair.lost else "the best fails on most"
    if pair.low is None or pair.high is None:
        return f"{signed(pair.median)} (too few surfaces)"
    return f"{signed(pair.median)} ({signed(pair.low)} to {signed(pair.high)})"


def signed(value: float) -> str:
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


def as_json(comparisons: Sequence[Comparison]) -> list[dict[str, Any]]:
    """Plain values."""
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
