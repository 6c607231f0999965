"""The best settings of a study, and the significance of their differences from the best."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.bench.metrics import metric_of
from palpate.bench.sequence import DONE
from palpate.studies.parameters import Label
from palpate.studies.plan import MAIN, Plan

if TYPE_CHECKING:
    from polars import DataFrame

LEVEL = 0.95


@dataclass(frozen=True)
class MetricMean:
    """A mean over seeds, with its 95 % interval by Student's t; without one for a single seed."""

    value: float
    half: float | None

    @property
    def excludes_zero(self) -> bool:
        """Whether it is known to differ from zero."""
        return self.half is not None and abs(self.value) > self.half


@dataclass(frozen=True)
class Ranked:
    """A setting with all its runs completed.

    Args:
        at: the parameters' values, the seed aside.
        runs: how many seeds.
        metric: of the ranking.
        behind: by how much it is worse than the best one, seed by seed: the noise that they share falls out.
    """

    at: dict[str, Label]
    runs: int
    metric: MetricMean
    behind: MetricMean


@dataclass(frozen=True)
class Ranking:
    """Settings of a part by their metric, the best one first.

    Args:
        of: the values of the parameters that are given, [best] each.
        settings: those with all runs completed.
        failed: how many settings had a run that was not.
    """

    of: dict[str, Label]
    settings: tuple[Ranked, ...]
    failed: int

    @property
    def alike(self) -> tuple[Ranked, ...]:
        """The best one, and those that do not differ significantly."""
        return tuple(s for i, s in enumerate(self.settings) if i == 0 or not s.behind.excludes_zero)

    def spans(self) -> dict[str, Sequence[Label]]:
        """Of each parameter the values, in order, among the settings that cannot be told from the best one."""
        names = self.settings[0].at if self.settings else {}
        return {name: sorted({s.at[name] for s in self.alike}, key=_order) for name in names}


def rankings(frame: DataFrame, plan: Plan, part: str = MAIN) -> list[Ranking]:
    """The settings of a part by the study's [best]: a ranking for each combination of what is given."""
    best = plan.study.best
    if best is None:
        return []
    sign = 1.0 if best.least else -1.0
    found: dict[tuple[tuple[str, Label], ...], list[tuple[dict[str, Label], dict[int, float] | None]]] = {}
    for at, seeds in _settings(frame, plan, part, best.metric):
        given = {name: at.pop(name) for name in best.each if name in at}
        found.setdefault(tuple(given.items()), []).append((at, seeds))
    return [_ranking(dict(given), settings, sign) for given, settings in found.items()]


def _ranking(
    given: dict[str, Label], settings: Sequence[tuple[dict[str, Label], dict[int, float] | None]], sign: float
) -> Ranking:
    done = [(at, seeds) for at, seeds in settings if seeds]
    done.sort(key=lambda one: sign * sum(one[1].values()) / len(one[1]))
    ranked = tuple(_rank(at, seeds, done[0][1], sign) for at, seeds in done)
    return Ranking(given, ranked, len(settings) - len(done))


def _settings(
    frame: DataFrame, plan: Plan, part: str, metric: str
) -> list[tuple[dict[str, Label], dict[int, float] | None]]:
    """Each setting and its metric by seed; None where a run failed."""
    import polars

    if "part" in frame.columns:
        frame = frame.filter(polars.col("part") == part)
    axes = next(p.axes for p in plan.parts if p.name == part)
    names = [a.name for a in axes if "seed" not in a.targets]
    columns = [polars.col("seed"), polars.col("result"), polars.col(metric).alias("of")]
    grouped = frame.group_by(names, maintain_order=True).agg(*columns) if names else None
    rows = grouped.rows(named=True) if grouped is not None else [_lone(frame, metric)]
    signed = metric_of(metric).signed
    return [({name: row[name] for name in names}, _by_seed(row, signed=signed)) for row in rows]


def _lone(frame: DataFrame, metric: str) -> dict[str, Any]:
    return {
        key: frame[name].to_list() for key, name in (("seed", "seed"), ("result", "result"), ("of", metric))
    }


def _by_seed(row: Mapping[str, Any], *, signed: bool) -> dict[int, float] | None:
    if any(result != DONE for result in row["result"]) or any(value is None for value in row["of"]):
        return None
    values = map(abs, row["of"]) if signed else row["of"]
    return dict(zip(row["seed"], values, strict=True))


def _rank(at: dict[str, Label], seeds: Mapping[int, float], top: Mapping[int, float], sign: float) -> Ranked:
    shared = [sign * (value - top[seed]) for seed, value in seeds.items() if seed in top]
    return Ranked(at, len(seeds), mean(list(seeds.values())), mean(shared))


def mean(values: Sequence[float]) -> MetricMean:
    """The mean of some values with its interval."""
    from scipy.special import stdtrit

    n = len(values)
    if n == 0:
        return MetricMean(math.nan, None)
    half = float(stdtrit(n - 1, 0.5 + LEVEL / 2) * np.std(values, ddof=1) / math.sqrt(n)) if n > 1 else None
    return MetricMean(float(np.mean(values)), half)


def _order(value: Label) -> tuple[int, float, str]:
    return (0, float(value), "") if isinstance(value, int | float) else (1, 0.0, str(value))
