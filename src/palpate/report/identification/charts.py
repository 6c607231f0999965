"""Charts of an identification: storage and loss by octave, the press, the model's force and its misfit."""

from __future__ import annotations

from collections.abc import Callable
from math import pi, sqrt

import numpy as np

from palpate.arrays import Array, Mask
from palpate.identification.result import (
    DynamicStiffness,
    Identification,
    Press,
    Tangent,
    Traces,
    WorkingPoint,
)
from palpate.report.chart import Chart, Interval, Mark, Series
from palpate.report.style import rows_shown, with_peaks

_MAX_POINTS = 4800
"""Approximate points of a line, more than a page has pixels; each stretch keeps its extremes."""
_MAX_DOTS = 1500
"""Dots of the whole contact in the chart of the press."""
_MARGIN = 0.35
"""Time shown before and after the contacts, as a fraction of their length."""
_HALF_OCTAVE = sqrt(2.0)
_BAR = 2.0**0.2
"""Half the width of an octave's interval, as a factor of its frequency: intervals of neighbours do not overlap."""
_KILO = 2e3
"""Stiffness from which on an axis is in kN/m [N/m]."""
_HEADROOM = 0.25
"""Room above the values, as a fraction of their range."""
_GAP = 1.5
"""Steps of the time, in medians, from which on a line is broken."""


def build_charts(result: Identification, traces: Traces) -> list[Chart]:
    """All charts: first those without a model, then the force and the misfit over time."""
    return [*evidence_charts(result, traces), *time_charts(result, traces)]


def evidence_charts(result: Identification, traces: Traces) -> list[Chart]:
    """Storage and loss by octave, and the press, where the log shows them."""
    if not len(traces.fitted_time):
        return []
    charts = _octave_charts(result) if result.dynamic_stiffness else []
    if result.press:
        charts.append(_press_chart(result, result.press, traces))
    return charts


def time_charts(result: Identification, traces: Traces) -> list[Chart]:
    """The force with the model's prediction; below it the misfit, where a model was fitted."""
    contacts = [Mark(result.contacts, "F", "in contact")] if result.contacts else []
    window, unit = _window(result, traces), traces.force_unit
    measured = Series(*with_peaks(traces.time, traces.force, _MAX_POINTS), "measured", "measured", 1.0)
    curves = {"force": [measured]}
    if len(traces.fitted_time):
        misfit = traces.fitted_force - traces.predicted
        model_line = _broken_line(traces.fitted_time, traces.predicted)
        misfit_line = _broken_line(traces.fitted_time, misfit)
        curves["force"].append(Series(*model_line, "ink", "model", 1.4))
        curves["misfit"] = [Series(*misfit_line, "measured", "measured less model", 0.9)]
    return [
        Chart(
            axis_label(name, unit),
            series,
            marks=contacts,
            x="time [s]",
            title=name.capitalize(),
            xlim=window,
        )
        for name, series in curves.items()
    ]


def axis_label(name: str, unit: str) -> str:
    """The name of an axis with its unit, if it has one."""
    return name if unit == "1" else f"{name} [{unit}]"


def _window(result: Identification, traces: Traces) -> tuple[float, float]:
    """Range of the time axis: the whole log, or the contacts with a margin where they are short [s]."""
    first, last = float(traces.time[0]), float(traces.time[-1])
    if not result.contacts:
        return first, last
    start, end = result.contacts[0][0], result.contacts[-1][1]
    margin = _MARGIN * (end - start)
    return max(first, start - margin), min(last, end + margin)


def _broken_line(time: Array, values: Array) -> tuple[Array, Array]:
    """A line that keeps its peaks and has a gap wherever the time has one."""
    step = np.diff(time)
    cuts = np.flatnonzero(step > _GAP * np.median(step)) + 1 if len(step) else np.empty(0, int)
    lines = []
    for piece_time, piece in zip(np.split(time, cuts), np.split(values, cuts), strict=True):
        x, y = with_peaks(piece_time, piece, _MAX_POINTS)
        lines.append((np.append(x, x[-1]), np.append(y, np.nan)))
    return np.concatenate([x for x, _ in lines]), np.concatenate([y for _, y in lines])


def _octave_charts(result: Identification) -> list[Chart]:
    """The dynamic stiffness in phase with the position and in quadrature, with the model's K - w^2 M and w B."""
    K, B, M = (_value(result, name) for name in ("K", "B", "M"))
    mass = M or 0.0
    label = "K − ω²M" if mass else "model K"
    storage_model = None if K is None else lambda w: K - w**2 * mass
    loss_model = None if B is None else lambda w: w * B
    return [
        _octave_chart(result, "storage", "K", label, storage_model),
        _octave_chart(result, "loss", "B", "model ωB", loss_model),
    ]


def _octave_chart(
    result: Identification, part: str, colour: str, label: str, model: Callable[[Array], Array] | None
) -> Chart:
    octaves = result.dynamic_stiffness
    frequency = np.array([octave.frequency for octave in octaves])
    shown = shown_by(octaves, part)
    value = np.array([getattr(octave, part) for octave in octaves])
    half = np.array([getattr(octave, f"{part}_half") for octave in octaves])
    unit = result.working_point.stiffness.unit if result.working_point else "1"
    scale = 1.0
    largest = float(np.abs(value[shown] if shown.any() else value).max())
    if unit == "N/m" and largest >= _KILO:
        unit = "kN/m"
        scale = 1e3
        value = value / scale
        half = half / scale
    ends = frequency[0] / _HALF_OCTAVE, frequency[-1] * _HALF_OCTAVE
    series = [Series(frequency[shown], value[shown], colour, "measured", dots=4.5)]
    if model is not None:
        fine = np.geomspace(*ends, 200)
        series.append(Series(fine, model(2 * pi * fine) / scale, "ink", label, 1.2))
    point = result.working_point
    if part == "storage" and point and point.source == "octave" and point.stiffness.value is not None:
        at = np.array([point.frequency_Hz]), np.array([point.stiffness.value / scale])
        series.append(Series(*at, "ink", "working point", dots=9.0, alpha=0.5))
    hidden = [(float(f / _HALF_OCTAVE), float(f * _HALF_OCTAVE)) for f in frequency[~shown]]
    return Chart(
        axis_label(part, unit),
        series,
        intervals=[_bars(frequency[shown], value[shown], half[shown], colour)] if shown.any() else [],
        marks=[Mark(hidden, "measured", "not shown")] if hidden else [],
        x="frequency [Hz]",
        title=part.capitalize(),
        xlim=ends,
        ylim=_value_range(value, half, shown),
        log="x",
    )


def _bars(frequency: Array, value: Array, half: Array, colour: str) -> Interval:
    """The interval about each octave's frequency, with a gap between two octaves."""
    x = np.outer(frequency, [1.0 / _BAR, _BAR, 1.001 * _BAR]).ravel()
    gap = [0.0, 0.0, np.nan]
    low, high = (np.add.outer(end, gap).ravel() for end in (value - half, value + half))
    return Interval(x, low, high, colour, "95 %")


def shown_by(octaves: tuple[DynamicStiffness, ...], part: str) -> Mask:
    """True for the octaves whose interval of a part is narrower than the stiffness there is large, shape (n,)."""
    size = np.array([np.hypot(octave.storage, octave.loss) for octave in octaves])
    half = np.array([getattr(octave, f"{part}_half") for octave in octaves])
    shown: Mask = half < size
    return shown


def _value_range(value: Array, half: Array, shown: Mask) -> tuple[float, float]:
    """Range of y with zero and the shown values, and with as much of their intervals as is no larger than they are."""
    if not shown.any():
        shown = half == half.min()
    size = float(np.abs(value[shown]).max()) or 1.0
    reach = np.minimum(half, size / 2)
    low, high = float((value - reach)[shown].min()), float((value + reach)[shown].max())
    low, high = min(low, 0.0), max(high, 0.0)
    room = _HEADROOM * (high - low)
    return low - (room if low < 0 else 0.0), high + room


def _press_chart(result: Identification, press: Press, traces: Traces) -> Chart:
    """Force over depth: loading and unloading, all of the contact, the answer's stiffness, the working point."""
    scale, unit = (1e3, "mm") if traces.position_unit == "m" else (1.0, traces.position_unit)
    order = np.argsort(traces.fitted_position)
    depth, force = scale * traces.fitted_position[order], traces.fitted_force[order]
    rows = rows_shown(force, _MAX_DOTS)
    series = [Series(depth[rows], force[rows], "measured", "all of the contact", dots=1.5, alpha=0.5)]
    for name, (x, y), colour in (
        ("loading", press.loading, "ink"),
        ("unloading", press.unloading, "measured"),
    ):
        if len(x):
            order = np.argsort(x)
            series.append(Series(scale * x[order], y[order], colour, name))
    point, slopes = result.working_point, _slopes(press, scale)
    if point is not None:
        if point.stiffness.value is not None and point.stiffness.ci95 is not None:
            slopes = [_headline(point, traces, scale)]
        at = np.array([scale * point.depth_m]), np.array([point.force_N])
        series.append(Series(*at, "ink", "working point", dots=9.0, alpha=0.5))
    series.extend(slope for slope, _ in slopes)
    name = "depth from touch" if _counts_from_touch(result, press) else "position"
    low, high = float(traces.fitted_force.min()), float(traces.fitted_force.max())
    room = 0.08 * (high - low) or 1.0
    return Chart(
        axis_label("force", traces.force_unit),
        series,
        intervals=[band for _, band in slopes],
        x=axis_label(name, unit),
        title="Press",
        ylim=(min(low, 0.0) - room, high + room),
    )


def _counts_from_touch(result: Identification, press: Press) -> bool:
    """True if positions count from a touch: the mean in contact then lies well inside the surface."""
    point = result.working_point
    return point is not None and point.depth_m > 0.25 * float(_branch(press)[0].max(initial=0.0)) > 0


def _branch(press: Press) -> Array:
    """Depth [m] and force [N] of the loading, or of the unloading where the log has no loading, shape (2, n)."""
    return press.loading if press.loading.size else press.unloading


def _headline(point: WorkingPoint, traces: Traces, scale: float) -> tuple[Series, Interval]:
    """The stiffness of the answer with its interval, a line through the working point."""
    depth = traces.fitted_position
    steps = np.array([float(depth.min()), point.depth_m, float(depth.max())]) - point.depth_m
    slope, (low, high) = point.stiffness.value or 0.0, point.stiffness.ci95 or (0.0, 0.0)
    ends = point.force_N + np.outer([low, high], steps)
    x = scale * (point.depth_m + steps)
    line = Series(x, point.force_N + slope * steps, "K", "stiffness, 95 %", 2.4)
    return line, Interval(x, ends.min(axis=0), ends.max(axis=0), "K")


def _slopes(press: Press, scale: float) -> list[tuple[Series, Interval]]:
    """Each slope with its interval, over its part of the loading or the unloading."""
    depth, force = _branch(press)
    if not len(depth):
        return []
    reach = float(np.ptp(depth)) / (2.5 * max(len(press.tangent), 1))
    steps, lines = np.linspace(-reach, reach, 3), []
    for i, tangent in enumerate(press.tangent):
        x = scale * (_depth_at(press, tangent) + steps)
        y = tangent.force + tangent.stiffness * steps
        half = np.minimum(tangent.half * np.abs(steps), float(np.ptp(force)))
        label = "" if i else "slope, 95 %"
        lines.append((Series(x, y, "K", label, 2.4), Interval(x, y - half, y + half, "K")))
    return lines


def _depth_at(press: Press, tangent: Tangent) -> float:
    """Depth at which the loading, or the unloading, passes a slope's force [m]."""
    x, f = _branch(press)
    return float(x[int(np.argmin(np.abs(f - tangent.force)))])


def _value(result: Identification, name: str) -> float | None:
    p = result.parameters.get(name)
    return p.value if p is not None and p.unit in {"N/m", "N s/m", "kg", "1", "N m/rad"} else None
