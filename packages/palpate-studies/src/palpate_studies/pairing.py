"""Paired comparison of settings, surface by surface: the random surfaces are the same for all settings.

Where a study draws its surfaces at random, its settings (control laws, gains) are compared on the same surfaces with
the same noise: the difficulty that they share falls out. A run that failed is worse than any that was done, so that
none is left out. The median of the differences has its interval from the order statistics, exact whatever their
distribution (Conover, Practical Nonparametric Statistics, 1999, sec. 3.2); a share won has that of Clopper and Pearson
(1934).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.arrays import Array, Mask
from palpate.bench.summary import DONE
from palpate.errors import unknown
from palpate_studies.metrics import Metric, metric_of
from palpate_studies.parameters import Axis, Label, label
from palpate_studies.plan import MAIN, RunPlan, StudyPart
from palpate_studies.report.lines import Scale
from palpate_studies.study import Curves, Map, flat

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from polars import DataFrame

LEVEL = 0.95


@dataclass(frozen=True)
class Entrant:
    """A setting over all surfaces.

    Args:
        name: its chosen values in words.
        at: these.
        values: of the metric, the mean over the seeds of each surface, shape (n,); NaN where it has none.
        failed: where a run was not done, shape (n,).
    """

    name: str
    at: dict[str, Label]
    values: Array
    failed: Mask


@dataclass(frozen=True)
class PairedDifference:
    """One setting against another, on the same surfaces.

    Args:
        median: of the differences, one a surface, in the metric's unit; infinite where one of both failed on most
            surfaces, None where there is none.
        low, high: its 95 % interval, infinite where it reaches among the failures; None for too few surfaces.
        won, lost: shares of the surfaces.
        won_low, won_high: the 95 % interval of the share won.
        surfaces: on which at least one of both was done.
    """

    median: float | None
    low: float | None
    high: float | None
    won: float
    lost: float
    won_low: float
    won_high: float
    surfaces: int

    @property
    def decided(self) -> bool:
        """Whether one is better than the other beyond doubt."""
        return self.low is not None and self.high is not None and (self.low > 0.0 or self.high < 0.0)


@dataclass(frozen=True)
class PairedComparison:
    """The settings of a study by one metric, the best first.

    Args:
        of: the values of the parameters for which there is a comparison each, [best] each.
        metric: its name.
        most: whether more of it is better.
        entrants: by their mean rank over the surfaces.
        ranks: these, 1 being best on every surface.
        behind: each against the first.
        conditions: the surfaces, a column for each parameter drawn, shape (n,) each.
    """

    of: dict[str, Label]
    metric: str
    most: bool
    entrants: tuple[Entrant, ...]
    ranks: tuple[float, ...]
    behind: tuple[PairedDifference, ...]
    conditions: dict[str, list[Label]]

    def pair(self, one: int, other: int) -> PairedDifference:
        """One entrant against another."""
        return compare(self.entrants[one], self.entrants[other], self.most)


def conditions_of(plan: RunPlan) -> list[str]:
    """The parameters that are not chosen but met, as a surface is: those drawn at random, and [best] over."""
    over = plan.study.best.over if plan.study.best else []
    if plan.study.search is not None:
        return []
    return [a.name for a in plan.parts[0].axes if a.drawn or a.name in over]


def comparisons(frame: DataFrame, plan: RunPlan) -> list[PairedComparison]:
    """For each metric that has a better side, the one of [best] first, and each value of what is given."""
    conditions, best = conditions_of(plan), plan.study.best
    if not conditions or best is None:
        return []
    sides = {best.metric: bool(best.most)}
    for name in plan.study.metrics:
        better = metric_of(name).side
        if better and name not in sides:
            sides[name] = better == "most"
    found = []
    for of, rows in _groups(frame, plan, conditions):
        if len(rows) > 1:
            found += [comparison_of(of, rows, name, most, conditions) for name, most in sides.items()]
    return found


GroupedRows = dict[str, tuple[dict[str, Label], "DataFrame"]]


def _groups(
    frame: DataFrame, plan: RunPlan, conditions: Sequence[str]
) -> list[tuple[dict[str, Label], GroupedRows]]:
    """The rows of each setting, by the given values."""
    import polars

    found: dict[tuple[tuple[str, Label], ...], GroupedRows] = {}
    each = plan.study.best.each if plan.study.best else []
    for part in plan.parts:
        own = frame.filter(polars.col("part") == part.name) if "part" in frame.columns else frame
        names = [a.name for a in part.axes if "seed" not in a.targets and a.name not in conditions]
        if not {a.name for a in part.axes} >= set(conditions):
            continue
        cuts = own.partition_by(names, as_dict=True) if names else {(): own}
        for values, rows in cuts.items():
            at = dict(zip(names, values, strict=True))
            given = tuple((name, at.pop(name)) for name in each if name in at)
            found.setdefault(given, {})[_name(plan, part, at)] = (at, rows)
    return [(dict(given), rows) for given, rows in found.items()]


def _name(plan: RunPlan, part: StudyPart, at: Mapping[str, Any]) -> str:
    """A setting's values in words; a parameter's name only where its value alone would not say it."""
    several = len(at) > 1
    words = [f"{v:.4g}" if isinstance(v, float) else str(v) for v in at.values()]
    labels = {a.name: a.parameter.label or a.name for a in part.axes}
    named = [
        f"{labels[name]} {word}" if several or not isinstance(value, str) else word
        for (name, value), word in zip(at.items(), words, strict=True)
    ]
    own = [] if part.name == MAIN else [part.name]
    return ", ".join([*own, *named]) or plan.study.title


def comparison_of(
    of: dict[str, Label], rows: GroupedRows, metric: str, most: bool, conditions: Sequence[str]
) -> PairedComparison:
    """Settings compared by a metric, one difference for each combination of the conditions.

    Args:
        of: the values of the parameters for which it is.
        rows: of each setting its values and its runs.
        metric: its name.
        most: whether more of it is better.
        conditions: columns that say which runs belong together.
    """
    places = sorted({key for _, one in rows.values() for key in one.select(conditions).iter_rows()}, key=str)
    entrants = [
        Entrant(name, at, *_values(one, metric, conditions, places)) for name, (at, one) in rows.items()
    ]
    ranks = mean_ranks(entrants, most)
    order = sorted(range(len(entrants)), key=lambda i: ranks[i])
    first = tuple(entrants[i] for i in order)
    return PairedComparison(
        of,
        metric,
        most,
        first,
        tuple(ranks[i] for i in order),
        tuple(compare(one, first[0], most) for one in first),
        {name: [place[i] for place in places] for i, name in enumerate(conditions)},
    )


def _values(
    rows: DataFrame, metric: str, conditions: Sequence[str], places: Sequence[tuple[Any, ...]]
) -> tuple[Array, Mask]:
    """A setting's metric on each surface, and where it has none."""
    import polars

    mean = polars.col(metric).mean()
    grouped = rows.group_by(conditions).agg(
        (mean.abs() if metric_of(metric).signed else mean).alias("_value"),
        ((polars.col("result") != DONE) | polars.col(metric).is_null()).any().alias("_failed"),
    )
    known = {row[:-2]: row[-2:] for row in grouped.select([*conditions, "_value", "_failed"]).iter_rows()}
    found = [known.get(place, (None, True)) for place in places]
    values = np.array([math.nan if bad or value is None else value for value, bad in found])
    return values, np.array([bool(bad) for _, bad in found])


def compare(one: Entrant, other: Entrant, most: bool) -> PairedDifference:
    """One setting against another: differences of the metric, one a surface.

    A run that failed is worse than any that was done; where both failed nothing is known.
    """
    from scipy.stats import binomtest

    worse = -math.inf if most else math.inf
    either = ~(one.failed & other.failed)
    difference = np.where(one.failed, worse, np.where(other.failed, -worse, one.values - other.values))[
        either
    ]
    n = len(difference)
    if one is other or n == 0:
        return PairedDifference(None, None, None, 0.0, 0.0, 0.0, 1.0, n)
    better = difference > 0.0 if most else difference < 0.0
    won, lost = int(better.sum()), int((~better & (difference != 0.0)).sum())
    share = binomtest(won, n).proportion_ci(LEVEL)
    low, high = median_interval(difference)
    return PairedDifference(
        _median(difference), low, high, won / n, lost / n, float(share.low), float(share.high), n
    )


def _median(values: Array) -> float | None:
    with np.errstate(invalid="ignore"):  # between a failure of the one and of the other there is no middle
        middle = float(np.median(values))
    return None if math.isnan(middle) else middle


def median_interval(values: Array) -> tuple[float | None, float | None]:
    """The 95 % interval of a median by order statistics; None where there are too few values for one."""
    from scipy.stats import binom

    n = len(values)
    k = int(
        binom.ppf((1.0 - LEVEL) / 2.0, n, 0.5)
    )  # that fewer than k lie below the median has at most 2.5 %
    if k == 0:
        return None, None
    ordered = np.sort(values)
    return float(ordered[k - 1]), float(ordered[n - k])


def mean_ranks(entrants: Sequence[Entrant], most: bool) -> list[float]:
    """Of each entrant the mean over the surfaces of its rank there, ties shared (Friedman, 1937)."""
    from scipy.stats import rankdata

    worst = math.inf
    values = np.array([np.where(e.failed, worst, -e.values if most else e.values) for e in entrants])
    return [float(r) for r in rankdata(values, axis=0).mean(axis=1)]


FEW = 12
"""More panels than this are not drawn, nor more lines than this in a panel."""


@dataclass(frozen=True)
class Drawn:
    """A figure before it is drawn.

    Args:
        name: of its file.
        caption: of the figure.
        metric: drawn.
        panels: makes its panels, all of one kind.
        figure: draws them, with what stands at their axis.
    """

    name: str
    caption: str
    metric: Metric
    panels: Callable[[], Sequence[Any]]
    figure: Callable[[Sequence[Any], str], Figure]

    def draw(self) -> Figure:
        """The figure, drawn from its panels."""
        return self.figure(self.panels(), with_unit(self.metric))


class StudyRows:
    """A study's rows, as figures ask for them."""

    def __init__(self, frame: DataFrame, plan: RunPlan):
        self.frame, self.plan = frame, plan

    def part(self, name: str = MAIN) -> DataFrame:
        """The rows of the study's own part, or of one that it is compared with."""
        import polars

        return self.frame.filter(polars.col("part") == name) if "part" in self.frame.columns else self.frame

    def axis(self, name: str, part: str = MAIN) -> Axis:
        """A parameter of a part, by its name."""
        return next(a for p in self.plan.parts if p.name == part for a in p.axes if a.name == name)

    def scale(self, name: str) -> Scale:
        """The axis of a figure that a parameter makes."""
        axis = self.axis(name)
        return Scale(axis.title, axis.labels(), logarithmic(axis))

    def where(self, rows: DataFrame, asked: Map | Curves) -> DataFrame:
        """Those of the rows that a figure is about; a part without such a parameter is left whole.

        Raises:
            InputError: no row has such a value.
        """
        import polars

        for name, value in flat(asked.where).items():
            if name not in rows.columns:
                continue
            known = rows[name].unique().drop_nulls().to_list()
            if known and label(value) not in known:
                raise unknown(f"value of {name}", str(value), map(str, known))
            if known:
                rows = rows.filter(polars.col(name) == label(value))
        return rows

    def panels(self, asked: Map | Curves) -> list[tuple[str, Any, DataFrame]]:
        """Title, value and rows of each panel of a figure; without a parameter for them, one with all its rows."""
        import polars

        name, rows = asked.panels, self.where(self.part(), asked)
        if not name:
            return [("", None, rows)]
        told = self.axis(name).title
        return [
            (f"{told}: {short(v)}", v, rows.filter(polars.col(name) == v))
            for v in self.axis(name).labels()[:FEW]
        ]


def logarithmic(axis: Axis) -> bool:
    """Whether its values go by factors rather than by differences."""
    if axis.parameter.log:
        return True
    scale = Scale("", axis.labels())
    if axis.parameter.range or not scale.numeric or len(scale.values) < 3 or scale.places.min() <= 0.0:
        return False
    return _unevenness(np.log(np.sort(scale.places))) < _unevenness(np.sort(scale.places))


def _unevenness(values: Array) -> float:
    """How much the steps differ, as a share of their mean."""
    steps = np.diff(values)
    return float(np.std(steps) / np.mean(steps))


def restricted_to(asked: Map | Curves) -> str:
    """Common values of a figure's runs, for its caption."""
    return "".join(f", {name} {short(value)}" for name, value in flat(asked.where).items())


def short(value: Any) -> str:
    """A value in few digits."""
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def with_unit(metric: Metric) -> str:
    """A metric's name with its unit, for an axis."""
    return f"{metric.name} [{metric.unit}]" if metric.unit != "1" else metric.name


def sentence(metric: Metric) -> str:
    """A metric's text as the beginning of a sentence."""
    return metric.text[0].upper() + metric.text[1:]
