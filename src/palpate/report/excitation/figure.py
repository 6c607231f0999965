"""The figure of an excitation: the desired force, its spectrum, and the predicted uncertainty over the duration."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from palpate.arrays import Array
from palpate.excitation import Design
from palpate.references import Multisine
from palpate.report import style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLORS = {"K": style.K, "B": style.B, "M": style.M}

_SHOWN = 4.0  # s of the desired force; more would be a block of ink


def write_figure(found: Design, path: Path) -> Path:
    """Draw a design and write it as a PNG, atomically."""
    return style.save(draw(found), path)


def draw(found: Design) -> Figure:
    """The figure of a design."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.5, 6.2), dpi=style.DPI, layout="constrained")
    axes = figure.subplot_mosaic("tt;sp", height_ratios=(1.0, 1.25))
    for axis in axes.values():
        style.plain(axis)
    _force(axes["t"], found)
    _spectrum(axes["s"], found)
    _precision(axes["p"], found)
    return figure


def _force(axis: Axes, found: Design) -> None:
    budget = found.problem.budget
    time, force = found.force()
    shown = time <= found.settle + _SHOWN if isinstance(found.wave, Multisine) else np.full(len(time), True)
    low = min(prediction.force[0] for prediction in found.predictions)
    high = max(prediction.force[1] for prediction in found.predictions)
    axis.axhspan(low, high, color=style.F, alpha=0.12, linewidth=0, label="force on the surfaces")
    axis.plot(time[shown], force[shown], color=style.INK, linewidth=0.8, label="desired force")
    for limit in (budget.mean - budget.swing, budget.mean + budget.swing):
        axis.axhline(limit, **style.KNOWN)
    rest = "" if shown.all() else f", the first {time[shown][-1]:g} of {time[-1]:g} s"
    axis.set(xlabel=f"time [s]{rest}", ylabel="force [N]", xlim=(0, time[shown][-1]))
    style.legend(axis)


def _spectrum(axis: Axes, found: Design) -> None:
    frequencies, amplitudes, forces = lines_of(found)
    axis.fill_between(
        frequencies, forces.min(axis=0), forces.max(axis=0), color=style.F, alpha=0.2, linewidth=0,
        label="on the surfaces",
    )  # fmt: skip
    if isinstance(found.wave, Multisine):
        axis.vlines(frequencies, 0, amplitudes, color=style.INK, linewidth=0.7)
        axis.plot(
            frequencies, amplitudes, color=style.INK, marker="o", markersize=3, linestyle="", label="desired"
        )
    else:
        axis.plot(frequencies, amplitudes, color=style.INK, linewidth=0.8, label="desired")
    style.logarithmic(axis, "x")
    axis.set(xlabel="frequency [Hz]", ylabel="amplitude [N]")
    axis.set_ylim(bottom=0)
    style.legend(axis)


def lines_of(found: Design) -> tuple[Array, Array, Array]:
    """Frequencies [Hz], amplitudes of the desired force [N], and those on each surface, shapes (n,), (n,), (s, n)."""
    wave = found.wave
    if isinstance(wave, Multisine):
        frequencies, amplitudes = np.array(wave.frequencies), np.array(wave.amplitudes)
    else:
        frequencies = np.geomspace(wave.low, wave.high, 100)
        amplitudes = np.full(len(frequencies), wave.amplitude)
    return frequencies, amplitudes, np.abs(found.problem.forces(2 * np.pi * frequencies, amplitudes))


def curves(found: Design) -> tuple[Array, dict[str, Array]]:
    """Durations [s], shape (n,), and each parameter's 95 % half-width as a share, on each surface, shape (s, n)."""
    seconds = np.geomspace(0.1 * found.seconds, 5 * found.seconds, 40)
    names = found.predictions[0].names
    return seconds, {
        name: np.array([[one.half_widths(t)[name] for t in seconds] for one in found.predictions])
        for name in names
    }


def _precision(axis: Axes, found: Design) -> None:
    seconds, known = curves(found)
    for name, widths in known.items():
        axis.fill_between(
            seconds, 100 * widths.min(axis=0), 100 * widths.max(axis=0), color=COLORS[name], alpha=0.25,
            linewidth=0,
        )  # fmt: skip
        axis.plot(seconds, 100 * widths.max(axis=0), color=COLORS[name], linewidth=1.6, label=name)
        if name in found.problem.precision:
            asked = 100 * found.problem.precision[name]
            axis.plot(seconds[[0, -1]], [asked, asked], color=COLORS[name], linewidth=0.9, linestyle="--")
    axis.axvline(found.seconds, color=style.MEASURED, linewidth=0.9)
    for which in "xy":
        style.logarithmic(axis, which)
    axis.set(xlabel="duration [s]", ylabel="95 % half-width [%]")
    style.legend(axis, title="worst surface; dashed: requested", title_fontsize=8.5)
