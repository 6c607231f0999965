"""A figure as the panels of a page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.arrays import Array
from palpate.report.figure_panels.artists import (
    Curve,
    Kind,
    Level,
    NotLines,
    Stretch,
    drawn_in,
    kind_of,
    label_of,
    look_of,
    plain,
    title,
    unit,
)
from palpate.report.look.assets import (
    ABSENT,
    CHARTS,
    TABLES,
    data,
    packed_column,
    rows_shown,
    scripts,
    text_of,
)
from palpate.report.page import data_address
from palpate.report.style import svg

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

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
        rows = np.unique(np.concatenate([rows_shown(one.y, MOST // len(same)) for one in same]))
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
        return packed_column(values)
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


def panels_of(drawing: Figure) -> list[dict[str, Any]]:
    """Its panels in order: a chart where it is lines over one axis, else a picture of the panel.

    What the whole figure's legend alone tells comes first, as `{"legend"}`. A chart is `{"spec", "columns"}` of
    `palpate.chart`, and the `group` of those that are zoomed together; a picture is `{"picture", "title", "wide"}`: the
    source of an image that is read by light and by dark, and how wide it is [CSS pixels]. All is plain, and may
    stand in a page as JSON.
    """
    drawing.canvas.draw()  # limits and places are those that are drawn
    axes = [one for one in drawing.axes if one.get_label() != "<colorbar>"]
    names = _names(axes)
    legend = [one for one in _legend(drawing) if one["label"] not in names.values()]
    found: list[dict[str, Any]] = [{"legend": legend}] if legend else []
    for one in axes:
        try:
            found.append(chart_of(one, names) | {"group": _group(one, axes)})
        except NotLines:
            found.append(_picture(drawing, one))
    _name_axes(found)
    return found


def panel_scripts() -> tuple[str, ...]:
    """Script of a page's panels; it reads them as JSON from `#panels`, by the id of their element."""
    return (*scripts(*CHARTS), text_of("panels.js", "palpate.report.figure_panels"))


def shown_in(figures: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Figures for `page.html`, each an image (`source`) or `panels` of `panels_of`, with a caption."""
    drawn = {str(i): one["panels"] for i, one in enumerate(figures, 1) if "panels" in one}
    codes = (*scripts(*TABLES), *panel_scripts()) if drawn else scripts(*TABLES)
    return {"figures": figures, "panels": data(drawn) if drawn else "", "scripts": codes}


def _names(axes: Sequence[Axes]) -> dict[Kind, str]:
    """Names of the kinds of lines that have one name over all panels."""
    lines = [line for one in axes for line in one.lines if label_of(line)]
    found: dict[Kind, set[str]] = {}
    for line in lines:
        found.setdefault(kind_of(line), set()).add(label_of(line))
    return {kind: next(iter(labels)) for kind, labels in found.items() if len(labels) == 1}


def _legend(drawing: Figure) -> list[dict[str, Any]]:
    """Entries of the figure's own legends, as `palpate.chart` has them; those of areas have no line."""
    from matplotlib.lines import Line2D

    entries = [
        (handle, text.get_text())
        for legend in drawing.legends
        for handle, text in zip(legend.legend_handles, legend.get_texts(), strict=True)
    ]
    return [
        {"label": plain(text), **look_of(handle)} for handle, text in entries if isinstance(handle, Line2D)
    ]


def _group(one: Axes, axes: Sequence[Axes]) -> int:
    """Panels over the same stretch of the same axis share their cursor and their zoom."""
    same = [o for o in axes if o.get_xlim() == one.get_xlim() and o.get_xscale() == one.get_xscale()]
    return axes.index(same[0])


def _name_axes(panels: Sequence[dict[str, Any]]) -> None:
    """A panel that has nothing at its x axis takes what stands under those it is zoomed with."""
    specs = [(one["group"], one["spec"]) for one in panels if "spec" in one]
    for group, spec in specs:
        spec["x"] = spec["x"] or next((o["x"] for g, o in specs if g == group and o["x"]), "")
        spec["unit"] = unit(spec["x"]) or " "


def _picture(drawing: Figure, one: Axes) -> dict[str, Any]:
    """A panel alone, with the scales of colours that belong to it."""
    own = {one, *(bar for bar in drawing.axes if _colours(bar) is one)}
    for mesh in (*one.collections, *one.images):
        if type(mesh).__name__ in ("QuadMesh", "QuadContourSet", "AxesImage"):
            mesh.set_rasterized(True)
    others = [other for other in drawing.axes if other not in own]
    hidden: list[Artist] = [one for one in (*others, *drawing.legends) if one.get_visible()]
    for other in hidden:
        other.set_visible(False)
    try:
        data = svg(drawing, tight=True)
    finally:
        for other in hidden:
            other.set_visible(True)
    wide = one.get_tightbbox().width / drawing.dpi * 96  # type: ignore[union-attr]
    return {"picture": data_address(data, "image/svg+xml"), "title": title(one), "wide": round(wide)}


def _colours(bar: Axes) -> Axes | None:
    """The panel to which a scale of colours belongs."""
    if bar.get_label() != "<colorbar>":
        return None
    mesh = getattr(getattr(bar, "_colorbar", None), "mappable", None)
    return getattr(mesh, "axes", None)
