"""The figures of a study, from its rows: maps and curves."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from palpate.arrays import Array, Mask
from palpate.bench.summary import DONE
from palpate.report import style
from palpate.studies.comparison import short
from palpate.studies.drawing import (
    Heat,
    LinePanel,
    MetricLine,
    Scale,
    curves_figure,
    heat_figure,
)
from palpate.studies.metrics import Metric, metric_of
from palpate.studies.parameters import Axis
from palpate.studies.plan import RunPlan
from palpate.studies.study import Curves, Map

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from polars import DataFrame

MAX_PANELS = 12
"""Panels of a figure, and lines of a panel."""
EIGHTHS = 8
"""Equal parts of a random parameter's runs."""
LOG_RATIO = 10.0
"""Ratio of the largest to the smallest value of a list from which its axis is logarithmic."""
ALWAYS = frozenset({"time_in_contact", "contacts_lost"})
"""Metrics of incomplete runs too."""


@dataclass(frozen=True)
class StudyFigure:
    """A figure: its file's name without the ending, its caption, and the drawing."""

    name: str
    caption: str
    drawing: Figure


def draw(
    frame: DataFrame, plan: RunPlan, folder: Path, endings: Sequence[str] = (), dpi: int | None = None
) -> dict[Path, str]:
    """Draw all figures of a study into its folder.

    Args:
        frame: a row for each run.
        plan: of the study.
        folder: that exists.
        endings: of the files, each of `style.FORMATS`; a PNG is written in any case.
        dpi: of a PNG; `style.DPI` if none is given.

    Returns:
        The caption of each PNG.
    """
    captions = {}
    with style.ink():
        for figure in figures(frame, plan):
            for ending in dict.fromkeys((*endings, ".png")):
                path = style.save(figure.drawing, folder / f"{figure.name}{ending}", dpi)
                if ending == ".png":
                    captions[path] = figure.caption
    return captions


def figures(frame: DataFrame, plan: RunPlan) -> Iterator[StudyFigure]:
    """The figures that a study asks for; for each other metric, those that suit its parameters."""
    maps, curves = list(plan.study.maps), list(plan.study.curves)
    covered = {map_.metric for map_ in maps} | {curve.metric for curve in curves}
    metrics = [name for name in plan.study.metrics if name not in covered]
    if not plan.random_axes:
        more_maps, more_curves = _suggest(plan, metrics)
        maps, curves, metrics = maps + more_maps, curves + more_curves, []
    for number, map_ in enumerate(maps, 1):
        yield map_of(frame, plan, map_, number)
    for number, curve in enumerate(curves, 1):
        yield curves_of(frame, plan, curve, number)
    for name in metrics:
        yield trends_of(frame, plan, metric_of(name))


def _suggest(plan: RunPlan, metrics: Sequence[str]) -> tuple[list[Map], list[Curves]]:
    """A map of each metric over the two longest parameters, and curves of quantities over the longest one."""
    free = [a for a in plan.grid if not a.is_seed]
    by_size = sorted(free, key=lambda a: -len(a.settings) if Scale("", a.labels()).numeric else 0)
    names = [a.name for a in by_size]
    maps = [Map(names[0], names[1], metric) for metric in metrics] if len(names) > 1 else []
    lines = next((a.name for a in by_size[1:] if len(a.settings) <= MAX_PANELS), "")
    quantities = [metric for metric in metrics if not metric_of(metric).words]
    return maps, [Curves(names[0], metric, lines) for metric in quantities] if names else []


def scale_of(axis: Axis) -> Scale:
    """The axis of a figure for a parameter."""
    log = axis.parameter.log is not None
    if axis.drawn:
        return Scale(axis.title, (axis.between(0.0), axis.between(1.0)), log)
    scale = Scale(axis.title, axis.labels(), log)
    if axis.parameter.values is None or not scale.numeric:
        return scale
    low, high = scale.places.min(), scale.places.max()
    return Scale(axis.title, axis.labels(), bool(0.0 < LOG_RATIO * low <= high))


def panels_of(frame: DataFrame, plan: RunPlan, name: str) -> list[tuple[str, DataFrame]]:
    """Title and rows for each value of a parameter; all rows without a parameter."""
    import polars

    if not name:
        return [("", frame)]
    axis = plan.axis(name)
    return [
        (f"{axis.title}: {short(value)}", frame.filter(polars.col(name) == value))
        for value in axis.labels()[:MAX_PANELS]
    ]


def curves_of(frame: DataFrame, plan: RunPlan, spec: Curves, number: int) -> StudyFigure:
    """Curves that a study asks for."""
    metric, x = metric_of(spec.metric), scale_of(plan.axis(spec.x))
    panels = [
        LinePanel(title, x, list(lines_of(rows, plan, spec, x)))
        for title, rows in panels_of(frame, plan, spec.panels)
    ]
    caption = (
        f"{metric.sentence}, over {x.label}: median, and the range over the seeds and "
        f"the other parameters. Settings with an incomplete run have no point."
    )
    return StudyFigure(f"curves{number}", caption, curves_figure(panels, metric.title))


def lines_of(rows: DataFrame, plan: RunPlan, spec: Curves, x: Scale) -> Iterator[MetricLine]:
    """The lines of a panel."""
    import polars

    for title, line_rows in panels_of(rows, plan, spec.lines):
        parts = [line_rows.filter(polars.col(spec.x) == value) for value in x.values]
        middle, low, high = np.array([_spread(part, spec.metric) for part in parts]).T
        yield MetricLine(title, x.places, middle, low, high)


def _spread(rows: DataFrame, metric: str) -> tuple[float, float, float]:
    """Median and range of a metric; NaN if a run is incomplete, unless the metric is about that."""
    values = rows[metric].drop_nulls().to_numpy()
    if not len(values) or (metric not in ALWAYS and (rows["result"] != DONE).any()):
        return np.nan, np.nan, np.nan
    return float(np.median(values)), float(values.min()), float(values.max())


def map_of(frame: DataFrame, plan: RunPlan, spec: Map, number: int) -> StudyFigure:
    """A map that a study asks for."""
    metric, x, y = metric_of(spec.metric), scale_of(plan.axis(spec.x)), scale_of(plan.axis(spec.y))
    panels = [
        Heat(title, x, y, *cells(rows, spec, metric, x, y))
        for title, rows in panels_of(frame, plan, spec.panels)
    ]
    values = (
        "Most frequent outcome of the runs"
        if metric.words
        else f"{metric.sentence}: the median of the runs of each cell"
    )
    over = f"over {x.label} and {y.label}"
    caption = f"{values}, {over}. Crosses: most runs were incomplete."
    return StudyFigure(f"map{number}", caption, heat_figure(panels, metric.title))


def cells(rows: DataFrame, spec: Map, metric: Metric, x: Scale, y: Scale) -> tuple[NDArray[Any], Mask]:
    """The value of each cell, and True where most of its runs were not completed."""
    grouped = rows.group_by([spec.x, spec.y]).agg(spec.metric, "result")
    by_place = {(row[spec.x], row[spec.y]): row for row in grouped.rows(named=True)}
    shape = (len(y.values), len(x.values))
    values: NDArray[Any] = np.full(shape, "", dtype="U16") if metric.words else np.full(shape, np.nan)
    failed = np.zeros(shape, dtype=bool)
    for (j, vy), (i, vx) in product(enumerate(y.values), enumerate(x.values)):
        cell = by_place.get((vx, vy))
        if cell is None:
            continue
        results, numbers = cell["result"], cell[spec.metric]
        failed[j, i] = sum(result != DONE for result in results) > len(results) / 2
        values[j, i] = _outcome(results, numbers, metric.words) if metric.words else _median(numbers)
    return values, failed


def _outcome(results: Sequence[str], numbers: Sequence[float | None], words: Sequence[str]) -> str:
    """The most frequent outcome."""
    outcomes = [
        words[round(number)] if result == DONE and number is not None else result
        for result, number in zip(results, numbers, strict=True)
    ]
    return Counter(outcomes).most_common(1)[0][0]


def _median(numbers: Sequence[float | None]) -> float:
    good = [number for number in numbers if number is not None]
    return float(np.median(good)) if good else np.nan


def trends_of(frame: DataFrame, plan: RunPlan, metric: Metric) -> StudyFigure:
    """A metric over every random parameter."""
    cases = next((a.name for a in plan.grid if not a.is_seed), "")
    panels = [
        LinePanel("", scale_of(a), list(trend_lines(frame, plan, metric, a.name, cases)))
        for a in plan.random_axes[:MAX_PANELS]
    ]
    middle = "mean" if metric.words else "median, and 10 to 90 %,"
    caption = f"{metric.sentence}: {middle} of each eighth of the runs."
    name = f"trends-{metric.name.replace(':', '-')}"
    return StudyFigure(name, caption, curves_figure(panels, metric.title, metric.words))


def trend_lines(
    frame: DataFrame, plan: RunPlan, metric: Metric, name: str, cases: str
) -> Iterator[MetricLine]:
    """A line for each case: the metric over each eighth of a random parameter."""
    import polars

    known = frame.filter(polars.col(metric.name).is_not_null())
    for title, rows in panels_of(known, plan, cases):
        if len(rows):
            ordered = rows.sort(name)
            x, y = ordered[name].to_numpy(), ordered[metric.name].to_numpy()
            parts = np.array_split(np.arange(len(x)), min(EIGHTHS, len(x)))
            low, middle, high = np.array([_trend(y[part], metric) for part in parts]).T
            yield MetricLine(title, np.array([np.median(x[part]) for part in parts]), middle, low, high)


def _trend(values: Array, metric: Metric) -> Array:
    """10 %, median and 90 % of a quantity; three times the mean of whole numbers that are words."""
    if metric.words:
        return np.full(3, values.mean())
    return np.quantile(values, (0.1, 0.5, 0.9))
