"""A panel of matplotlib that holds lines over one axis, as `palpate.chart` draws it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.arrays import Array
from palpate.report.figure_panels.artists import Curve, Kind, Level, NotLines, Stretch, drawn_in
from palpate.report.figure_panels.labels import plain, title
from palpate.report.look.columns import ABSENT, packed, thinned

if TYPE_CHECKING:
    from matplotlib.axes import Axes


MOST = 1200
"""Places of a line that lie in the page, about: two for each point of a screen that a panel is wide."""
FEWEST = 12
"""Places from which on a line is worth being zoomed."""
_POINTS = 96 / 72
"""Of a page, to one of a figure."""


def chart_of(axes: Axes, names: Mapping[Kind, str]) -> dict[str, Any]:
    """A panel as `{"spec": ..., "columns": ...}`, thinned so that peaks stay.

    Args:
        axes: the panel.
        names: how a line of a kind is called elsewhere in the figure, for those without a label.

    Raises:
        NotLines: the panel is better shown as it stands.
    """
    _check_scales(axes)
    low, high = sorted(axes.get_xlim())
    drawn = drawn_in(axes)
    curves = [_within(one, low, high) for one in drawn if isinstance(one, Curve)]
    if not any(len(one.x) >= FEWEST and one.connected for one in curves):
        raise NotLines
    x, values = _join(curves)
    columns = {"t": _column(x, axes.get_xscale())}
    series: list[dict[str, Any]] = []
    for one, column in zip(curves, values, strict=True):
        series.append(one.look | {"label": one.label or names.get(one.kind, ""), "of": f"c{len(series)}"})
        columns[series[-1]["of"]] = _column(column, axes.get_yscale())
    for level in (one for one in drawn if isinstance(one, Level)):
        _add_level(level, series, columns, x)
    _silence(series, axes)
    spec = _spec(axes, series, [one for one in drawn if isinstance(one, Stretch)])
    return {"spec": spec, "columns": columns}


def _check_scales(axes: Axes) -> None:
    """Both grow, and have numbers."""
    from matplotlib.ticker import FixedFormatter, FuncFormatter

    scales = {axes.get_xscale(), axes.get_yscale()} <= {"linear", "log"}
    worded = any(
        isinstance(one.get_major_formatter(), FixedFormatter | FuncFormatter)
        for one in (axes.xaxis, axes.yaxis)
    )
    if not scales or worded or axes.xaxis_inverted() or axes.yaxis_inverted():
        raise NotLines


def _within(one: Curve, low: float, high: float) -> Curve:
    inside = (one.x >= low) & (one.x <= high)
    return Curve(one.x[inside], one.y[inside], one.label, one.kind, one.look)


def _join(curves: Sequence[Curve]) -> tuple[Array, list[Array]]:
    """All places of thinned curves in order, and each curve's values there: infinite where it has no place."""
    thin = []
    for same in _alike(curves):
        rows = np.unique(np.concatenate([thinned(one.y, MOST // len(same)) for one in same]))
        thin += [(one, one.x[rows], one.y[rows]) for one in same]
    x = np.unique(np.concatenate([places for _, places, _ in thin]))
    by_curve = {}
    for one, places, values in thin:
        by_curve[id(one)] = column = np.full(len(x), np.inf)
        column[np.searchsorted(x, places)] = values
    return x, [by_curve[id(one)] for one in curves]


def _alike(curves: Sequence[Curve]) -> list[list[Curve]]:
    """Curves by their places."""
    found: list[list[Curve]] = []
    for one in curves:
        same = next((group for group in found if np.array_equal(group[0].x, one.x)), None)
        if same is None:
            found.append([one])
        else:
            same.append(one)
    return found


def _column(values: Array, scale: str) -> Any:
    """Packed; on a scale of powers as they are, for there the smallest count as much as the largest."""
    if scale == "linear":
        return packed(values)
    known = [None if not v > 0.0 else float(f"{v:.5g}") for v in values.tolist()]
    return [ABSENT if np.isinf(v) else k for v, k in zip(values, known, strict=True)]


def _add_level(one: Level, series: list[dict[str, Any]], columns: dict[str, Any], x: Array) -> None:
    own: dict[str, Any] = {"label": one.label}
    for key, value in (("of", one.low),) if one.low == one.high else (("low", one.low), ("high", one.high)):
        own[key] = f"{key}{len(series)}"
        columns[own[key]] = [value] * len(x)
    series.append(one.look | own)


def _silence(series: list[dict[str, Any]], axes: Axes) -> None:
    """Hide lines without a name, or with another's, from the legend; the axis names a single unnamed line."""
    told: set[str] = set()
    for one in series:
        one["silent"] = not one["label"] or one["label"] in told
        told.add(one["label"])
    if told == {""}:
        series[0] |= {"label": plain(axes.get_ylabel()).split(" [")[0], "silent": False}


def _spec(axes: Axes, series: list[dict[str, Any]], stretches: Sequence[Stretch]) -> dict[str, Any]:
    drawing = axes.figure.get_figure(root=True)
    assert drawing is not None
    high = axes.get_position().height * drawing.get_figheight() * 72 * _POINTS
    log = "".join(
        name for name, scale in (("x", axes.get_xscale()), ("y", axes.get_yscale())) if scale == "log"
    )
    spans = [(one, span) for one in stretches for span in one.spans]
    return {
        "title": title(axes),
        "y": plain(axes.get_ylabel()),
        "x": plain(axes.get_xlabel()),
        "height": round(min(300.0, max(150.0, high))),
        "range": [float(v) for v in axes.get_ylim()],
        "log": log,
        "series": series,
        "marks": [{"x": low, "colour": one.colour} for one, (low, high) in spans if low == high],
        "shades": [[low, high, one.colour] for one, (low, high) in spans if low < high],
        "keys": [
            {"label": s.label, "colour": s.colour, "kind": _key(s)} for s in stretches if s.label and s.spans
        ],
    }


def _key(one: Stretch) -> str:
    return "band" if any(low < high for low, high in one.spans) else "known"
