"""The figures of a study."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from palpate.bench.metrics import metric_of
from palpate.report import style
from palpate.report.study.axes import Scale
from palpate.studies.definition.plan import Plan
from palpate.studies.definition.tables import Curves, Map
from palpate.studies.findings.figures.curves import curves_of
from palpate.studies.findings.figures.maps import map_of
from palpate.studies.findings.figures.rows import FEW, Drawn, Rows
from palpate.studies.findings.figures.scatter import clouds_of

if TYPE_CHECKING:
    from polars import DataFrame


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
        with style.inked():
            figure = one.draw()
            for ending in dict.fromkeys((*endings, ".png")):
                made[style.save(figure, folder / f"{one.name}{ending}", dpi)] = one.caption
    return {path: caption for path, caption in made.items() if path.suffix == ".png"}


def figures(frame: DataFrame, plan: Plan) -> Iterator[Drawn]:
    """The figures that a study asks for; of each metric that it asks none of, those that its parameters suit."""
    own = Rows(frame, plan)
    maps, curves = list(plan.study.maps), list(plan.study.curves)
    asked = {one.metric for one in maps} | {one.metric for one in curves}
    left = [name for name in plan.study.metrics if name not in asked]
    if any(a.drawn for a in plan.parts[0].axes):
        yield from (clouds_of(own, metric_of(name)) for name in left)
    else:
        more_maps, more_curves = _suggested(plan, left, maps=not plan.study.maps)
        maps, curves = maps + more_maps, curves + more_curves
    yield from (map_of(own, asked, number) for number, asked in enumerate(maps, 1))
    yield from (curves_of(own, asked, number) for number, asked in enumerate(curves, 1))


def _suggested(plan: Plan, metrics: Sequence[str], *, maps: bool) -> tuple[list[Map], list[Curves]]:
    """A map of each metric over the two longest parameters, or curves over the longest."""
    free = [a for a in plan.parts[0].grid if "seed" not in a.targets]
    by_size = sorted(free, key=lambda a: -len(a.settings) if Scale("", a.labels()).numeric else 0)
    axes = [a.name for a in by_size]
    worded = [name for name in metrics if metric_of(name).words]
    found = [Map(axes[0], axes[1], name) for name in (metrics if maps else worded)] if len(axes) > 1 else []
    second = next((a.name for a in by_size[1:] if len(a.settings) <= FEW), "")
    curves = [Curves(axes[0], name, second) for name in metrics if not metric_of(name).words] if axes else []
    return found, curves
