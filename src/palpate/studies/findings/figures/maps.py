"""From a study's rows to its maps."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from palpate.arrays import Mask
from palpate.bench.metrics import Metric, metric_of
from palpate.bench.sequence import DONE
from palpate.report.study.axes import Scale
from palpate.report.study.maps import Heat, heat_figure
from palpate.studies.definition.tables import Map
from palpate.studies.findings.figures.rows import Drawn, Rows, restricted_to, sentence

if TYPE_CHECKING:
    from polars import DataFrame


def map_of(table: Rows, asked: Map, number: int) -> Drawn:
    """A map that a study asks for."""
    metric, x, y = metric_of(asked.metric), table.scale(asked.x), table.scale(asked.y)

    def made() -> list[Heat]:
        from palpate.studies.findings.figures.stability_boundary import bounds

        panels = []
        for title, value, rows in table.panels(asked):
            values, failed = cells(rows, asked, metric, x, y)
            lines = bounds(table.plan.parts[0], asked, value, x, y) if asked.bound else []
            panels.append(Heat(title, x, y, values, failed, lines))
        return panels

    what = (
        "Most frequent outcome of the runs"
        if metric.words
        else f"{sentence(metric)}: the median of the runs of each cell"
    )
    line = " The line is the stability boundary of the loop's linear model." if asked.bound else ""
    over = f"over {x.label} and {y.label}{restricted_to(asked)}"
    caption = f"{what}, {over}. Crosses: most runs were incomplete.{line}"
    return Drawn(f"map{number}", caption, metric, made, heat_figure)


def cells(rows: DataFrame, asked: Map, metric: Metric, x: Scale, y: Scale) -> tuple[NDArray[Any], Mask]:
    """The value of each cell, and whether most of its runs did not come to their end."""
    grouped = rows.group_by([asked.x, asked.y]).agg(asked.metric, "result")
    by_place = {(one[asked.x], one[asked.y]): one for one in grouped.rows(named=True)}
    shape = (len(y.values), len(x.values))
    values: NDArray[Any] = np.full(shape, "", dtype="U16") if metric.words else np.full(shape, np.nan)
    failed = np.zeros(shape, dtype=bool)
    for (j, vy), (i, vx) in product(enumerate(y.values), enumerate(x.values)):
        cell = by_place.get((vx, vy))
        if cell is None:
            continue
        results, numbers = cell["result"], cell[asked.metric]
        failed[j, i] = sum(r != DONE for r in results) > len(results) / 2
        values[j, i] = _most(results, numbers, metric.words) if metric.words else _median(numbers)
    return values, failed


def _most(results: Sequence[str], numbers: Sequence[float | None], words: Sequence[str]) -> str:
    told = [
        words[round(n)] if r == DONE and n is not None else r for r, n in zip(results, numbers, strict=True)
    ]
    return Counter(told).most_common(1)[0][0]


def _median(numbers: Sequence[float | None]) -> float:
    good = [n for n in numbers if n is not None]
    return float(np.median(good)) if good else np.nan
