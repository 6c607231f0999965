"""The figure of an identification, and its panels: storage and loss, the press, the model's force, the misfit."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.arrays import Array, Mask
from palpate.identification.result import DynamicStiffness, Identification, Press, Tangent, Traces
from palpate.report import style
from palpate.report.identification.spectra import band_of, leaving, resting, stretches, white
from palpate.report.identification.words import MARKS, full_number, model_line, sentence, subtitle
from palpate.text import printable

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


_FIT_POINTS = 4800
"""Of a line: more than a page has columns for; each stretch keeps its least and its largest value."""
_MARGIN = 0.35
"""Of a contact's length, that is shown before and after it."""


def force(axes: Axes, found: Identification, traces: Traces) -> None:
    """Force over time, with the contacts and the model's prediction in them."""
    style.panel(axes, axis_label("force", traces.force_unit), "time [s]")
    contacts(axes, found)
    axes.plot(
        *style.with_peaks(traces.time, traces.force, _FIT_POINTS),
        color=style.MEASURED,
        lw=1.0,
        label="measured",
    )
    if len(traces.fitted_time):
        for i, piece in enumerate(stretches(traces.fitted_time)):
            line = style.with_peaks(traces.fitted_time[piece], traces.predicted[piece], _FIT_POINTS)
            axes.plot(*line, color=style.INK, lw=1.4, label="model" if i == 0 else None)
    axes.set_xlim(*window(found, traces))
    style.legend_above(axes)


def residual(axes: Axes, found: Identification, traces: Traces) -> None:
    """Residual of the force over time."""
    style.panel(axes, axis_label("misfit", traces.force_unit), "time [s]")
    contacts(axes, found)
    left = traces.fitted_force - traces.predicted
    for i, piece in enumerate(stretches(traces.fitted_time)):
        line = style.with_peaks(traces.fitted_time[piece], left[piece], _FIT_POINTS)
        axes.plot(*line, color=style.MEASURED, lw=0.9, label="measured less model" if i == 0 else None)
    axes.set_xlim(*window(found, traces))
    style.legend_above(axes)


def contacts(axes: Axes, found: Identification) -> None:
    """Shade the spans in contact."""
    for i, (start, end) in enumerate(found.contacts):
        axes.axvspan(start, end, color=style.F, alpha=0.09, lw=0, label="in contact" if i == 0 else None)


def window(found: Identification, traces: Traces) -> tuple[float, float]:
    """From when to when to look: the whole log, or the contacts with their surroundings where they are short [s]."""
    first, last = float(traces.time[0]), float(traces.time[-1])
    if not found.contacts:
        return first, last
    start, end = found.contacts[0][0], found.contacts[-1][1]
    margin = _MARGIN * (end - start)
    return max(first, start - margin), min(last, end + margin)


def axis_label(name: str, unit: str) -> str:
    """The name of an axis with its unit, if there is one."""
    return name if unit == "1" else f"{name} [{unit}]"


def length_of(traces: Traces) -> tuple[float, str]:
    """Unit of an axis of depth."""
    return (1e3, "mm") if traces.position_unit == "m" else (1.0, traces.position_unit)


def empty(axes: Axes, why: str) -> None:
    """A panel with nothing to draw says so."""
    axes.text(0.5, 0.5, why, ha="center", va="center", transform=axes.transAxes, color=style.QUIET)
    axes.set_axis_off()


_BAND: dict[str, Any] = {"alpha": 0.22, "lw": 0}
_HEADROOM = 1.25
"""Room above what is told."""
_ENDS = 2**0.5
_KILO = 2e3
"""N/m from which on an axis is in kN/m."""
_POINTS, _BREAK = 3000, 5.0
"""Points of the whole contact, about; and times of a usual step from which on a line is broken."""


def storage(axes: Axes, found: Identification, traces: Traces) -> None:
    """The part of the dynamic stiffness in phase with the position, by octave, and the model's K - w^2 M."""
    octaves = found.dynamic_stiffness
    if not octaves:
        empty(axes, "too short a contact for a spectrum")
        return
    values = np.array([(o.storage, o.storage_half) for o in octaves])
    K, M = _value(found, "K"), _value(found, "M") or 0.0
    model = None if K is None else (lambda w: K - w**2 * M)
    scale = _part(axes, found, values, style.K, "storage", model, "K − ω²M" if M else "model K")
    point = found.working_point
    if point is not None and point.stiffness.value is not None and point.source == "octave":
        _ring(axes, point.frequency_Hz, point.stiffness.value / scale)
    style.legend_above(axes)


def loss(axes: Axes, found: Identification, traces: Traces) -> None:
    """The part in quadrature, and the model's w B."""
    octaves = found.dynamic_stiffness
    if not octaves:
        empty(axes, "")
        return
    values = np.array([(o.loss, o.loss_half) for o in octaves])
    B = _value(found, "B")
    _part(axes, found, values, style.B, "loss", None if B is None else (lambda w: w * B), "model ωB")
    axes.set_xlabel("frequency [Hz]", loc="right", color=style.QUIET)
    style.legend_above(axes)


def _part(
    axes: Axes, found: Identification, values: Array, colour: str, name: str, model: Any, called: str
) -> float:
    """Points, band and model of one part; returns what the axis counts in."""
    octaves = found.dynamic_stiffness
    frequency = np.array([o.frequency for o in octaves])
    told = shown_by(octaves, name)
    unit = found.working_point.stiffness.unit if found.working_point else "1"
    scale, unit = scaled_unit(unit, values[told, 0] if told.any() else values[:, 0])
    value, half = values.T / scale
    style.panel(axes, axis_label(name, unit))
    axes.fill_between(
        frequency, value - half, value + half, where=list(told), color=colour, label="95 %", **_BAND
    )
    axes.errorbar(frequency[told], value[told], half[told], color=colour, fmt="none", lw=1, capsize=2)
    axes.plot(frequency[told], value[told], "o", ms=4.5, color=colour, label="measured")
    axes.plot(frequency[~told], value[~told], "o", ms=4.5, mfc="none", color=colour)
    fine = np.geomspace(frequency[0] / _ENDS, frequency[-1] * _ENDS, 200)
    if model is not None:
        axes.plot(fine, model(2 * np.pi * fine) / scale, color=style.INK, lw=1.2, label=called)
    axes.set_xlim(fine[0], fine[-1])
    axes.set_ylim(*_limits(value, half, told))
    _silent(axes, frequency, told)
    style.logarithmic(axes, "x")
    return scale


def shown_by(octaves: tuple[DynamicStiffness, ...], part: str) -> Mask:
    """Which octaves tell a part more narrowly than the stiffness there is large, shape (n,)."""
    size = np.array([np.hypot(o.storage, o.loss) for o in octaves])
    half = np.array([getattr(o, f"{part}_half") for o in octaves])
    found: Mask = half < size
    return found


def _limits(value: Array, half: Array, told: Mask) -> tuple[float, float]:
    """Zero and the points that are told in sight, with as much of their bands as is no larger than they are."""
    if not told.any():
        told = half == half.min()
    size = float(np.abs(value[told]).max())
    reach = np.minimum(half, size / 2)
    low, high = float((value - reach)[told].min()), float((value + reach)[told].max())
    low, high = min(low, 0.0), max(high, 0.0)
    room = (_HEADROOM - 1) * (high - low)
    return low - (room if low < 0 else 0.0), high + room


def _silent(axes: Axes, frequency: Array, told: Mask) -> None:
    """Octaves that the log does not tell lie in a shade."""
    for i, f in enumerate(frequency[~told]):
        name = "not shown" if i == 0 else None
        axes.axvspan(f / _ENDS, f * _ENDS, color=style.MEASURED, alpha=0.14, lw=0, label=name)


def press(axes: Axes, found: Identification, traces: Traces) -> None:
    """Force over depth: all of the contact, loading and unloading, its slopes with their bands, the working point."""
    own = found.press
    if own is None:
        empty(axes, "no loading in this log")
        return
    scale, unit = length_of(traces)
    style.panel(
        axes,
        axis_label("force", traces.force_unit),
        axis_label("depth from touch" if _touches(found) else "position", unit),
    )
    x, f = own.loading
    _whole(axes, traces, scale)
    _band_of(axes, own, scale)
    low, high = (float(end(traces.fitted_force)) for end in (np.min, np.max))
    edge = 0.08 * (high - low) or 1.0
    axes.set_ylim(min(low, 0.0) - edge, high + edge)
    axes.plot(scale * x, f, color=style.INK, lw=1.6, label="loading")
    if own.unloading.shape[1]:
        axes.plot(scale * own.unloading[0], own.unloading[1], color=style.MEASURED, lw=1.6, label="unloading")
    point = found.working_point
    if point is not None:
        _ring(axes, scale * point.depth_m, point.force_N)
    style.legend_above(axes)


def _whole(axes: Axes, traces: Traces, scale: float) -> None:
    """Every loading and unloading of the log, broken where there is no contact."""
    rows = style.rows_shown(traces.fitted_force, _POINTS)
    t = traces.fitted_time[rows]
    steps = np.diff(t, prepend=t[0])
    gap = steps > _BREAK * max(float(np.median(steps)), float(np.ptp(traces.fitted_time)) / _POINTS)
    position = np.where(gap, np.nan, scale * traces.fitted_position[rows])
    look: dict[str, Any] = {"color": style.MEASURED, "lw": 0.8, "alpha": 0.7, "label": "all of the contact"}
    axes.plot(position, traces.fitted_force[rows], **look)


def _touches(found: Identification) -> bool:
    """Whether positions count from a touch: the mean in contact then lies well inside the surface."""
    point, press = found.working_point, found.press
    if point is None or press is None:
        return False
    return point.depth_m > 0.25 * float(press.loading[0].max()) > 0


def _band_of(axes: Axes, own: Press, scale: float) -> None:
    """The slopes, each over the part of the loading that it is of."""
    reach = float(np.ptp(own.loading[0])) / (2.5 * max(len(own.tangent), 1))
    low, high = float(own.loading[1].min()), float(own.loading[1].max())
    for i, tangent in enumerate(own.tangent):
        at = _depth_at(own, tangent)
        u = np.linspace(-reach, reach, 3)
        line = tangent.force + tangent.stiffness * u
        half = np.minimum(tangent.half * np.abs(u), high - low)
        axes.fill_between(scale * (at + u), line - half, line + half, color=style.K, **_BAND)
        axes.plot(scale * (at + u), line, color=style.K, lw=2.4, label="slope, 95 %" if i == 0 else None)


def _depth_at(own: Press, tangent: Tangent) -> float:
    """Depth at which the loading passes a slope's force [m]."""
    x, f = own.loading
    return float(x[int(np.argmin(np.abs(f - tangent.force)))])


def _ring(axes: Axes, x: float, y: float) -> None:
    look: dict[str, Any] = {"ms": 10, "mfc": "none", "mec": style.INK, "mew": 1.8, "zorder": 5}
    axes.plot([x], [y], "o", label="working point", clip_on=False, **look)


def _value(found: Identification, name: str) -> float | None:
    p = found.parameters.get(name)
    return p.value if p is not None and p.unit in {"N/m", "N s/m", "kg", "1", "N m/rad"} else None


def scaled_unit(unit: str, values: Array) -> tuple[float, str]:
    """Unit of an axis: kN/m where that is shorter."""
    large = unit == "N/m" and float(np.abs(values).max()) >= _KILO
    return (1e3, "kN/m") if large else (1.0, unit)


def residual_spectrum(axes: Axes, found: Identification, traces: Traces) -> None:
    """The spectrum of what is left, against white noise of the same power behind the same filters."""
    left = leaving(found, traces)
    if left is None or left.power == 0:
        empty(axes, "too short a contact for a spectrum")
        return
    unit = "" if traces.force_unit == "1" else traces.force_unit
    style.panel(axes, f"misfit [{unit}/√Hz]", "frequency [Hz]")
    expected, low, high = (np.sqrt(d) for d in white(left, band_of(found, traces)))
    axes.fill_between(
        left.frequency, low, high, color=style.MEASURED, alpha=0.22, lw=0, label="white noise, 95 %"
    )
    axes.plot(left.frequency, expected, color=style.QUIET, lw=1.1, ls=(0, (5, 4)))
    axes.plot(left.frequency, np.sqrt(left.density), color=style.INK, lw=1.5, label="misfit")
    rest = resting(found, traces)
    if rest is not None:
        axes.plot(rest.frequency, np.sqrt(rest.density), color=style.MEASURED, lw=1.0, label="out of contact")
    style.logarithmic(axes, "x")
    axes.set_ylim(bottom=max(float(low.min()), 1e-2 * float(np.sqrt(left.density).min())) / 2)
    style.logarithmic(axes, "y")
    style.legend_above(axes)


Panel = Callable[["Axes", "Identification", "Traces"], None]

WIDE, _HIGH, _HEAD = 13.0, 11.8, 1.75
"""Width and height of the whole figure, and height of its head [in]."""
_LINE = 160
"""Letters in a line of the head."""
_PIXEL = 1 / 72
"""Of a page, in inches: what is drawn so wide keeps its letters at their size."""
LETTERS = 12
"""Size of letters on a page [px]."""


def write_figure(found: Identification, path: Path, title: str, dpi: int | None = None) -> Path:
    """Draw an identification and write it, whole or not at all.

    Args:
        found: with its traces.
        path: of the PNG, SVG or PDF.
        title: what to call the log.
        dpi: of a PNG; `style.DPI` if none is given.
    """
    figure = draw(found, title)
    return style.save(figure, path, dpi)


def draw(found: Identification, title: str) -> Figure:
    """The figure of an identification; needs its traces."""
    traces = found.traces
    if traces is None:
        raise ValueError("an identification without traces has no figure")
    with style.ink():
        fitted = len(traces.fitted_time) > 0
        figure = style.empty(WIDE, _HIGH if fitted else _HIGH / 2)
        parts: Any = figure.subfigures(2, 1, height_ratios=(_HEAD, figure.get_figheight() - _HEAD))
        head, body = parts
        _head(head, found, title)
        if fitted:
            _panels(body, found, traces)
        else:
            force(_title(body.subplots(), "Force"), found, traces)
    return figure


def _head(figure: Any, found: Identification, title: str) -> None:
    """The answer in a sentence, what else is known, and of which log."""
    lines = [(printable(title), 11.5, style.QUIET), (sentence(found), 14, style.INK)]
    values = [
        f"{name} {full_number(p)} {MARKS[p.verdict]} {p.verdict}" for name, p in found.parameters.items()
    ]
    lines += [(model_line(found), 10, style.QUIET), (";  ".join(values), 10, style.INK)]
    lines += [(subtitle(found), 9, style.QUIET)]
    top = 1 - 0.06 / _HEAD
    for text, size, colour in lines:
        wrapped = fill(text, int(_LINE * 11 / size))
        figure.text(0.01, top, wrapped, fontsize=size, va="top", color=colour, parse_math=False)
        top -= (1.35 * size * (wrapped.count("\n") + 1) + 3) * _PIXEL / _HEAD if text else 0


def _panels(figure: Any, found: Identification, traces: Traces) -> None:
    top, bottom = figure.subfigures(2, 1, height_ratios=(1.35, 1.0))
    left, right = top.subfigures(1, 2)
    dynamic(left, found, traces, "Dynamic stiffness")
    press(_title(right.subplots(), "Press"), found, traces)
    left, right = bottom.subfigures(1, 2, width_ratios=(1.3, 1.0))
    above, below = left.subplots(2, 1, sharex=True, height_ratios=(1.6, 1.0))
    force(_title(above, "Force"), found, traces)
    residual(_title(below, "Misfit"), found, traces)
    above.set_xlabel("")
    residual_spectrum(_title(right.subplots(), "Is the misfit noise?"), found, traces)


def dynamic(figure: Any, found: Identification, traces: Traces, title: str = "") -> None:
    """Storage above loss, over the same frequencies."""
    above, below = figure.subplots(2, 1, sharex=True)
    storage(_title(above, title), found, traces)
    loss(_title(below, ""), found, traces)


def one(panel: Panel, found: Identification, traces: Traces, width: int, height: int) -> Figure:
    """A figure of one panel, so many pixels wide and high on a page."""
    with style.ink(LETTERS):
        figure = style.empty(width * _PIXEL, height * _PIXEL)
        panel(figure.subplots(), found, traces)
    return figure


def both_parts(found: Identification, traces: Traces, width: int, height: int) -> Figure:
    """Storage above loss, likewise."""
    with style.ink(LETTERS):
        figure = style.empty(width * _PIXEL, height * _PIXEL)
        dynamic(figure, found, traces)
    return figure


def _title(axis: Axes, text: str) -> Axes:
    if text:
        axis.set_title(text, loc="left", fontsize=11.5, fontweight="bold", pad=40)
    return axis
