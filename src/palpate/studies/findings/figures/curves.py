"""From a study's rows to its curves."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.bench.metrics import metric_of
from palpate.bench.sequence import DONE
from palpate.report.study.axes import Scale, decades
from palpate.report.study.lines import Curve, Line, curves_figure
from palpate.studies.definition.tables import Curves
from palpate.studies.findings.figures.rows import FEW, Drawn, Rows, restricted_to, sentence, short

if TYPE_CHECKING:
    from polars import DataFrame

ALWAYS = frozenset({"time_in_contact", "time_to_loss", "contacts_lost"})
"""Metrics of runs that did not come to their end, too."""


def curves_of(table: Rows, asked: Curves, number: int) -> Drawn:
    """Curves that a study asks for."""
    metric, x = metric_of(asked.metric), table.scale(asked.x)

    def made() -> list[Curve]:
        panels = []
        for title, value, rows in table.panels(asked):
            drawn = [*lines(table, rows, asked, x), *references(table, asked, x, value)]
            panels.append(Curve(title, x, drawn, decades(np.concatenate([one.middle for one in drawn]))))
        return panels

    against = " Dashed: the reference runs." if table.plan.study.against else ""
    caption = (
        f"{sentence(metric)}, over {x.label}{restricted_to(asked)}: median, and the range over the seeds and "
        f"the other parameters. Settings with an incomplete run have no point.{against}"
    )
    return Drawn(f"curves{number}", caption, metric, made, curves_figure)


def lines(table: Rows, rows: DataFrame, asked: Curves, x: Scale) -> Iterator[Line]:
    """The study's own lines in a panel."""
    import polars

    if not asked.lines:
        yield _line(rows, asked, x, "study", False)
        return
    axis = table.axis(asked.lines)
    for value in axis.labels()[:FEW]:
        label = (
            f"{axis.parameter.label or asked.lines} {short(value)}" if not isinstance(value, str) else value
        )
        yield _line(rows.filter(polars.col(asked.lines) == value), asked, x, label, False)


def references(table: Rows, asked: Curves, x: Scale, panel: Any) -> Iterator[Line]:
    """The reference runs: a curve if they have the same parameter, else a level."""
    import polars

    for part in table.plan.parts[1:]:
        rows, names = table.where(table.part(part.name), asked), [a.name for a in part.axes]
        if asked.panels in names:
            rows = rows.filter(polars.col(asked.panels) == panel)
        if asked.x in names:
            own = Scale(x.label, table.axis(asked.x, part.name).labels(), x.log)
            yield _line(rows, asked, own, part.name, True)
        else:
            numbers = _good(rows, asked.metric)
            ends = x.places[[0, -1]]
            middle, low, high = (np.full(2, v) for v in _spread(numbers))
            yield Line(part.name, ends, middle, low, high, reference=True)


def _line(rows: DataFrame, asked: Curves, x: Scale, label: str, reference: bool) -> Line:
    import polars

    found = [_spread(_good(rows.filter(polars.col(asked.x) == value), asked.metric)) for value in x.values]
    middle, low, high = np.array(found).T
    return Line(label, x.places, middle, low, high, reference)


def _good(rows: DataFrame, metric: str) -> list[float]:
    """The metric of each run; none at all where one did not come to its end, unless the metric is about that."""
    if metric not in ALWAYS and (rows["result"] != DONE).any():
        return []
    return [float(v) for v in rows[metric] if v is not None]


def _spread(numbers: Sequence[float]) -> tuple[float, float, float]:
    if not numbers:
        return np.nan, np.nan, np.nan
    return float(np.median(numbers)), min(numbers), max(numbers)
