"""Charts: lines, levels and marks over one axis; drawn by matplotlib in a figure, and as charts to zoom in a page."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import floor, isinf, isnan, log10
from textwrap import wrap
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
"""Colours of lines and areas by the names of a page's custom properties."""
KNOWN: Mapping[str, Any] = {"colour": "ink", "width": 1.1, "dash": "--"}
"""Look of a desired or true value."""
MAX_POINTS = 1200
"""Approximate points of a line in a page: two for each pixel of a panel's width."""
_DASHES: Mapping[str, list[int]] = {"": [], "--": [6, 4], ":": [2, 3]}
_LINES: Mapping[str, Any] = {"": "-", "--": (0, (5, 4)), ":": ":"}
"""Kinds of lines in a page, and in a figure."""
_PIXELS_PER_INCH = 80.0
"""Height of a chart in a page [pixels] for each inch of the figure's panel."""
_MARGIN = 0.05
_WIDTH, _WIDTH_WITH_HEAD = 9.0, 13.0
"""Width of a figure [in]."""
_HEAD_LETTERS, _HEAD_LINE = 150, 0.2
"""Letters of a line of the head, and its height [in]."""
ABSENT = "absent"
"""Value in a page's column at an x where its line has no point; the line goes on."""
_DIGITS = 5
"""Significant digits of a column, relative to its range."""
_UNIT = re.compile(r"\[([^\]]+)\]\s*$")


@dataclass(frozen=True)
class Series:
    """A line over x, or dots.

    Args:
        x: coordinates in order, shape (n,).
        y: values; NaN are gaps, shape (n,).
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
    """An interval of y that changes along x: x in order, and both ends, each of shape (n,)."""

    x: Array
    low: Array
    high: Array
    colour: str
    label: str = ""


@dataclass(frozen=True)
class Band:
    """An interval of y along the whole chart; a line if both ends are equal."""

    low: float
    high: float
    colour: str
    label: str = ""
    width: float = 0.8
    dash: str = ""


@dataclass(frozen=True)
class Mark:
    """Intervals of x, each from its first to its second end; moments if both are equal."""

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
        places = np.concatenate([series.x for series in self.series])
        low, high = self.xlim or (np.min(places), np.max(places))
        return float(low), float(high)

    @property
    def range(self) -> tuple[float, float]:
        """Ends of the y axis: those of the data with a margin, if none are given.

        A page counts the steps of a logarithmic axis from its lower end, which is a number of one digit.
        """
        if self.ylim is not None:
            return self.ylim
        values = np.concatenate(
            [
                *(series.y for series in self.series),
                *(end for interval in self.intervals for end in (interval.low, interval.high)),
                [end for band in self.bands for end in (band.low, band.high)],
            ]
        )
        values = values[np.isfinite(values)]
        values = np.log10(values[values > 0.0]) if "y" in self.log else values
        low, high = (float(values.min()), float(values.max())) if len(values) else (0.0, 1.0)
        room = _MARGIN * (high - low) or 0.5
        if "y" not in self.log:
            return low - room, high + room
        low, power = 10.0 ** (low - room), 10.0 ** floor(low - room)
        return power * floor(low / power), 10.0 ** (high + room)

    @property
    def axis_key(self) -> tuple[Any, ...]:
        """Ends and kind of the x axis, equal for charts that are zoomed together."""
        return self.ends, "x" in self.log


def build_figure(charts: Sequence[Chart], columns: int = 1, head: Sequence[str] = ()) -> Figure:
    """Draw charts below each other, over one axis if all have the same, or in rows of several.

    Args:
        charts: in the order to be read.
        columns: charts in a row.
        head: lines of text above all charts, the longest wrapped.
    """
    rows, high = -(-len(charts) // columns), charts[0].height
    one_axis = columns == 1 and len({chart.axis_key for chart in charts}) == 1
    lines = [part for line in head if line for part in wrap(style.literal(line), _HEAD_LETTERS)]
    wide = _WIDTH if columns == 1 or not head else _WIDTH_WITH_HEAD
    with style.ink():
        size = (wide, high * rows + (0.5 if one_axis else 0.0) + _HEAD_LINE * len(lines))
        figure, axes = style.grid(size, rows, columns, sharex=one_axis)
        if lines:
            figure.suptitle("\n".join(lines), x=0.01, ha="left", fontsize=10.5)
        for axis, chart in zip(axes, charts, strict=False):
            draw(axis, chart)
        for axis in axes[len(charts) :]:
            axis.remove()
        for axis in axes[:-1] if one_axis else ():
            axis.set_xlabel("")
    return figure


def draw(axis: Axes, chart: Chart) -> None:
    """Draw a chart in a panel of a figure."""
    for interval in chart.intervals:
        axis.fill_between(
            interval.x, interval.low, interval.high, alpha=0.22, linewidth=0, **_look_in_figure(interval)
        )
    for series in chart.series:
        line: dict[str, Any] = {"linewidth": series.width, "linestyle": _LINES[series.dash]}
        if series.dots:
            line = {"linestyle": "None", "marker": "o", "markersize": series.dots}
        axis.plot(series.x, series.y, alpha=series.alpha, **line, **_look_in_figure(series))
    for band in chart.bands:
        line = {"linewidth": band.width, "linestyle": _LINES[band.dash]}
        _span((axis.axhline, line), (axis.axhspan, 0.2), (band.low, band.high), _look_in_figure(band))
    moment = {"linewidth": 1.1, "linestyle": _LINES["--"]}
    for mark in chart.marks:
        for i, ends in enumerate(mark.spans):
            look = _look_in_figure(mark) | ({"label": None} if i else {})
            _span((axis.axvline, moment), (axis.axvspan, 0.12), ends, look)
    axis.set(xlabel=style.literal(chart.x), ylabel=style.literal(chart.y))
    axis.set_title(style.literal(chart.title), loc="left")
    axis.set(**{name: ends for name in ("xlim", "ylim") if (ends := getattr(chart, name))})
    if "y" in chart.log:
        axis.set_ylim(*chart.range)
    for which in chart.log:
        style.logarithmic(axis, which)
    if axis.get_legend_handles_labels()[0]:
        style.legend(axis)


def _span(line: Any, area: Any, ends: tuple[float, float], look: dict[str, Any]) -> None:
    """Draw a line if both ends are equal, else an area."""
    if ends[0] == ends[1]:
        line[0](ends[0], **line[1], **look)
    else:
        area[0](*ends, alpha=area[1], linewidth=0, **look)


def _look_in_figure(part: Series | Interval | Band | Mark) -> dict[str, Any]:
    return {"color": COLOURS[part.colour], "label": part.label or None}


def panels(charts: Sequence[Chart], max_points: int = MAX_POINTS) -> list[dict[str, Any]]:
    """Charts for a page as plain values, in order, each line with about `max_points` points.

    Each is `{"spec", "columns"}` as `palpate.chart` takes it, and the `group` of those that are zoomed together.
    """
    keys = [chart.axis_key for chart in charts]
    names = {chart.axis_key: chart.x for chart in reversed(charts) if chart.x}
    return [
        _panel(chart, chart.x or names.get(key, ""), max_points) | {"group": keys.index(key)}
        for chart, key in zip(charts, keys, strict=True)
    ]


def _panel(chart: Chart, x: str, max_points: int) -> dict[str, Any]:
    """A chart, thinned so that peaks stay. A legend has each label once."""
    columns, series = _lines(chart, max_points)
    known: set[str] = set()
    for line in series:
        line["silent"] = not line["label"] or line["label"] in known
        known.add(line["label"])
    if not any(known):
        series[0] |= {"label": chart.y.split(" [")[0], "silent": False}
    spans = [(mark.colour, float(low), float(high)) for mark in chart.marks for low, high in mark.spans]
    unit = _UNIT.search(x)
    spec = {
        "title": chart.title,
        "y": chart.y,
        "x": x,
        "unit": unit[1] if unit else " ",
        "log": chart.log,
        "height": round(min(300.0, max(150.0, _PIXELS_PER_INCH * chart.height))),
        "range": [float(end) for end in chart.range],
        "series": series,
        "marks": [{"x": low, "colour": colour} for colour, low, high in spans if low == high],
        "shades": [[low, high, colour] for colour, low, high in spans if low < high],
        "keys": [
            {"label": mark.label, "colour": mark.colour, "kind": _kind(mark)}
            for mark in chart.marks
            if mark.label and mark.spans
        ],
    }
    return {"spec": spec, "columns": columns}


def _lines(chart: Chart, max_points: int) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """The columns of a panel by name, and its lines, intervals and bands, which name their columns."""
    lines = [(part.x, part.y) for part in chart.series]
    lines += [(part.x, end) for part in chart.intervals for end in (part.low, part.high)]
    places, values = _join([_within(*line, *chart.ends) for line in lines], max_points)
    columns = {"t": _column(places, "x" in chart.log)}
    columns |= {f"c{i}": _column(column, "y" in chart.log) for i, column in enumerate(values)}
    series = [look(part) | {"of": f"c{i}"} for i, part in enumerate(chart.series)]
    for i, interval in enumerate(chart.intervals):
        k = len(chart.series) + 2 * i
        series.append(_area(interval) | {"low": f"c{k}", "high": f"c{k + 1}"})
    for band in chart.bands:
        is_line = band.low == band.high
        levels = {"of": band.low} if is_line else {"low": band.low, "high": band.high}
        names = {key: f"{key}{len(series)}" for key in levels}
        columns |= {names[key]: [float(v)] * len(places) for key, v in levels.items()}
        series.append((look(band) if is_line else _area(band)) | names)
    return columns, series


def _area(part: Interval | Band) -> dict[str, Any]:
    return {"kind": "band", "colour": part.colour, "label": part.label}


def look(part: Series | Band) -> dict[str, Any]:
    """Look of a line and of its entry in the legend of a page."""
    return {
        "label": part.label,
        "colour": part.colour,
        "width": round(1.1 * part.width, 2),
        "dash": _DASHES[part.dash],
        "alpha": getattr(part, "alpha", 1.0),
        "dots": 1.25 * getattr(part, "dots", 0.0),
    }


def _kind(mark: Mark) -> str:
    return "band" if any(low < high for low, high in mark.spans) else "known"


def _within(x: Array, y: Array, low: float, high: float) -> tuple[Array, Array]:
    inside = (x >= low) & (x <= high)
    return x[inside], y[inside]


def _join(lines: Sequence[tuple[Array, Array]], max_points: int) -> tuple[Array, list[Array]]:
    """All x of thinned lines in order, and each line's values there: infinite where it has no point.

    Lines over the same places are thinned together, so that all keep their peaks.
    """
    first = [next(i for i, (other, _) in enumerate(lines) if np.array_equal(other, x)) for x, _ in lines]
    rows = {}
    for i in dict.fromkeys(first):
        together = [y for k, (_, y) in zip(first, lines, strict=True) if k == i]
        rows[i] = np.unique(
            np.concatenate([style.rows_shown(y, max_points // len(together)) for y in together])
        )
    thinned = [(x[rows[i]], y[rows[i]]) for i, (x, y) in zip(first, lines, strict=True)]
    places = np.unique(np.concatenate([x for x, _ in thinned]))
    columns = [np.full(len(places), np.inf) for _ in thinned]
    for column, (x, y) in zip(columns, thinned, strict=True):
        column[np.searchsorted(places, x)] = y
    return places, columns


def _column(values: Array, logarithmic: bool) -> list[Any]:
    """Values for JSON, finer than a screen: None is a gap, `ABSENT` a place that the line does not have."""
    finite = values[np.isfinite(values)]
    spread = float(np.ptp(finite)) if len(finite) else 0.0
    digits = _DIGITS - floor(log10(spread)) if spread else _DIGITS
    column: list[Any] = []
    for value, rounded in zip(values.tolist(), np.round(values, digits).tolist(), strict=True):
        if isinf(value):
            column.append(ABSENT)
        elif isnan(value) or (logarithmic and value <= 0.0):
            column.append(None)
        else:  # on a logarithmic axis the smallest count as much as the largest
            column.append(float(f"{value:.5g}") if logarithmic else rounded)
    return column
