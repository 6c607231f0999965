"""Data of the charts on a study's page, as plain values."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from palpate.bench.metrics import metric_of
from palpate.report.study.plain import MOST, numbers, plain_panels
from palpate.studies.definition.plan import Plan
from palpate.studies.findings.figures.rows import Drawn, sentence, with_unit
from palpate.studies.findings.pairing import Comparison

ENTRANTS = 12
"""Settings that are drawn against each other at most, the best ones."""


def charts(plan: Plan, comparisons: Sequence[Comparison], figures: Sequence[Drawn]) -> dict[str, Any]:
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


def _comparison(one: Comparison) -> dict[str, Any]:
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
