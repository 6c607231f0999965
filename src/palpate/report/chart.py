"""Charts: lines, levels and marks over one axis; drawn by matplotlib in a figure, and as charts to zoom in a page."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import floor
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.arrays import Array
from palpate.report import style
from palpate.report.look import assets

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLOURS = (
    assets.DATA
    | assets.SERIES
    | {name: assets.PAIRS[name][0] for name in ("ink", "quiet", "grid", "line", "card")}
)
"""Colours of what is drawn, by the tokens that a page turns to dark."""
KNOWN: Mapping[str, Any] = {"colour": "ink", "width": 1.1, "dash": "--"}
"""Look of what is desired, or known to be true."""
MOST = 1200
"""Places of a line that lie in the page, about: two for each point of a screen that a panel is wide."""
_DASHES: Mapping[str, list[int]] = {"": [], "--": [6, 4], ":": [2, 3]}
_PIXELS = 80.0
"""Height of a chart in a page, to an inch of the figure's panel."""
_MARGIN = 0.05
_UNIT = re.compile(r"\[([^\]]+)\]\s*$")


@dataclass(frozen=True)
class Series:
    """A line over x, or dots.

    Args:
        x: its places, in order, shape (n,).
        y: its values; NaN are gaps, shape (n,).
        colour: one of `COLOURS`.
        label: in the legend; empty for none.
        width: of the line [pt]; 0 for none.
        dash: of the line, one of `--`, `:` and none.
        dots: their diameter [pt]; 0 for none.
        alpha: opacity.
    """

    x: Array
    y: Array
    colour: str
    label: str = ""
    width: float = 1.6
    dash: str = ""
    dots: float = 0.0
    alpha: float = 1.0


@dataclass(frozen=True)
class Interval:
    """An interval of y that changes along x: its places in order, and its ends there, each of shape (n,)."""

    x: Array
    low: Array
    high: Array
    colour: str
    label: str = ""


@dataclass(frozen=True)
class Band:
    """An interval of y along the whole chart; a line where both ends are one."""

    low: float
    high: float
    colour: str
    label: str = ""
    width: float = 0.8
    dash: str = ""


@dataclass(frozen=True)
class Mark:
    """Stretches of x, each from its first to its second end; moments where both are one."""

    spans: Sequence[tuple[float, float]]
    colour: str
    label: str = ""


@dataclass(frozen=True)
class Chart:
    """Lines, levels and marks over one axis, and its axes.

    Args:
        y: label of the values.
        series: lines and dots.
        intervals: of values that change along x.
        bands: levels and intervals along the whole chart.
        marks: moments and stretches.
        x: label of the places; one that has none takes that of the charts it is zoomed with.
        title: above it.
        xlim, ylim: ends of the axes; those of the data where None.
        log: which axes are logarithmic: `x`, `y`, `xy` or none.
        height: of the panel [in].
    """

    y: str
    series: Sequence[Series]
    bands: Sequence[Band] = ()
    marks: Sequence[Mark] = ()
    x: str = ""
    title: str = ""
    xlim: tuple[float, float] | None = None
    ylim: tuple[float, float] | None = None
    log: str = ""
    height: float = 2.6
    intervals: Sequence[Interval] = ()

    @property
    def ends(self) -> tuple[float, float]:
        """Ends of the x axis."""
        places = np.concatenate([one.x for one in self.series])
        low, high = self.xlim or (np.min(places), np.max(places))
        return float(low), float(high)

    @property
    def range(self) -> tuple[float, float]:
        """Ends of the y axis: those of the data with a margin, if none are given.

        A page counts the steps of a logarithmic axis from its lower end, which is a number of one digit.
        """
        if self.ylim is not None:
            return self.ylim
        values = [*(one.y for one in self.series), [end for b in self.bands for end in (b.low, b.high)]]
        values += [end for one in self.intervals for end in (one.low, one.high)]
        known = np.concatenate([np.asarray(one, dtype=float) for one in values])
        known = known[np.isfinite(known)]
        known = np.log10(known[known > 0.0]) if "y" in self.log else known
        low, high = (float(known.min()), float(known.max())) if len(known) else (0.0, 1.0)
        room = _MARGIN * (high - low) or 0.5
        if "y" not in self.log:
            return low - room, high + room
        low, power = 10.0 ** (low - room), 10.0 ** floor(low - room)
        return power * floor(low / power), 10.0 ** (high + room)


def figure_of(charts: Sequence[Chart], columns: int = 1) -> Figure:
    """The charts under each other, over one axis where all have the same, or in rows of several."""
    rows, high = -(-len(charts) // columns), charts[0].height
    one_axis = columns == 1 and len({(chart.ends, "x" in chart.log) for chart in charts}) == 1
    with style.ink():
        size = (9.0, high * rows + (0.5 if one_axis else 0.0))
        figure, axes = style.grid(size, rows, columns, sharex=one_axis)
        for axis, chart in zip(axes, charts, strict=False):
            draw(axis, chart)
        for axis in axes[len(charts) :]:
            axis.remove()
        for axis in axes[:-1] if one_axis else ():
            axis.set_xlabel("")
    return figure


def draw(axis: Axes, chart: Chart) -> None:
    """Draw a chart in a panel of a figure."""
    for area in chart.intervals:
        colour, label = COLOURS[area.colour], area.label or None
        axis.fill_between(area.x, area.low, area.high, color=colour, alpha=0.22, linewidth=0, label=label)
    for one in chart.series:
        line: dict[str, Any] = {"linewidth": one.width, "linestyle": _line(one.dash)}
        if one.dots:
            line = {"linestyle": "None", "marker": "o", "markersize": one.dots}
        axis.plot(one.x, one.y, color=COLOURS[one.colour], label=one.label or None, alpha=one.alpha, **line)
    for band in chart.bands:
        level = {"linewidth": band.width, "linestyle": _line(band.dash)}
        _interval((axis.axhline, level), (axis.axhspan, 0.2), (band.low, band.high), band.colour, band.label)
    for mark in chart.marks:
        moment = {"linewidth": 1.1, "linestyle": _line("--")}
        for i, ends in enumerate(mark.spans):
            label = "" if i else mark.label
            _interval((axis.axvline, moment), (axis.axvspan, 0.12), ends, mark.colour, label)
    axis.set(xlabel=style.literal(chart.x), ylabel=style.literal(chart.y))
    axis.set_title(style.literal(chart.title), loc="left")
    axis.set(**{name: ends for name in ("xlim", "ylim") if (ends := getattr(chart, name))})
    if "y" in chart.log:
        axis.set_ylim(*chart.range)
    for which in chart.log:
        style.logarithmic(axis, which)
    if axis.get_legend_handles_labels()[0]:
        style.legend(axis)


def _interval(line: Any, area: Any, ends: tuple[float, float], colour: str, label: str) -> None:
    """A line where both ends are one, else an area."""
    own = {"color": COLOURS[colour], "label": label or None}
    if ends[0] == ends[1]:
        line[0](ends[0], **line[1], **own)
    else:
        area[0](*ends, alpha=area[1], linewidth=0, **own)


def _line(dash: str) -> Any:
    return (0, (5, 4)) if dash == "--" else dash or "-"


def panels(charts: Sequence[Chart], most: int = MOST) -> list[dict[str, Any]]:
    """The charts for a page, in order, as plain values, each with about so many places of a line.

    Each is `{"spec", "columns"}` as `palpate.chart` takes it, and the `group` of those that are zoomed together.
    """
    keys = [(chart.ends, "x" in chart.log) for chart in charts]
    names = [chart.x for chart in charts]
    found = []
    for chart, key in zip(charts, keys, strict=True):
        x = chart.x or next((name for own, name in zip(keys, names, strict=True) if own == key and name), "")
        found.append(_panel(chart, x, most) | {"group": keys.index(key)})
    return found


def _panel(chart: Chart, x: str, most: int) -> dict[str, Any]:
    """A chart, thinned so that peaks stay; what has no name, or another's, is not in its legend."""
    lines = [(one.x, one.y) for one in chart.series]
    lines += [(one.x, end) for one in chart.intervals for end in (one.low, one.high)]
    places, values = _join([_within(*line, *chart.ends) for line in lines], most)
    columns = {"t": _column(places, "x" in chart.log)}
    columns |= {f"c{i}": _column(column, "y" in chart.log) for i, column in enumerate(values)}
    series = [look(one) | {"of": f"c{i}"} for i, one in enumerate(chart.series)]
    for i, one in enumerate(chart.intervals):
        k = len(chart.series) + 2 * i
        series.append(_area(one) | {"low": f"c{k}", "high": f"c{k + 1}"})
    for band in chart.bands:
        is_line = band.low == band.high
        ends = {"of": band.low} if is_line else {"low": band.low, "high": band.high}
        own = look(band) if is_line else _area(band)
        series.append(own | {key: f"{key}{len(series)}" for key in ends})
        columns |= {series[-1][key]: assets.packed_column(np.full(len(places), v)) for key, v in ends.items()}
    labels = [one["label"] for one in series]
    for i, (label, line) in enumerate(zip(labels, series, strict=True)):
        line["silent"] = not label or label in labels[:i]
    if not any(labels):
        series[0] |= {"label": chart.y.split(" [")[0], "silent": False}
    spans = [(one.colour, float(low), float(high)) for one in chart.marks for low, high in one.spans]
    unit = _UNIT.search(x)
    spec = {
        "title": chart.title, "y": chart.y, "x": x, "unit": unit[1] if unit else " ", "log": chart.log,
        "height": round(min(300.0, max(150.0, _PIXELS * chart.height))), "range": [float(end) for end in chart.range],
        "series": series,
        "marks": [{"x": low, "colour": colour} for colour, low, high in spans if low == high],
        "shades": [[low, high, colour] for colour, low, high in spans if low < high],
        "keys": [
            {"label": one.label, "colour": one.colour, "kind": _key(one)}
            for one in chart.marks if one.label and one.spans
        ],
    }  # fmt: skip
    return {"spec": spec, "columns": columns}


def _area(one: Interval | Band) -> dict[str, Any]:
    return {"kind": "band", "colour": one.colour, "label": one.label}


def look(one: Series | Band) -> dict[str, Any]:
    """How a page draws a line, and its entry in a legend."""
    return {
        "label": one.label,
        "colour": one.colour,
        "width": round(1.1 * one.width, 2),
        "dash": _DASHES[one.dash],
        "alpha": getattr(one, "alpha", 1.0),
        "dots": 1.25 * getattr(one, "dots", 0.0),
    }


def _key(one: Mark) -> str:
    return "band" if any(low < high for low, high in one.spans) else "known"


def _within(x: Array, y: Array, low: float, high: float) -> tuple[Array, Array]:
    inside = (x >= low) & (x <= high)
    return x[inside], y[inside]


def _join(lines: Sequence[tuple[Array, Array]], most: int) -> tuple[Array, list[Array]]:
    """All places of thinned lines in order, and each line's values there: infinite where it has no place."""
    alike = [next(i for i, (other, _) in enumerate(lines) if np.array_equal(other, x)) for x, _ in lines]
    thin = {}
    for first in dict.fromkeys(alike):
        same = [y for i, (_, y) in zip(alike, lines, strict=True) if i == first]
        thin[first] = np.unique(np.concatenate([style.rows_shown(y, most // len(same)) for y in same]))
    shown = [(x[thin[i]], y[thin[i]]) for i, (x, y) in zip(alike, lines, strict=True)]
    places = np.unique(np.concatenate([x for x, _ in shown]))
    columns = [np.full(len(places), np.inf) for _ in shown]
    for column, (x, y) in zip(columns, shown, strict=True):
        column[np.searchsorted(places, x)] = y
    return places, columns


def _column(values: Array, powers: bool) -> Any:
    """Packed; on a scale of powers as they are, for there the smallest count as much as the largest."""
    if not powers:
        return assets.packed_column(values)
    known = [None if not v > 0.0 else float(f"{v:.5g}") for v in values.tolist()]
    return [assets.ABSENT if np.isinf(v) else k for v, k in zip(values, known, strict=True)]


def panel_scripts() -> tuple[str, ...]:
    """Scripts of a page's panels, which are read as JSON from `#panels`, by the id of their element."""
    return assets.scripts(*assets.CHARTS, "panels.js")


def page_figures(figures: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Figures for `page.html`, each an image (`source`) or `panels`, with a caption; and the scripts that they need."""
    drawn = {str(i): one["panels"] for i, one in enumerate(figures, 1) if "panels" in one}
    codes = (*assets.scripts(*assets.TABLES), *panel_scripts()) if drawn else assets.scripts(*assets.TABLES)
    return {"figures": figures, "panels": assets.data(drawn) if drawn else "", "scripts": codes}
