"""The figure of an identification: the force with its fit, what is left, and force against position."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.logs import whole
from palpate.report.ownership import SIGNATURE

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from palpate.identification.result import Identification, Traces

_MANY = 10_000
_MEASURED, _FITTED, _TOUCH = "#4477aa", "#cc3311", "#ddaa33"


def write_figure(found: Identification, path: Path, title: str) -> Path:
    """Draw an identification and write it as a PNG, whole or not at all.

    Args:
        found: with its traces.
        path: of the PNG.
        title: what to call the log.
    """
    figure = draw(found, title)
    with whole(path) as draft:
        figure.savefig(draft, format="png", dpi=110, metadata={"Software": SIGNATURE})
    return path


def draw(found: Identification, title: str) -> Figure:
    """The figure of an identification; needs its traces."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    traces = found.traces
    if traces is None:
        raise ValueError("an identification without traces has no figure")
    figure = Figure(figsize=(11, 6.2), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplot_mosaic("ffl;ffl;rrl", sharex=False)
    _force(axes["f"], found, traces)
    _residual(axes["r"], traces)
    axes["r"].sharex(axes["f"])
    _loop(axes["l"], traces)
    figure.suptitle(_title(found, title), fontsize=11, x=0.01, ha="left")
    return figure


def _title(found: Identification, title: str) -> str:
    parts = []
    for name, p in found.parameters.items():
        if name in ("K2", "K3"):
            continue
        unit = "" if p.unit == "1" else f" {p.unit}"
        half = (p.ci95[1] - p.ci95[0]) / 2 if p.ci95 else 0.0
        number = f"{p.value:.4g} ± {half:.3g}{unit}" if p.value is not None else "no number"
        parts.append(f"{name} {number} ({p.verdict})")
    return f"{title}: {found.model}, R² {found.r2:.4f}\n" + ",  ".join(parts)


def _unit(name: str, unit: str) -> str:
    return name if unit == "1" else f"{name} [{unit}]"


def _force(axes: Any, found: Identification, traces: Traces) -> None:
    for i, (start, end) in enumerate(found.contacts):
        axes.axvspan(start, end, color=_TOUCH, alpha=0.15, lw=0, label="contact" if i == 0 else None)
    axes.plot(traces.time, traces.force, color=_MEASURED, lw=1.2, label="force, filtered")
    time, predicted = _broken(traces.fitted_time, traces.predicted)
    axes.plot(time, predicted, color=_FITTED, lw=1.2, label=found.model)
    axes.set_ylabel(_unit("force", traces.force_unit))
    axes.legend(loc="best", frameon=False, fontsize=8)
    axes.tick_params(labelbottom=False)


def _residual(axes: Any, traces: Traces) -> None:
    time, left = _broken(traces.fitted_time, traces.fitted_force - traces.predicted)
    axes.axhline(0, color="0.7", lw=0.8)
    axes.plot(time, left, color=_FITTED, lw=0.9)
    axes.set_xlabel("time [s]")
    axes.set_ylabel(_unit("misfit", traces.force_unit))


def _loop(axes: Any, traces: Traces) -> None:
    scale, unit = (1e3, "mm") if traces.position_unit == "m" else (1.0, traces.position_unit)
    _, position = _broken(traces.fitted_time, scale * traces.fitted_position)
    _, measured = _broken(traces.fitted_time, traces.fitted_force)
    _, predicted = _broken(traces.fitted_time, traces.predicted)
    # Lines between thinned samples would cross where no motion was, so many samples are dots.
    many = len(position) > _MANY
    style = {"ls": "", "marker": ".", "ms": 1.5, "mew": 0} if many else {"lw": 1.0}
    axes.plot(position, measured, color=_MEASURED, label="measured", **style)
    axes.plot(position, predicted, color=_FITTED, label="fit", **style)
    axes.set_xlabel(_unit("position from touch", unit))
    axes.set_ylabel(_unit("force", traces.force_unit))
    axes.legend(loc="best", frameon=False, fontsize=8)


def _broken(time: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Lines that are not drawn across the time between two contacts."""
    step = np.diff(time)
    gaps: np.ndarray | list[int] = np.flatnonzero(step > 3 * np.median(step)) + 1 if len(step) else []
    return np.insert(time, gaps, np.nan), np.insert(values, gaps, np.nan)
