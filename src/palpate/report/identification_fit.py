"""Panels that show how a model follows a log: force against penetration, force over time, what is left."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from palpate.report import style
from palpate.report.identification_spectra import stretches, terms

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from palpate.identification.result import Identification, Traces

Array = NDArray[np.float64]

MEASURED, FITTED = style.BLUE, style.RED
_MANY = 8_000
_CLOSE = 500
_BINS = 40
_MARGIN = 0.35
# A picture of dots stays small in any format, however long the log.
_DOTS: dict[str, Any] = {"ls": "", "marker": ".", "ms": 2.2, "mew": 0, "rasterized": True}


def loop(axes: Axes, found: Identification, traces: Traces) -> None:
    """Force against penetration: measured and fitted; of a shaken contact, the spring's part of it."""
    scale, unit = _length(traces)
    x = scale * traces.fitted_position
    if tangled(traces):
        _spring_part(axes, traces, x)
        style.legend(axes, loc="upper left", bbox_to_anchor=(0.0, 1.0), ncols=1, markerscale=4)
    else:
        axes.plot(*_broken(traces, x, traces.fitted_force), color=MEASURED, lw=2.2, label="measured")
        axes.plot(*_broken(traces, x, traces.predicted), color=FITTED, lw=1.0, label="model")
        _spring(axes, traces, x, color=style.INK, lw=1.1, ls="--", label="its spring alone")
        style.legend(axes)
    axes.set_xlabel(labelled("position from touch" if found.contacts else "position", unit))
    axes.set_ylabel(labelled("force", traces.force_unit))


def tangled(traces: Traces) -> bool:
    """Whether the loops of force against penetration cross each other too often to be read."""
    return "M" in traces.columns or len(traces.fitted_time) > _MANY


def _spring_part(axes: Axes, traces: Traces, x: Array) -> None:
    """Loops that cross each other all over tell nothing: the measured force less the model's damping and mass does."""
    moving = traces.predicted - _spring_force(traces)
    axes.plot(x, traces.fitted_force, color=style.GREY, alpha=0.5, label="measured", **_DOTS)
    axes.plot(x, traces.fitted_force - moving, color=MEASURED, label="less damping, mass", **_DOTS)
    _spring(axes, traces, x, color=FITTED, lw=1.4, label="model's spring")


def force(axes: Axes, found: Identification, traces: Traces) -> None:
    """Force over time, with the contacts and the model's prediction in them."""
    contacts(axes, found)
    axes.plot(traces.time, traces.force, color=MEASURED, lw=2.2, label="measured")
    if len(traces.fitted_time):
        time, predicted = _broken(traces, traces.fitted_time, traces.predicted)
        axes.plot(time, predicted, color=FITTED, lw=1.0, label="model")
    axes.set_xlabel("time [s]")
    start, end = window(found, traces)
    axes.set_xlim(start, end)
    if len(traces.fitted_time) > _MANY and len(found.contacts) == 1:
        _close_up(axes, traces)
    axes.set_ylabel(labelled("force", traces.force_unit))
    style.legend(axes)


def _close_up(axes: Axes, traces: Traces) -> None:
    """So many samples would be a block of colour: show some in the middle."""
    middle = len(traces.fitted_time) // 2
    near = slice(middle - _CLOSE // 2, middle + _CLOSE // 2)
    time, force = traces.fitted_time[near], np.r_[traces.fitted_force[near], traces.predicted[near]]
    margin = 0.1 * float(np.ptp(force))
    axes.set_xlim(float(time[0]), float(time[-1]))
    axes.set_ylim(float(force.min()) - margin, float(force.max()) + margin)
    axes.set_xlabel("time [s], from the middle of the log")


def residual(axes: Axes, found: Identification, traces: Traces) -> None:
    """What the model leaves of the force, over time."""
    contacts(axes, found)
    time, left = _broken(traces, traces.fitted_time, traces.fitted_force - traces.predicted)
    axes.axhline(0, color=style.GREY, lw=0.8)
    axes.plot(time, left, color=FITTED, lw=0.8, label="measured less model")
    axes.set_xlim(*window(found, traces))
    axes.set_xlabel("time [s]")
    axes.set_ylabel(labelled("misfit", traces.force_unit))
    style.legend(axes)


def contacts(axes: Axes, found: Identification) -> None:
    """Shade the contacts."""
    for i, (start, end) in enumerate(found.contacts):
        axes.axvspan(start, end, color=style.SAND, alpha=0.18, lw=0, label="contact" if i == 0 else None)


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


def _length(traces: Traces) -> tuple[float, str]:
    return (1e3, "mm") if traces.position_unit == "m" else (1.0, traces.position_unit)


def _spring_force(traces: Traces) -> Array:
    """What the spring K, curved or not, gives by itself, shape (m,)."""
    force: Array = terms(traces)["K"] + traces.theta.get("offset", 0.0)
    return force


def _spring(axes: Axes, traces: Traces, x: Array, **look: Any) -> None:
    """The model's spring as a line from the least to the largest position."""
    own = _spring_force(traces)
    edges = np.linspace(x.min(), x.max(), _BINS + 1)
    place = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, _BINS - 1)
    count = np.bincount(place, minlength=_BINS)
    there = count > 0
    means = [np.bincount(place, values, minlength=_BINS)[there] / count[there] for values in (x, own)]
    axes.plot(*means, **look)


def _broken(traces: Traces, *lines: Array) -> list[Array]:
    """Lines that are not drawn across the time between two contacts."""
    gaps = [piece.start for piece in stretches(traces.fitted_time)[1:]]
    return [np.insert(line, gaps, np.nan) for line in lines]
