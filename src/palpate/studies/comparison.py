"""Which setting of a study is better: compared pairwise on the same random surfaces, or ranked over the seeds.

If surfaces are drawn at random, all settings are compared on the same surfaces with the same noise: the difficulty that
they share falls out. A failed run is worse than any completed one. The median of the differences has its interval from
the order statistics, exact for every distribution (Conover, Practical Nonparametric Statistics, 1999, sec. 3.2); the
fraction of surfaces won has that of Clopper and Pearson (1934).

Without random surfaces the settings are ranked by their mean over the seeds, with Student's interval.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.arrays import Array, Mask
from palpate.bench.summary import DONE
from palpate.signals.samples import ranks
from palpate.studies.metrics import metric_of
from palpate.studies.parameters import Label
from palpate.studies.plan import RunPlan

if TYPE_CHECKING:
    from polars import DataFrame

LEVEL = 0.95


@dataclass(frozen=True)
class Entrant:
    """A setting over all surfaces.

    Args:
        name: its values in words.
        at: the parameters' values.
        values: of the metric, the mean over the seeds of each surface, shape (n,); NaN where it has none.
        failed: True where a run was not completed, shape (n,).
    """

    name: str
    at: dict[str, Label]
    values: Array
    failed: Mask


@dataclass(frozen=True)
class PairedDifference:
    """One setting against another, on the same surfaces.

    Args:
        median: of the differences, one per surface, in the metric's unit; infinite where one of both failed on most
            surfaces, None where there is none.
        low, high: its 95 % interval, infinite where it reaches among the failures; None for too few surfaces.
        won, lost: fractions of the surfaces.
        won_low, won_high: the 95 % interval of the fraction won.
        surfaces: number of surfaces on which at least one of both was completed.
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
        """True if the 95 % interval of the median difference excludes zero."""
        return self.low is not None and self.high is not None and (self.low > 0.0 or self.high < 0.0)


@dataclass(frozen=True)
class PairedComparison:
    """The settings of a study by one metric, the best first.

    Args:
        of: values of the parameters of [best] each.
        metric: its name.
        most: True if more of it is better.
        entrants: by their mean rank over the surfaces.
        ranks: the mean ranks; 1 is best on every surface.
        behind: each setting against the first.
    """

    of: dict[str, Label]
    metric: str
    most: bool
    entrants: tuple[Entrant, ...]
    ranks: tuple[float, ...]
    behind: tuple[PairedDifference, ...]


def comparisons(frame: DataFrame, plan: RunPlan) -> list[PairedComparison]:
    """Settings on the same random surfaces, for each metric with a better side: that of [best] first."""
    best, surfaces = plan.study.best, [a.name for a in plan.random_axes]
    if not surfaces or best is None:
        return []
    sides = {best.metric: bool(best.most)}
    for name in plan.study.metrics:
        side = metric_of(name).side
        if side:
            sides.setdefault(name, side == "most")
    return [
        _compare_settings(of, settings, name, most, surfaces)
        for of, settings in _groups(frame, plan)
        if len(settings) > 1
        for name, most in sides.items()
    ]


Settings = list[tuple[dict[str, Label], "DataFrame"]]


def _groups(frame: DataFrame, plan: RunPlan) -> list[tuple[dict[str, Label], Settings]]:
    """Values and rows of each setting, grouped by the values of the parameters of [best] each."""
    names = [a.name for a in plan.grid if not a.is_seed]
    each = plan.study.best.each if plan.study.best else []
    parts = frame.partition_by(names, as_dict=True) if names else {(): frame}
    groups: dict[tuple[tuple[str, Label], ...], Settings] = {}
    for values, rows in parts.items():
        at = dict(zip(names, values, strict=True))
        of = tuple((name, at.pop(name)) for name in each if name in at)
        groups.setdefault(of, []).append((at, rows))
    return [(dict(of), settings) for of, settings in groups.items()]


def _compare_settings(
    of: dict[str, Label], settings: Settings, metric: str, most: bool, surfaces: Sequence[str]
) -> PairedComparison:
    places = sorted({key for _, rows in settings for key in rows.select(surfaces).iter_rows()}, key=str)
    entrants = [Entrant(_name(at), at, *_values(rows, metric, surfaces, places)) for at, rows in settings]
    ranks = mean_ranks(entrants, most)
    order = sorted(range(len(entrants)), key=lambda i: ranks[i])
    ordered = tuple(entrants[i] for i in order)
    behind = tuple(compare(entrant, ordered[0], most) for entrant in ordered)
    return PairedComparison(of, metric, most, ordered, tuple(ranks[i] for i in order), behind)


def _name(at: Mapping[str, Label]) -> str:
    """A setting's values in words; with parameters' names unless a single text says enough."""
    values = list(at.values())
    if len(values) == 1 and isinstance(values[0], str):
        return values[0]
    return ", ".join(f"{name} {short(value)}" for name, value in at.items()) or "the study"


def _values(
    rows: DataFrame, metric: str, surfaces: Sequence[str], places: Sequence[tuple[Any, ...]]
) -> tuple[Array, Mask]:
    """A setting's metric on each surface, and True where it has none."""
    import polars

    mean = polars.col(metric).mean()
    grouped = rows.group_by(surfaces).agg(
        (mean.abs() if metric_of(metric).signed else mean).alias("_value"),
        ((polars.col("result") != DONE) | polars.col(metric).is_null()).any().alias("_failed"),
    )
    known = {row[:-2]: row[-2:] for row in grouped.select([*surfaces, "_value", "_failed"]).iter_rows()}
    pairs = [known.get(place, (None, True)) for place in places]
    values = np.array([math.nan if failed or value is None else value for value, failed in pairs])
    return values, np.array([bool(failed) for _, failed in pairs])


def compare(one: Entrant, other: Entrant, most: bool) -> PairedDifference:
    """One setting against another: differences of the metric, one per surface.

    A failed run is worse than any completed one; surfaces on which both failed do not count.
    """
    worse = -math.inf if most else math.inf
    either = ~(one.failed & other.failed)
    difference = np.where(one.failed, worse, np.where(other.failed, -worse, one.values - other.values))
    difference = difference[either]
    n = len(difference)
    if one is other or n == 0:
        return PairedDifference(None, None, None, 0.0, 0.0, 0.0, 1.0, n)
    better = difference > 0.0 if most else difference < 0.0
    won, lost = int(better.sum()), int((~better & (difference != 0.0)).sum())
    low, high = median_interval(difference)
    return PairedDifference(
        _median(difference), low, high, won / n, lost / n, *_proportion_interval(won, n), n
    )


def _proportion_interval(won: int, n: int) -> tuple[float, float]:
    """The interval of a proportion by Clopper and Pearson."""
    from scipy.special import betaincinv

    tail = (1.0 - LEVEL) / 2.0
    low = float(betaincinv(won, n - won + 1, tail)) if won > 0 else 0.0
    return low, float(betaincinv(won + 1, n - won, 1.0 - tail)) if won < n else 1.0


def _median(values: Array) -> float | None:
    with np.errstate(invalid="ignore"):  # between failures of either there is no middle
        middle = float(np.median(values))
    return None if math.isnan(middle) else middle


def median_interval(values: Array) -> tuple[float | None, float | None]:
    """The 95 % interval of a median by order statistics; None for too few values."""
    from scipy.special import bdtr

    n = len(values)
    below = bdtr(np.arange(n + 1.0), n, 0.5)
    k = int(
        np.searchsorted(below, (1.0 - LEVEL) / 2.0)
    )  # fewer than k values below the median: at most 2.5 %
    if k == 0:
        return None, None
    ordered = np.sort(values)
    return float(ordered[k - 1]), float(ordered[n - k])


def mean_ranks(entrants: Sequence[Entrant], most: bool) -> list[float]:
    """Mean rank of each entrant over the surfaces; ties share theirs (Friedman, 1937)."""
    values = np.array([np.where(e.failed, math.inf, -e.values if most else e.values) for e in entrants])
    return [float(rank) for rank in np.apply_along_axis(ranks, 0, values).mean(axis=1)]


@dataclass(frozen=True)
class MetricMean:
    """A mean over seeds.

    Args:
        value: the mean.
        half: half-width of its 95 % interval by Student's t; None for a single seed.
    """

    value: float
    half: float | None

    @property
    def excludes_zero(self) -> bool:
        """True if the 95 % interval excludes zero."""
        return self.half is not None and abs(self.value) > self.half


@dataclass(frozen=True)
class Ranked:
    """A setting of which all runs were completed.

    Args:
        at: the parameters' values, the seed aside.
        runs: number of seeds.
        metric: of the ranking.
        behind: its distance from the best setting, seed by seed: the noise that they share falls out.
    """

    at: dict[str, Label]
    runs: int
    metric: MetricMean
    behind: MetricMean


@dataclass(frozen=True)
class Ranking:
    """Settings by their metric, the best one first.

    Args:
        of: values of the parameters of [best] each.
        settings: those of which all runs were completed.
        failed: number of settings of which a run failed.
    """

    of: dict[str, Label]
    settings: tuple[Ranked, ...]
    failed: int

    @property
    def as_good(self) -> int:
        """Number of other settings that do not differ significantly from the best one."""
        return sum(not setting.behind.excludes_zero for setting in self.settings[1:])


def rankings(frame: DataFrame, plan: RunPlan) -> list[Ranking]:
    """The settings by the study's [best]: a ranking for each combination of values of [best] each."""
    if plan.study.best is None:
        return []
    return list(_rankings(frame, plan, plan.study.best.metric, 1.0 if plan.study.best.least else -1.0))


def _rankings(frame: DataFrame, plan: RunPlan, metric: str, sign: float) -> Iterator[Ranking]:
    for of, settings in _groups(frame, plan):
        by_seed = [(at, _metric_by_seed(rows, metric)) for at, rows in settings]
        done = [(at, seeds) for at, seeds in by_seed if seeds]
        done.sort(key=lambda setting: sign * float(np.mean(list(setting[1].values()))))
        ranked = tuple(_rank(at, seeds, done[0][1], sign) for at, seeds in done)
        yield Ranking(of, ranked, len(settings) - len(done))


def _metric_by_seed(rows: DataFrame, metric: str) -> dict[int, float]:
    """The metric of a setting by seed; empty if a run failed."""
    values = rows[metric].to_list()
    if (rows["result"] != DONE).any() or None in values:
        return {}
    if metric_of(metric).signed:
        values = [abs(value) for value in values]
    return dict(zip(rows["seed"].to_list(), values, strict=True))


def _rank(at: dict[str, Label], seeds: Mapping[int, float], best: Mapping[int, float], sign: float) -> Ranked:
    differences = [sign * (value - best[seed]) for seed, value in seeds.items() if seed in best]
    return Ranked(at, len(seeds), mean(list(seeds.values())), mean(differences))


def mean(values: Sequence[float]) -> MetricMean:
    """The mean of some values with its interval."""
    from scipy.special import stdtrit

    n = len(values)
    if n == 0:
        return MetricMean(math.nan, None)
    half = float(stdtrit(n - 1, 0.5 + LEVEL / 2) * np.std(values, ddof=1) / math.sqrt(n)) if n > 1 else None
    return MetricMean(float(np.mean(values)), half)


def short(value: Any) -> str:
    """A value in few digits."""
    return f"{value:.4g}" if isinstance(value, float) else str(value)
