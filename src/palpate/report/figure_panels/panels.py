"""A figure as the panels of a page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from palpate.report.figure_panels.artists import Kind, NotLines, kind_of, label_of, look_of
from palpate.report.figure_panels.labels import plain, title, unit
from palpate.report.figure_panels.lines import chart_of
from palpate.report.look.assets import CHARTS, TABLES, data, scripts, text_of
from palpate.report.page import embedded
from palpate.report.svg import svg

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


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
    return {"picture": embedded(data, "image/svg+xml"), "title": title(one), "wide": round(wide)}


def _colours(bar: Axes) -> Axes | None:
    """The panel to which a scale of colours belongs."""
    if bar.get_label() != "<colorbar>":
        return None
    mesh = getattr(getattr(bar, "_colorbar", None), "mappable", None)
    return getattr(mesh, "axes", None)
