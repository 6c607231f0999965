"""The figures of a study, from its rows: curves, maps, and clouds of points where its parameters were drawn.

On a map of parameters stands where the linear model of the study's loop loses its stability.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from functools import cache
from itertools import pairwise, product
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from palpate.arrays import Mask
from palpate.bench import Experiment, with_values
from palpate.bench.summary import DONE
from palpate.controllers import NeuralController
from palpate.errors import InputError
from palpate.report import style
from palpate_studies.metrics import Metric, metric_of
from palpate_studies.pairing import FEW, Drawn, StudyRows, logarithmic, restricted_to, sentence, short
from palpate_studies.parameters import Axis
from palpate_studies.plan import RunPlan, StudyPart
from palpate_studies.report.lines import (
    Cloud,
    LinePanel,
    MetricLine,
    Points,
    Scale,
    clouds_figure,
    curves_figure,
    decades,
)
from palpate_studies.report.maps import BoundaryLine, Heat, heat_figure
from palpate_studies.study import Curves, Map, flat

if TYPE_CHECKING:
    from polars import DataFrame

ALWAYS = frozenset({"time_in_contact", "time_to_loss", "contacts_lost"})
"""Metrics of runs that did not come to their end, too."""


def curves_of(table: StudyRows, asked: Curves, number: int) -> Drawn:
    """Curves that a study asks for."""
    metric, x = metric_of(asked.metric), table.scale(asked.x)

    def curves() -> list[LinePanel]:
        panels = []
        for title, value, rows in table.panels(asked):
            drawn = [*lines(table, rows, asked, x), *references(table, asked, x, value)]
            panels.append(LinePanel(title, x, drawn, decades(np.concatenate([one.middle for one in drawn]))))
        return panels

    against = " Dashed: the reference runs." if table.plan.study.against else ""
    caption = (
        f"{sentence(metric)}, over {x.label}{restricted_to(asked)}: median, and the range over the seeds and "
        f"the other parameters. Settings with an incomplete run have no point.{against}"
    )
    return Drawn(f"curves{number}", caption, metric, curves, curves_figure)


def lines(table: StudyRows, rows: DataFrame, asked: Curves, x: Scale) -> Iterator[MetricLine]:
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


def references(table: StudyRows, asked: Curves, x: Scale, panel: Any) -> Iterator[MetricLine]:
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
            yield MetricLine(part.name, ends, middle, low, high, reference=True)


def _line(rows: DataFrame, asked: Curves, x: Scale, label: str, reference: bool) -> MetricLine:
    import polars

    found = [_spread(_good(rows.filter(polars.col(asked.x) == value), asked.metric)) for value in x.values]
    middle, low, high = np.array(found).T
    return MetricLine(label, x.places, middle, low, high, reference)


def _good(rows: DataFrame, metric: str) -> list[float]:
    """The metric of each run; none at all where one did not come to its end, unless the metric is about that."""
    if metric not in ALWAYS and (rows["result"] != DONE).any():
        return []
    return [float(v) for v in rows[metric] if v is not None]


def _spread(numbers: Sequence[float]) -> tuple[float, float, float]:
    if not numbers:
        return np.nan, np.nan, np.nan
    return float(np.median(numbers)), min(numbers), max(numbers)


def map_of(table: StudyRows, asked: Map, number: int) -> Drawn:
    """A map that a study asks for."""
    metric, x, y = metric_of(asked.metric), table.scale(asked.x), table.scale(asked.y)

    def heats() -> list[Heat]:

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
    return Drawn(f"map{number}", caption, metric, heats, heat_figure)


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


CLOUDS = 9
"""Parameters that are drawn as clouds at most."""


def clouds_of(table: StudyRows, metric: Metric) -> Drawn:
    """A metric over every parameter that was drawn."""
    axes = [a for a in table.plan.parts[0].axes if "seed" not in a.targets]
    drawn, others = [a for a in axes if a.drawn], [a for a in axes if not a.drawn and len(a.settings) <= FEW]
    kinds = others[0] if others else None

    def clouds() -> list[Cloud]:
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
    return Drawn(f"clouds-{metric.name.replace(':', '-')}", caption, metric, clouds, clouds_figure)


def points(table: StudyRows, metric: Metric, name: str, kinds: Axis | None) -> Iterator[Points]:
    """The runs of each case over a drawn parameter."""
    import polars

    for kind in kinds.labels() if kinds else ("",):
        rows = table.part().filter(polars.col(metric.name).is_not_null())
        if kinds:
            rows = rows.filter(polars.col(kinds.name) == kind)
        if len(rows):
            yield Points(str(kind), rows[name].to_numpy().astype(float), rows[metric.name].to_numpy())


def draw(
    drawn: Sequence[Drawn], folder: Path, endings: Sequence[str] = (), dpi: int | None = None
) -> dict[Path, str]:
    """Draws figures into a study's folder: the PNG, and the caption of each.

    Args:
        drawn: the figures.
        folder: that is there.
        endings: of the files, each of `style.FORMATS`; a PNG is written in any case.
        dpi: of a PNG; `style.DPI` if none is given.
    """
    made = {}
    for one in drawn:
        with style.ink():
            figure = one.draw()
            for ending in dict.fromkeys((*endings, ".png")):
                made[style.save(figure, folder / f"{one.name}{ending}", dpi)] = one.caption
    return {path: caption for path, caption in made.items() if path.suffix == ".png"}


def figures(frame: DataFrame, plan: RunPlan) -> Iterator[Drawn]:
    """The figures that a study asks for; of each metric that it asks none of, those that its parameters suit."""
    own = StudyRows(frame, plan)
    maps, curves = list(plan.study.maps), list(plan.study.curves)
    asked = {one.metric for one in maps} | {one.metric for one in curves}
    left = [name for name in plan.study.metrics if name not in asked]
    if any(a.drawn for a in plan.parts[0].axes):
        yield from (clouds_of(own, metric_of(name)) for name in left)
    else:
        more_maps, more_curves = _suggest(plan, left, maps=not plan.study.maps)
        maps, curves = maps + more_maps, curves + more_curves
    yield from (map_of(own, asked, number) for number, asked in enumerate(maps, 1))
    yield from (curves_of(own, asked, number) for number, asked in enumerate(curves, 1))


def _suggest(plan: RunPlan, metrics: Sequence[str], *, maps: bool) -> tuple[list[Map], list[Curves]]:
    """A map of each metric over the two longest parameters, or curves over the longest."""
    free = [a for a in plan.parts[0].grid if "seed" not in a.targets]
    by_size = sorted(free, key=lambda a: -len(a.settings) if Scale("", a.labels()).numeric else 0)
    axes = [a.name for a in by_size]
    worded = [name for name in metrics if metric_of(name).words]
    found = [Map(axes[0], axes[1], name) for name in (metrics if maps else worded)] if len(axes) > 1 else []
    second = next((a.name for a in by_size[1:] if len(a.settings) <= FEW), "")
    curves = [Curves(axes[0], name, second) for name in metrics if not metric_of(name).words] if axes else []
    return found, curves


LOOKED_AT = 8
"""Places along a row that are looked at first; what changes twice between two of them is not seen."""
EXACT = 5e-3
"""Of a place found, as a share of the row."""
LABEL = "linear model: stability lost"

Growing = Callable[[float], float | None]


def bounds(part: StudyPart, asked: Map, panel: Any, x: Scale, y: Scale) -> list[BoundaryLine]:
    """Where stability is lost, along each row of a map; along each column where only the rows are numbers.

    Args:
        part: the study's own.
        asked: the map.
        panel: value of its third parameter; None where it has none.
        x: its axis across.
        y: its axis upwards.
    """
    along, across = (x, y) if x.numeric else (y, x)
    if not along.numeric:
        return []
    names = (asked.x, asked.y) if x.numeric else (asked.y, asked.x)
    found: dict[int, list[tuple[float, float]]] = {}
    for place, value in zip(across.places.tolist(), across.values, strict=True):
        fixed = flat(asked.where) | ({asked.panels: panel} if asked.panels else {})
        for i, lost in enumerate(
            _stability_crossings(along, _growing(part, names[0], {**fixed, names[1]: value}))
        ):
            found.setdefault(i, []).extend([(lost, place)] if across.numeric else _over_cell(lost, place))
    lines = [list(zip(*points, strict=True)) for points in found.values()]
    return [BoundaryLine(LABEL, *((a, b) if x.numeric else (b, a))) for a, b in lines]


def equivalent(experiment: Experiment) -> Experiment:
    """The experiment with the plain integrator that its neural controller is to first order.

    Near small weights an output is A s(w) with the slope A/2 in its threshold w, and a tick's learning moves w by
    eta e A/2: the command grows by eta (A/2)² e a tick, K_i = eta (A/2)²/Ts.
    """
    c = experiment.controller
    if not isinstance(c, NeuralController):
        return experiment
    ki = c.learning_rate * (c.amplitude[0] / 2.0) ** 2 * experiment.run.rate
    table = {"kind": "proportional-integral", "kp": c.kp, "kv": c.kv, "kf": c.kf, "ki": ki}
    return with_values(experiment, {"controller": table})


def _growing(part: StudyPart, name: str, fixed: Mapping[str, Any]) -> Growing:
    """How fast the linear model grows at a value of a parameter, below 0 where it is stable; None without a model."""
    middle = {a.name: a.settings[len(a.settings) // 2] if a.settings else a.between(0.5) for a in part.axes}
    middle |= {a.name: _set(a.settings, a.labels(), fixed[a.name]) for a in part.axes if a.name in fixed}

    def growing(value: float) -> float | None:
        try:
            experiment = part.experiment({**middle, name: value})
        except InputError:
            return None
        if not isinstance(experiment, Experiment):
            return None
        # Friction is not in the linear model: panels that differ in it alone share their boundary.
        return _growth(with_values(equivalent(experiment), {"friction": {}}))

    return growing


@cache
def _growth(experiment: Experiment) -> float | None:
    from palpate_studies.analysis import linearise

    try:
        return math.log(linearise(experiment).growth)
    except InputError:
        return None


def _set(settings: Sequence[Any], labels: Sequence[Any], label: Any) -> Any:
    """The value as it is set, from what stands in the table."""
    return settings[list(labels).index(label)] if label in labels else label


def _stability_crossings(scale: Scale, growing: Growing) -> Iterator[float]:
    """The values at which stability is lost or won."""
    from scipy.optimize import brentq

    low, high = float(scale.places.min()), float(scale.places.max())

    def value(share: float) -> float:
        return low * (high / low) ** share if scale.log else low + (high - low) * share

    def rate(share: float) -> float:
        found = growing(value(share))
        return math.nan if found is None else found

    shares = [i / (LOOKED_AT - 1) for i in range(LOOKED_AT)]
    rates = [rate(share) for share in shares]
    for (a, before), (b, after) in pairwise(zip(shares, rates, strict=True)):
        if before * after < 0.0:
            with suppress(ValueError):  # no model somewhere between
                yield value(float(brentq(rate, a, b, xtol=EXACT)))


def _over_cell(lost: float, place: float) -> list[tuple[float, float]]:
    """A stroke across the row of a parameter that is no number, and a gap."""
    return [(lost, place - 0.5), (lost, place + 0.5), (np.nan, np.nan)]
