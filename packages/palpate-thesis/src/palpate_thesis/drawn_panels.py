"""Panels of a figure as a page shows them: as charts where they hold lines over one axis, else as pictures."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.arrays import Array
from palpate.report import chart
from palpate.report.chart import COLOURS, Band, Chart, Mark, Series, panels
from palpate.report.page import data_address
from palpate.report.style import svg

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

FEWEST = 12
"""Places from which on a line is worth being zoomed."""
_SIGNS = {r"\eta": "η", r"\mu": "µ", r"\theta": "θ", r"\lambda": "λ", r"\cdot": "·", r"\pm": "±"}
_BELOW = str.maketrans("aehijklmnoprstuvx0123456789", "ₐₑₕᵢⱼₖₗₘₙₒₚᵣₛₜᵤᵥₓ₀₁₂₃₄₅₆₇₈₉")
_NAMES = {code: name for name, code in COLOURS.items()}
_DOTS = {"o": 4.0, ".": 2.8, "s": 4.0, "^": 4.0, "x": 4.0}
"""Marks of matplotlib that a page draws as dots, and their diameters [pt]."""

Kind = tuple[str, str, str]


class NotLines(Exception):
    """The panel holds something that is no line over one axis."""


def panels_of(drawing: Figure) -> list[dict[str, Any]]:
    """Its panels in order: a chart of `report.chart` where it is lines over one axis, else a picture of the panel.

    What the whole figure's legend alone tells comes first, as `{"legend"}`. A picture is `{"picture", "title",
    "wide"}`: the source of an image that is read by light and by dark, and how wide it is [CSS pixels].
    """
    drawing.canvas.draw()  # limits and places are those that are drawn
    axes = [one for one in drawing.axes if one.get_label() != "<colorbar>"]
    names = _names(axes)
    legend = [one for one in _legend(drawing) if one["label"] not in names.values()]
    shown: list[Chart | dict[str, Any]] = []
    for one in axes:
        try:
            shown.append(chart_of(one, names))
        except NotLines:
            shown.append(_picture(drawing, one))
    charts = iter(panels([one for one in shown if isinstance(one, Chart)]))
    found = [next(charts) if isinstance(one, Chart) else one for one in shown]
    return [{"legend": legend}, *found] if legend else found


def chart_of(axes: Axes, names: Mapping[Kind, str]) -> Chart:
    """A panel as a chart.

    Args:
        axes: the panel.
        names: how a line of a kind is called elsewhere in the figure, for those without a label.

    Raises:
        NotLines: the panel is better shown as it stands.
    """
    from matplotlib.collections import PolyCollection
    from matplotlib.patches import Polygon, Rectangle

    _check_scales(axes)
    if axes.images or axes.tables or any(one.get_text() for one in axes.texts):
        raise NotLines
    parts: list[Series | Band | Mark] = [_of_line(axes, line, names) for line in axes.lines]
    for one in (*axes.collections, *axes.patches):
        if not isinstance(one, PolyCollection | Rectangle | Polygon):
            raise NotLines
        parts.append(_of_area(axes, one))
    series = [one for one in parts if isinstance(one, Series)]
    if not any(len(one.x) >= FEWEST and not one.dots for one in series):
        raise NotLines
    drawing = axes.figure.get_figure(root=True)
    assert drawing is not None
    low, high = sorted(axes.get_xlim())
    return Chart(
        plain(axes.get_ylabel()), series,
        [one for one in parts if isinstance(one, Band)], [one for one in parts if isinstance(one, Mark)],
        x=plain(axes.get_xlabel()), title=_title(axes), xlim=(low, high), ylim=axes.get_ylim(),
        log="".join(name for name in "xy" if getattr(axes, f"get_{name}scale")() == "log"),
        height=1.2 * axes.get_position().height * drawing.get_figheight(),
    )  # fmt: skip


def plain(text: str) -> str:
    """A label without its formulas: `$K_e$ [N/m]` is Kₑ [N/m]; a letter that is not written so keeps its underscore."""
    return re.sub(r"\$([^$]*)\$", lambda found: _spell(found[1]), text).replace("\n", " ").strip()


def _spell(formula: str) -> str:
    for sign, letter in _SIGNS.items():
        formula = formula.replace(sign, letter)
    formula = re.sub(r"_\{?(\w)\}?", _lower, formula)
    return re.sub(r"\\[a-z]+|[{}^]", "", formula)


def _lower(found: re.Match[str]) -> str:
    letter = found[1].translate(_BELOW)
    return found[0] if letter == found[1] else letter


def _title(axes: Axes) -> str:
    return plain(axes.get_title(loc="left") or axes.get_title())


def _check_scales(axes: Axes) -> None:
    """Both grow, and have numbers."""
    from matplotlib.ticker import FixedFormatter, FuncFormatter

    for one in (axes.xaxis, axes.yaxis):
        worded = isinstance(one.get_major_formatter(), FixedFormatter | FuncFormatter)
        if worded or one.get_inverted() or one.get_scale() not in ("linear", "log"):
            raise NotLines


def _kind(line: Line2D) -> Kind:
    """The colour, the style and the marks of a line."""
    return _code(line.get_color()), str(line.get_linestyle()), str(line.get_marker())


def _label(one: Artist) -> str:
    """Empty where matplotlib made it up."""
    text = str(one.get_label())
    return "" if text.startswith("_") else plain(text)


def _of_line(axes: Axes, line: Line2D, names: Mapping[Kind, str]) -> Series | Band | Mark:
    x, y = map(_fill, line.get_data(orig=False))
    along, up = _by_data(axes, line)
    own = _series(line, x, y)
    if not len(x):
        return Mark([], own.colour, own.label)
    if not along:
        level = float(y[0])
        return Band(level, level, own.colour, own.label, own.width, own.dash)
    if not up:
        return Mark([(float(x[0]), float(x[0]))], own.colour, own.label)
    known = np.isfinite(x)
    if (np.diff(x[known]) < 0.0).any():
        raise NotLines
    return replace(own, x=x[known], y=y[known], label=own.label or names.get(_kind(line), ""))


def _fill(values: Any) -> Array:
    return np.ma.filled(np.ma.asarray(values, dtype=float), np.nan)


def _series(line: Line2D, x: Array, y: Array) -> Series:
    """A line as it is drawn.

    Raises:
        NotLines: in a colour that is no token, or with marks that a page does not draw.
    """
    style, mark = str(line.get_linestyle()), str(line.get_marker())
    if style == "None" and mark not in _DOTS:
        raise NotLines
    dots = _DOTS.get(mark, 0.0) if style == "None" else 0.0
    return Series(
        x, y, _token(_code(line.get_color())), _label(line),
        width=0.0 if dots else float(line.get_linewidth()),
        dash={"-": "", ":": ":", "None": ""}.get(style, "--"),
        dots=dots, alpha=round(float(line.get_alpha() or 1.0), 3),
    )  # fmt: skip


def _of_area(axes: Axes, area: Any) -> Band | Mark:
    """A band over all of the panel, or stretches of its x axis."""
    along, up = _by_data(axes, area)
    colour = _token(_code(area.get_facecolor()))
    is_patch = not hasattr(area, "get_paths")
    paths = [area.get_path().transformed(area.get_patch_transform())] if is_patch else area.get_paths()
    boxes = [path.get_extents() for path in paths]
    if along and not up:
        return Mark([(float(box.x0), float(box.x1)) for box in boxes], colour, _label(area))
    if up and not along and len(boxes) == 1:
        return Band(float(boxes[0].y0), float(boxes[0].y1), colour, _label(area))
    raise NotLines


def _by_data(axes: Axes, one: Artist) -> tuple[bool, bool]:
    """Whether its x and its y are those of the data, not shares of the panel."""
    along, up = one.get_transform().contains_branch_seperately(axes.transData)
    return bool(along), bool(up)


def _code(colour: Any) -> str:
    from matplotlib.colors import to_hex

    values = np.asarray(colour, dtype=object)
    return to_hex(colour if values.ndim < 2 else colour[0])


def _token(code: str) -> str:
    """Of a colour among the tokens; a figure that uses another cannot be turned to dark."""
    if code not in _NAMES:
        raise NotLines
    return _NAMES[code]


def _names(axes: Sequence[Axes]) -> dict[Kind, str]:
    """Names of the kinds of lines that have one name over all panels."""
    found: dict[Kind, set[str]] = {}
    for line in (line for one in axes for line in one.lines if _label(line)):
        found.setdefault(_kind(line), set()).add(_label(line))
    return {kind: next(iter(labels)) for kind, labels in found.items() if len(labels) == 1}


def _legend(drawing: Figure) -> list[dict[str, Any]]:
    """Entries of the figure's own legends, as `palpate.chart` has them; those of areas have no line."""
    from matplotlib.lines import Line2D

    none = np.empty(0)
    return [
        chart.look(replace(_series(handle, none, none), label=plain(text.get_text())))
        for legend in drawing.legends
        for handle, text in zip(legend.legend_handles, legend.get_texts(), strict=True)
        if isinstance(handle, Line2D)
    ]


def _picture(drawing: Figure, one: Axes) -> dict[str, Any]:
    """A panel alone, with the scales of colours that belong to it."""
    own = {one, *(bar for bar in drawing.axes if _colours(bar) is one)}
    for mesh in (*one.collections, *one.images):
        if type(mesh).__name__ in ("QuadMesh", "QuadContourSet", "AxesImage"):
            mesh.set_rasterized(True)
    hidden: list[Artist] = [
        other for other in (*drawing.axes, *drawing.legends) if other not in own and other.get_visible()
    ]
    for other in hidden:
        other.set_visible(False)
    try:
        data = svg(drawing, tight=True)
    finally:
        for other in hidden:
            other.set_visible(True)
    wide = one.get_tightbbox().width / drawing.dpi * 96  # type: ignore[union-attr]
    return {"picture": data_address(data, "image/svg+xml"), "title": _title(one), "wide": round(wide)}


def _colours(bar: Axes) -> Axes | None:
    """The panel to which a scale of colours belongs."""
    if bar.get_label() != "<colorbar>":
        return None
    mesh = getattr(getattr(bar, "_colorbar", None), "mappable", None)
    return getattr(mesh, "axes", None)
