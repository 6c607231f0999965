"""A study's rows, as its figures ask for them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.arrays import Array
from palpate.bench.metrics import Metric
from palpate.errors import unknown
from palpate.report.study.axes import Scale
from palpate.studies.definition.parameters import Axis, label
from palpate.studies.definition.plan import MAIN, Plan
from palpate.studies.definition.study import flat
from palpate.studies.definition.tables import Curves, Map

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from polars import DataFrame

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
        """The figure."""
        return self.figure(self.panels(), with_unit(self.metric))


class Rows:
    """A study's rows, as figures ask for them."""

    def __init__(self, frame: DataFrame, plan: Plan):
        self.frame, self.plan = frame, plan

    def part(self, name: str = MAIN) -> DataFrame:
        """The rows of the study's own part, or of one that it is compared with."""
        import polars

        return self.frame.filter(polars.col("part") == name) if "part" in self.frame.columns else self.frame

    def axis(self, name: str, part: str = MAIN) -> Axis:
        """A parameter."""
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
