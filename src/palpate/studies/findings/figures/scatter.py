"""From a study's rows to clouds of points, where its parameters were drawn."""

from __future__ import annotations

from collections.abc import Iterator

from palpate.bench.metrics import Metric
from palpate.report.study.axes import Scale
from palpate.report.study.clouds import Cloud, Points, clouds_figure
from palpate.studies.definition.parameters import Axis
from palpate.studies.findings.figures.rows import FEW, Drawn, Rows, logarithmic, sentence

CLOUDS = 9
"""Parameters that are drawn as clouds at most."""


def clouds_of(table: Rows, metric: Metric) -> Drawn:
    """A metric over every parameter that was drawn."""
    axes = [a for a in table.plan.parts[0].axes if "seed" not in a.targets]
    drawn, others = [a for a in axes if a.drawn], [a for a in axes if not a.drawn and len(a.settings) <= FEW]
    kinds = others[0] if others else None

    def made() -> list[Cloud]:
        return [
            Cloud(
                Scale(a.title, (a.between(0.0), a.between(1.0)), logarithmic(a)),
                list(points(table, metric, a.name, kinds)),
                metric.words,
            )
            for a in drawn[:CLOUDS]
        ]

    middle = "mean" if metric.words else "median"
    caption = f"{sentence(metric)}: every run, and the {middle} of each eighth of them."
    return Drawn(f"clouds-{metric.name.replace(':', '-')}", caption, metric, made, clouds_figure)


def points(table: Rows, metric: Metric, name: str, kinds: Axis | None) -> Iterator[Points]:
    """The runs of each case over a drawn parameter."""
    import polars

    for kind in kinds.labels() if kinds else ("",):
        rows = table.part().filter(polars.col(metric.name).is_not_null())
        if kinds:
            rows = rows.filter(polars.col(kinds.name) == kind)
        if len(rows):
            yield Points(str(kind), rows[name].to_numpy().astype(float), rows[metric.name].to_numpy())
