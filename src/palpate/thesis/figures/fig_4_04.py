"""Figure 4.4: the noise of the force signal."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from palpate.arrays import Array
from palpate.bench import changed, load
from palpate.bench.sequence import CONTACT
from palpate.records import Record
from palpate.report import style
from palpate.thesis.claims import Claim, decided, spread
from palpate.thesis.runs import Runs

if TYPE_CHECKING:
    from matplotlib.figure import Figure

NUMBER = "4.4"
TITLE = "Noise of the force signal"
CAPTION = (
    "Force as sampled and as filtered at 120 Hz while the arm presses steadily with 20 N. "
    "The thesis calls its noise about ±2 N."
)
PARAMETERS = changed(load("foam-hybrid"), {"run.press": 8.0})
STEADY = 2.0
"""Seconds at the end of the press that are looked at [s]."""


@dataclass(frozen=True)
class Data:
    """Steady force, and its noise over the seeds."""

    t: Array
    sampled: Array
    filtered: Array
    half_range: list[float]  # of the sampled noise, one a seed [N]
    filtered_half_range: list[float]


def run(runs: Runs) -> Data:
    """One steady press a seed."""
    t, sampled, filtered = _steady(runs.one(PARAMETERS))
    ranges = runs.over_seeds(PARAMETERS, half_ranges)
    return Data(t, sampled, filtered, [r[0] for r in ranges], [r[1] for r in ranges])


def check(data: Data) -> Sequence[Claim]:
    """The half-range has to be 2 N within a quarter."""
    middle = float(np.median(data.half_range))
    return [
        Claim(
            id="force-noise",
            source="fig. 4.4, ch. 4",
            claim="The force signal carries noise of about ±2 N.",
            thesis="±2 N",
            measured=f"±{spread(data.half_range, 'N')}; filtered ±{spread(data.filtered_half_range, 'N')}",
            tolerance="half of peak-to-peak over two steady seconds between 1.5 and 2.5 N",
            verdict=decided(1.5 <= middle <= 2.5),
            note=(
                "White noise of 0.6 N at each of the sensor's samples was chosen to give this result: agreement shows "
                "that the chain passes the noise on, and not the origin of the thesis' noise. The thesis does not "
                "state its spectrum, and this figure confirms none."
            ),
        )
    ]


def plot(data: Data) -> Figure:
    """Half a second of both signals."""
    drawing, (axis,) = style.figure(1, height=3.0)
    shown = data.t < data.t[0] + 0.5
    t = data.t[shown] - data.t[0]
    axis.plot(t, data.sampled[shown], color=style.MEASURED, linewidth=0.9, label="as sampled")
    axis.plot(t, data.filtered[shown], color=style.SERIES[0], linewidth=1.4, label="filtered at 120 Hz")
    axis.set(xlabel="time [s]", ylabel="force [N]")
    style.legend(axis)
    return drawing


def _steady(record: Record) -> tuple[Array, Array, Array]:
    t = record["t"]
    last = (record["phase"] == CONTACT) & (t > t[-1] - STEADY)
    return t[last], record["force_sampled"][last], record["force_measured"][last]


def half_ranges(record: Record) -> tuple[float, float]:
    """Half of peak-to-peak of the sampled and of the filtered force at the end of a run [N]."""
    _, sampled, filtered = _steady(record)
    return float(np.ptp(sampled)) / 2, float(np.ptp(filtered)) / 2
