"""The figures of a study."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from palpate.bench.metrics import metric_of
from palpate.report import style
from palpate.report.study.axes import Scale
from palpate.studies.figures.curves import curves_of
from palpate.studies.figures.maps import map_of
from palpate.studies.figures.rows import FEW, Drawn, Rows
from palpate.studies.figures.scatter import clouds_of
from palpate.studies.plan import Plan
from palpate.studies.tables import Curves, Map

if TYPE_CHECKING:
    from polars import DataFrame


def draw(frame: DataFrame, plan: Plan, folder: Path) -> dict[Path, str]:
    """Draws all figures of a study into its folder: file and caption of each."""
    found = {}
    for one in figures(frame, plan):
        found[style.save(one.draw(), folder / f"{one.name}.png")] = one.caption
    return found


def figures(frame: DataFrame, plan: Plan) -> Iterator[Drawn]:
    """The figures that a study asks for; where it asks for none, those that its parameters lend themselves to."""
    own = Rows(frame, plan)
    drawn = any(a.drawn for a in plan.parts[0].axes)
    if drawn:
        for name in [plan.study.best.metric] if plan.study.best else plan.study.metrics:
            yield clouds_of(own, metric_of(name))
    maps, curves = plan.study.maps, plan.study.curves
    if not maps and not curves and not drawn:
        maps, curves = _suggested(plan)
    yield from (map_of(own, asked, number) for number, asked in enumerate(maps, 1))
    yield from (curves_of(own, asked, number) for number, asked in enumerate(curves, 1))


def _suggested(plan: Plan) -> tuple[list[Map], list[Curves]]:
    free = [a for a in plan.parts[0].grid if "seed" not in a.targets]
    by_size = sorted(free, key=lambda a: -len(a.settings) if Scale("", a.labels()).numeric else 0)
    axes = [a.name for a in by_size]
    metrics = [plan.study.best.metric] if plan.study.best else plan.study.metrics
    maps = [Map(axes[0], axes[1], name) for name in metrics] if len(axes) > 1 else []
    second = next((a.name for a in by_size[1:] if len(a.settings) <= FEW), "")
    curves = [Curves(axes[0], name, second) for name in metrics if not metric_of(name).words] if axes else []
    return maps, curves
