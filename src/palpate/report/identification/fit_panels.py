"""Panels that show how a model follows a log: force over time, and what is left of it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from palpate.report import style
from palpate.report.identification.spectra import stretches
from palpate.report.look.columns import with_peaks

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from palpate.identification.result import Identification, Traces


_POINTS = 4800
"""Of a line: more than a page has columns for; each stretch keeps its least and its largest value."""
_MARGIN = 0.35
"""Of a contact's length, that is shown before and after it."""


def force(axes: Axes, found: Identification, traces: Traces) -> None:
    """Force over time, with the contacts and the model's prediction in them."""
    style.panel(axes, labelled("force", traces.force_unit), "time [s]")
    contacts(axes, found)
    axes.plot(*with_peaks(traces.time, traces.force, _POINTS), color=style.MEASURED, lw=1.0, label="measured")
    if len(traces.fitted_time):
        for i, piece in enumerate(stretches(traces.fitted_time)):
            line = with_peaks(traces.fitted_time[piece], traces.predicted[piece], _POINTS)
            axes.plot(*line, color=style.INK, lw=1.4, label="model" if i == 0 else None)
    axes.set_xlim(*window(found, traces))
    style.legend_above(axes)


def residual(axes: Axes, found: Identification, traces: Traces) -> None:
    """Residual of the force over time."""
    style.panel(axes, labelled("misfit", traces.force_unit), "time [s]")
    contacts(axes, found)
    left = traces.fitted_force - traces.predicted
    for i, piece in enumerate(stretches(traces.fitted_time)):
        line = with_peaks(traces.fitted_time[piece], left[piece], _POINTS)
        axes.plot(*line, color=style.MEASURED, lw=0.9, label="measured less model" if i == 0 else None)
    axes.set_xlim(*window(found, traces))
    style.legend_above(axes)


def contacts(axes: Axes, found: Identification) -> None:
    """Shade the contacts."""
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


def labelled(name: str, unit: str) -> str:
    """The name of an axis with its unit, if there is one."""
    return name if unit == "1" else f"{name} [{unit}]"


def length_of(traces: Traces) -> tuple[float, str]:
    """Unit of an axis of depth."""
    return (1e3, "mm") if traces.position_unit == "m" else (1.0, traces.position_unit)


def empty(axes: Axes, why: str) -> None:
    """A panel with nothing to draw says so."""
    axes.text(0.5, 0.5, why, ha="center", va="center", transform=axes.transAxes, color=style.QUIET)
    axes.set_axis_off()
