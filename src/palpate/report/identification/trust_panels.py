"""Whether what a model leaves is noise: its spectrum against that of white noise."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from palpate.identification.result import Identification, Traces
from palpate.report import style
from palpate.report.identification.fit_panels import empty
from palpate.report.identification.spectra import band_of, leaving, resting, white

if TYPE_CHECKING:
    from matplotlib.axes import Axes


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
