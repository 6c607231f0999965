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
    """Which setting is the best, and how sure that is."""
    first, metric = comparison.entrants[0], metric_of(comparison.metric)
    n, pair = len(first.values), comparison.pair(0, 1)
    next_one = comparison.entrants[1].name
    unit = "" if metric.unit == "1" else f" {metric.unit}"
    side = "most" if comparison.most else "least"
    place = "".join(f" for {name} {short(value)}" for name, value in comparison.of.items())
    if not pair.decided:
        return (
            f"Over {n} surfaces no setting has significantly the {side} {comparison.metric}{place}: {first.name} "
            f"and {next_one} do not differ ({won(pair)} against {100 * pair.lost:.0f} % of the surfaces)."
        )
    lead = f"{first.name} has the {side} {comparison.metric}{place}"
    better = f"it is better on {won(pair)} of {n} surfaces"
    if pair.median is None or not all(map(math.isfinite, (pair.median, pair.low or 0.0, pair.high or 0.0))):
        return f"{lead}: against {next_one}, the next, {better}."
    how = "more" if comparison.most else "less"
    low, high = sorted((abs(pair.low or 0.0), abs(pair.high or 0.0)))
    return (
        f"{lead}: on the same surface {number(abs(pair.median))}{unit} {how} than {next_one}, the next (95 %: "
        f"{number(low)} to {number(high)}); {better}."
    )


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
        "less the best's",
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
