"""Panels that show how far to trust a fit: the misfit's spectrum, how the estimates settled, what was excited."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from palpate.identification.result import Identification, Parameter, Traces, Verdict
from palpate.report import style
from palpate.report.identification_fit import FITTED, labelled
from palpate.report.identification_growth import Growth
from palpate.report.identification_spectra import band_of, leaving, moving, resting, white

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = NDArray[np.float64]

COLOURS = {"K": style.VIOLET, "B": style.ORANGE, "M": style.GREEN, "K1": style.BLUE, "Fc": style.SAND}
SHOWN = ("K", "B", "M", "K1", "Fc")
"""The parameters whose settling is drawn, most telling first."""
_AROUND = 6.0
"""Interval widths about the last estimate that are shown."""


def residual_spectrum(axes: Axes, found: Identification, traces: Traces) -> None:
    """The spectrum of what is left, against white noise of the same power behind the same filters."""
    left = leaving(found, traces)
    if left is None or left.power == 0:
        empty(axes, "too short a contact for a spectrum")
        return
    expected, low, high = (np.sqrt(d) for d in white(left, band_of(found, traces)))
    axes.fill_between(
        left.frequency, low, high, color=style.GREY, alpha=0.25, lw=0, label="white noise, 95 %"
    )
    axes.plot(left.frequency, expected, color=style.GREY, lw=1)
    axes.plot(left.frequency, np.sqrt(left.density), color=FITTED, lw=1.4, label="misfit")
    rest = resting(found, traces)
    if rest is not None:
        axes.plot(
            rest.frequency, np.sqrt(rest.density), color=style.BLUE, lw=1.2, ls=":", label="out of contact"
        )
    _by_frequency(axes)
    axes.set_ylim(bottom=max(float(low.min()), 1e-2 * float(np.sqrt(left.density).min())) / 2)
    style.logarithmic(axes, "y")
    axes.set_ylabel(f"misfit [{'' if traces.force_unit == '1' else traces.force_unit}/√Hz]")
    style.legend(axes)


def settling(axes: Axes, found: Identification, name: str, grown: Growth) -> None:
    """How one parameter's estimate and its 95 % interval settled as the data came in."""
    said = found.parameters.get(name)
    colour = COLOURS.get(name, style.BLUE)
    trusted = said is not None and said.verdict is Verdict.IDENTIFIED
    axes.fill_between(
        grown.time, grown.low, grown.high, color=colour, alpha=0.22, lw=0, label="95 % interval"
    )
    axes.plot(grown.time, grown.value, color=colour, lw=1.5, ls="-" if trusted else "--")
    if said is not None and said.value is not None and said.ci95 is not None:
        ends = [[said.value - said.ci95[0]], [said.ci95[1] - said.value]]
        axes.errorbar(
            [grown.time[-1]],
            [said.value],
            yerr=ends,
            fmt="o",
            ms=4,
            capsize=3,
            color=style.INK,
            clip_on=False,
        )
    axes.set_ylim(*_around_the_end(grown, said))
    axes.set_ylabel(labelled(name, said.unit if said else "1"))


def excitation(axes: Axes, found: Identification, traces: Traces) -> None:
    """The force that each term of the model moves, by frequency, above what is left: where each shows itself."""
    moved, left = moving(found, traces), leaving(found, traces)
    if not moved or left is None:
        empty(axes, "too short a contact for a spectrum")
        return
    floor = left.amplitude
    for name, own in moved.items():
        said = found.parameters.get(name)
        trusted = said is not None and said.verdict is Verdict.IDENTIFIED
        axes.plot(
            own.frequency, own.amplitude, color=COLOURS.get(name, style.BLUE), lw=1.8,
            ls="-" if trusted else (0, (4, 2)), label=name,
        )  # fmt: skip
    bottom = max(float(floor.min()) / 3, 1e-6 * max(float(own.amplitude.max()) for own in moved.values()))
    axes.fill_between(
        left.frequency, bottom, np.maximum(floor, bottom), color=style.GREY, alpha=0.3, lw=0, label="misfit"
    )
    _by_frequency(axes)
    axes.set_ylim(bottom=bottom)
    style.logarithmic(axes, "y")
    axes.set_ylabel(
        f"force by third-octave band{'' if traces.force_unit == '1' else f' [{traces.force_unit}]'}"
    )
    style.legend(axes)


def shares(axes: Axes, found: Identification, traces: Traces) -> None:
    """Which term carries the force at each frequency, where the terms stand above the misfit at all."""
    moved, left = moving(found, traces), leaving(found, traces)
    if not moved or left is None:
        empty(axes, "")
        return
    power = np.stack([own.density for own in moved.values()])
    part = 100 * power / np.maximum(power.sum(0), 1e-300)
    seen = power.sum(0) > left.density
    axes.stackplot(left.frequency, part, colors=[COLOURS.get(n, style.BLUE) for n in moved], alpha=0.75, lw=0)
    _veil(axes, left.frequency, seen)
    _by_frequency(axes)
    axes.set(ylabel="share [%]", ylim=(0, 100))
    for i, name in enumerate(moved):
        _written_in(axes, name, left.frequency, part[:i].sum(0), np.where(seen, part[i], 0.0))


def empty(axes: Axes, why: str) -> None:
    """A panel with nothing to draw says so."""
    axes.text(0.5, 0.5, why, ha="center", va="center", transform=axes.transAxes, color=style.GREY)
    axes.set_axis_off()


def settled(grown: Mapping[str, Growth]) -> Sequence[str]:
    """The parameters whose settling is shown, in order."""
    return [name for name in SHOWN if name in grown]


def _around_the_end(grown: Growth, said: Parameter | None) -> tuple[float, float]:
    """Where the estimate comes to rest, not where it comes from; with zero in sight unless the number is trusted."""
    late = slice(len(grown.time) // 3, None)
    last, below, above = (float(line[-1]) for line in (grown.value, grown.low, grown.high))
    reach = max(above - below, 1e-12 * abs(last)) * _AROUND
    low = max(float(grown.low[late].min()), last - reach)
    high = min(float(grown.high[late].max()), last + reach)
    if said is None or said.verdict is not Verdict.IDENTIFIED:
        low, high = min(low, 0.0), max(high, 0.0)
    elif said.ci95 is not None:
        low, high = min(low, said.ci95[0]), max(high, said.ci95[1])
    margin = 0.12 * (high - low)
    return low - margin, high + margin


def _by_frequency(axes: Axes) -> None:
    axes.set_xlabel("frequency [Hz]")
    style.logarithmic(axes, "x")


def _veil(axes: Axes, frequency: Array, seen: NDArray[np.bool_]) -> None:
    """Cover the frequencies at which nothing of the terms is seen."""
    if not seen.all():
        axes.fill_between(
            frequency,
            0,
            100,
            where=~seen,
            step="mid",
            color=style.VEIL,
            lw=0,
            label="below the misfit",
        )


def _written_in(axes: Axes, name: str, frequency: Array, below: Array, own: Array) -> None:
    """The parameter's letter where its share is largest."""
    most = float(own.max())
    if most < 20:
        return
    wide = np.flatnonzero(own > 0.8 * most)
    index = int(np.clip(wide[len(wide) // 2], 1, len(own) - 2))
    place = float(below[index] + own[index] / 2)
    axes.text(
        frequency[index], place, name, ha="center", va="center", fontweight="bold", color="white", fontsize=9
    )
