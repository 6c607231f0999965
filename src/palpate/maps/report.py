"""A stiffness map in a sentence, as tables, and as a page with the map, its interval, a cut and the next presses."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.arrays import Array
from palpate.maps.result import Lump, MapResult
from palpate.report import style
from palpate.report.chart import KNOWN, Band, Chart, Series, panels
from palpate.report.page import (
    Answer,
    Card,
    Table,
    answer_page,
    data_address,
    warning_alerts,
)
from palpate.report.style import svg
from palpate.units import plain, quantity, quantity_between

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.colorbar import Colorbar
    from matplotlib.colors import ListedColormap
    from matplotlib.figure import Figure

SHADES = {"Blues": (0.3, 0.75), "Greys": (0.3, 0.65)}
"""Fraction of matplotlib's scales of colours between which a map's are."""


def sentence(result: MapResult) -> str:
    """The answer: lumps if a threshold was asked, else the softest and the stiffest place; then what is next."""
    prediction = result.prediction
    inside = result.grid.inside
    threshold = result.request.stiffer_than
    if threshold is None:
        low, high = (float(f(prediction.stiffness[inside])) for f in (np.min, np.max))
        top = int(np.argmax(np.where(inside, prediction.stiffness, 0.0)))
        return (
            f"The stiffness is from {_stiffness(low)} to {_stiffness(high)}, "
            f"stiffest at {place(result.grid.places[top])}."
        )
    sure = [lump for lump in result.lumps if lump.is_sure]
    than = quantity(threshold, "N/m")
    alone = [lump for lump in result.lumps if lump.unless]
    unsure = len(result.lumps) - len(sure) - len(alone)
    either = "".join(
        f" At {place(lump.place)} is a lump of {_stiffness(lump.stiffness)}, or {lump.unless} is an outlier: "
        "press there again."
        for lump in alone[:3]
    )
    if not sure:
        maybe = f"; {unsure} {'place' if unsure == 1 else 'places'} may be" if unsure else ""
        return f"Nothing is surely stiffer than {than}{maybe}.{either}"
    listed = ", ".join(f"{_stiffness(lump.stiffness)} at {place(lump.place)}" for lump in sure[:3])
    count = "One lump is" if len(sure) == 1 else f"{len(sure)} lumps are"
    return f"{count} stiffer than {than}: {listed}{', ...' if len(sure) > 3 else ''}.{either}"


def _stiffness(value: float) -> str:
    """Three digits: no map is better known."""
    return quantity(float(f"{value:.3g}"), "N/m")


def place(where: Any) -> str:
    """A place in millimetres."""
    return f"({', '.join(plain(1e3 * c, 3) for c in where)}) mm"


def warnings(result: MapResult) -> list[str]:
    """Faults of the presses."""
    lines = []
    if result.presses.refused:
        name, why = next(iter(result.presses.refused.items()))
        lines.append(f"{len(result.presses.refused)} logs give no press; {name}: {why}")
    alone = {lump.unless for lump in result.lumps}
    names = (result.presses.names[i] for i in result.map.disagreeing())
    if wrong := [name for name in names if name not in alone]:
        lines.append(
            f"outliers, or places of their own: neighbours contradict {', '.join(wrong[:5])}; press there again"
        )
    unequal = len(np.unique(result.map.places, axis=0)) == len(result.map)
    if unequal and result.repeat > np.median(result.map.half / result.map.stiffness):
        lines.append(
            f"no place was pressed twice: roughness finer than the presses' spacing counts as their scatter, "
            f"± {_short(100.0 * result.repeat)} %, and not as the surface's; press a few places again to part them"
        )
    return lines


def further(result: MapResult) -> tuple[str, str] | None:
    """The number of further presses that bring the interval under the requested half-width, and a sentence."""
    half = result.request.half
    if half is None:
        return None
    more = result.map.presses_until(half)
    width = f"± {plain(100 * half, 2)} % on 95 % of the surface"
    if more is None:
        return "none", f"no number to 1000 brings {width}: it needs more, or their common error is larger"
    return str(more), f"more presses bring {width}"


def tables(result: MapResult) -> list[Table]:
    """Lumps, and the next presses."""
    parts = []
    if result.lumps:
        rows = [
            (
                place(at.place),
                quantity_between(*at.ci95, "N/m"),
                _area(at),
                "yes" if at.is_sure else f"unless {at.unless} is an outlier" if at.unless else "perhaps",
            )
            for at in result.lumps
        ]
        parts.append(Table("", ("lump", "stiffness, 95 %", "area, 95 %", "surely stiffer"), rows))
    if result.request.next:
        parts.append(Table("", ("next press", "now, 95 %", "then, 95 %"), next_rows(result)))
    return parts


def build_answer(result: MapResult) -> Answer:
    """The answer of `palpate map`."""
    advice = further(result)
    text = sentence(result) + (f" {' '.join(advice)}." if advice else "")
    title = f"{len(result.map)} presses"
    return Answer(result.to_json(), title, sentence=text, tables=tables(result), notes=warnings(result))


def next_rows(result: MapResult) -> list[tuple[str, str, str]]:
    """Each next press: its place, the interval now and what it becomes."""
    count = result.request.next
    now = result.map.predict(result.next.places)
    then = (f"± {quantity(float(half), 'N/m')}" for half in result.next.expected_half)
    ends = (quantity_between(float(low), float(high), "N/m") for low, high in now.ci95)
    return list(zip(map(place, result.next.places), ends, then, strict=True))[:count]


def page(result: MapResult, title: str, command: str, *, live: bool = False) -> str:
    """The page as HTML; a live one loads itself again."""
    goal = "the interval everywhere"
    if result.request.stiffer_than is not None:
        goal = "the edge, and lumps not yet found"
    interval = f"Half-width of the 95 % interval. Numbers: where to press next, for {goal}."
    pictures = [(draw_map(result), _map_caption(result)), (draw_interval(result), interval)]
    answer = Answer(
        title=title,
        sentence=sentence(result),
        about=f"{len(result.map)} presses, {len(result.presses.refused)} refused. Interpolated by a Gaussian process "
        "on the logarithm of the stiffness; outside the presses nothing is said.",
        alerts=warning_alerts(warnings(result)),
        cards=_cards(result),
        pairs=[
            {"source": data_address(svg(figure), "image/svg+xml"), "caption": caption}
            for figure, caption in pictures
        ],
        figures=[
            {
                "panels": panels([cut_chart(result)]),
                "caption": "The dashed line of the map, from left to right.",
            }
        ],
        folds=[
            ("Next presses", "place, now, then", [("place", "now, 95 %", "then, 95 %"), *next_rows(result)]),
            ("All presses", f"{len(result.map)}: place, stiffness, interval", _press_rows(result)),
        ],
    )
    return answer_page(answer, room="map", command=command, live=live)


def _cards(result: MapResult) -> list[Card]:
    cards = [
        Card(
            f"Lump {k + 1}", _short(lump.stiffness, 3), "N/m", _short(0.5 * (lump.ci95[1] - lump.ci95[0])),
            f"at {place(lump.place)}; {_area(lump)}", "ok" if lump.is_sure else "warn",
            "stiffer" if lump.is_sure else "or an outlier" if lump.unless else "perhaps", "K",
        )
        for k, lump in enumerate(result.lumps[:3])
    ]  # fmt: skip
    halves = result.prediction.relative_half[result.grid.inside]
    return [
        *cards,
        *([Card("To press yet", advice[0], why=advice[1])] if (advice := further(result)) else []),
        Card("Half-width", _short(100.0 * np.median(halves)), "%", why="of the interval, at the median place"),
        Card(
            "Press to press", _short(100.0 * result.repeat), "%",
            why="at one place, 95 %, beyond their own intervals",
        ),
    ]  # fmt: skip


def _short(value: Any, digits: int = 2) -> str:
    """A number rounded to some digits."""
    return plain(float(f"{value:.{digits}g}"))


def _area(lump: Lump) -> str:
    low, high = (1e4 * area for area in lump.area95)
    return f"{1e4 * lump.area:.2g} cm² ({low:.2g} to {high:.2g})"


def _map_caption(result: MapResult) -> str:
    threshold = result.request.stiffer_than
    lines = "" if threshold is None else (
        f" Line: {quantity(threshold, 'N/m')}; dotted: its 95 % band, place by place."
    )  # fmt: skip
    return f"Stiffness [N/m]. Rings: presses. Dashes: the cut. Hatched: not known.{lines}"


def _press_rows(result: MapResult) -> list[tuple[str, str, str]]:
    presses = zip(result.presses.names, result.map.places, result.map.stiffness, result.map.half, strict=True)
    return [
        (name, place(where), f"{quantity(k, 'N/m')} ± {plain(half, 2)}") for name, where, k, half in presses
    ]


def draw_map(result: MapResult) -> Figure:
    """The stiffness over the surface, the presses, the contour of the threshold and its band."""
    from matplotlib.colors import LogNorm
    from matplotlib.ticker import MaxNLocator, NullFormatter

    prediction = result.prediction
    grid = result.grid
    threshold = result.request.stiffer_than
    with style.ink(9.0):
        figure, axis, bar = _picture(result, prediction.stiffness, "stiffness [N/m]", "Blues", norm=LogNorm())
        low, high = bar.ax.get_xlim()
        if high < 8.0 * low:
            bar.ax.xaxis.set_major_locator(MaxNLocator(5, steps=(1, 2, 5, 10)))
        else:
            style.logarithmic(bar.ax, "x")
        bar.ax.xaxis.set_minor_formatter(NullFormatter())
        if threshold is not None:
            probability = np.where(grid.inside, prediction.exceeds(threshold), np.nan).reshape(grid.shape)
            axis.contour(1e3 * grid.across, 1e3 * grid.along, probability, [0.025, 0.5, 0.975], colors="black",
                         linewidths=[0.9, 1.8, 0.9], linestyles=[":", "-", ":"])  # fmt: skip
        at = 1e3 * result.map.surface.coordinates(result.map.places)
        axis.plot(*at.T, "o", mfc="white", mec="black", markersize=4, mew=0.9, clip_on=False)
        begin, end = (1e3 * point for point in _cut_ends(result))
        axis.plot(*zip(begin, end, strict=True), c="black", linewidth=0.9, linestyle=(0, (5, 4)))
    return figure


def draw_interval(result: MapResult) -> Figure:
    """The half-width of the interval over the surface, and the next presses by their numbers."""
    half = 100.0 * result.prediction.relative_half
    with style.ink(9.0):
        figure, axis, _ = _picture(result, half, "half-width, 95 % [%]", "Greys")
        coordinates = 1e3 * result.map.surface.coordinates(result.next.places[: result.request.next])
        for k, (x, y) in enumerate(coordinates):
            box = {"boxstyle": "circle,pad=0.25", "fc": style.CARD, "ec": style.INK, "lw": 0.9}
            axis.text(x, y, str(k + 1), ha="center", va="center", fontsize=8, bbox=box, color=style.INK)
    return figure


def _picture(
    result: MapResult, values: Array, label: str, colours: str, **norm: Any
) -> tuple[Figure, Axes, Colorbar]:
    """A quantity at the grid over the surface, with its bar of colours."""
    grid = result.grid
    figure, (axis,) = style.grid((5.0, 4.4))
    image_values = np.where(grid.inside, values, np.nan).reshape(grid.shape)
    extent = tuple(1e3 * grid.ends)
    appearance = {"origin": "lower", "cmap": scale(colours), "interpolation": "bilinear", **norm}
    image = axis.imshow(image_values, extent=extent, **appearance)
    axis.axhspan(*axis.get_ylim(), fill=False, hatch="////", ec=style.LINE, lw=0.0, zorder=-1.0)
    bar = figure.colorbar(image, ax=axis, location="top", shrink=0.7, label=label, format="{x:g}")
    axis.grid(visible=False)
    axis.set_aspect("equal")
    across, along = (f"{name} [mm]" for name in result.map.surface.names)
    axis.set(xlabel=across, ylabel=along)
    return figure, axis, bar


def scale(name: str) -> ListedColormap:
    """The middle of matplotlib's colours of a name, dark where a value is large.

    Both ends stand out on a page, light or dark: `tests/maps/test_map_command.py` measures it.
    """
    from matplotlib import colormaps
    from matplotlib.colors import ListedColormap

    return ListedColormap(colormaps[name](np.linspace(*SHADES[name], 256)))


def _cut_ends(result: MapResult) -> tuple[Any, Any]:
    """A line through the two stiffest lumps or, where there are none, through the stiffest place and the middle."""
    surface = result.map.surface
    grid = result.grid
    inside = surface.coordinates(grid.places[grid.inside])
    tops = [surface.coordinates(np.array([lump.place]))[0] for lump in result.lumps[:2]]
    tops = tops or [inside[int(np.argmax(result.prediction.mean[grid.inside]))]]
    first, second, *_ = (*tops, inside.mean(axis=0))
    size = float(np.linalg.norm(second - first))
    direction = (second - first) / size if size > 1e-9 else np.array([1.0, 0.0])
    along = (inside - first) @ direction
    offset = (inside - first) @ [-direction[1], direction[0]]
    near = along[np.abs(offset) < np.sqrt(grid.cell)]
    ends = (first + direction * near.min(), first + direction * near.max())
    return ends if direction[0] >= 0.0 else ends[::-1]


def cut_chart(result: MapResult) -> Chart:
    """Stiffness, its interval and that of a next press along a line, and the presses beside it."""
    surface = result.map.surface
    begin, end = _cut_ends(result)
    length = float(np.linalg.norm(end - begin))
    steps = np.linspace(0.0, 1.0, 200)
    prediction = result.map.predict(surface.places(begin + np.outer(steps, end - begin)))
    direction = (end - begin) / max(length, 1e-12)
    offsets = surface.coordinates(result.map.places) - begin
    along = offsets @ direction
    distance = np.abs(offsets @ np.array([-direction[1], direction[0]]))
    near = (distance < 0.05 * length) & (along >= 0.0) & (along <= length)
    x = 1e3 * length * steps
    threshold = result.request.stiffer_than
    series = [Series(x, prediction.stiffness, "K", "stiffness")]
    for both, dash, label in ((prediction.ci95, "--", "95 %"), (prediction.next95, ":", "next press, 95 %")):
        series += [
            Series(x, ends, "K", name, 0.9, dash) for ends, name in zip(both.T, (label, ""), strict=True)
        ]
    if near.any():
        label = f"presses within {plain(50 * length, 2)} mm"
        order = np.argsort(along[near])
        at = 1e3 * along[near][order]
        values = result.map.stiffness[near][order]
        series.append(Series(at, values, "ink", label, dots=4.0))
    bands = [] if threshold is None else [Band(threshold, threshold, label="threshold", **KNOWN)]
    return Chart(
        "stiffness [N/m]", series, bands, x="distance along the cut [mm]", xlim=(0.0, float(x[-1])), log="y"
    )
