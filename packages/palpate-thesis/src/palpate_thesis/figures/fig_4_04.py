"""Figure 4.4: the noise of the force signal."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from palpate.arrays import Array
from palpate.bench import load, with_values
from palpate.bench.summary import CONTACT
from palpate.records import Record
from palpate.report import style
from palpate_thesis.claims import ThesisClaim, claim
from palpate_thesis.drawing import Figure
from palpate_thesis.runs import Runs

NUMBER = "4.4"
PARAMETERS = with_values(load("foam-hybrid"), {"run.press": 8.0})
STEADY = 2.0
"""Seconds at the end of the press that are looked at [s]."""


class Data(NamedTuple):
    """Steady force, and its noise over the seeds."""

    t: Array
    sampled: Array
    filtered: Array
    half_range: list[float]  # of the sampled noise, one a seed [N]
    filtered_half_range: list[float]


def run(runs: Runs) -> Data:
    """One steady press a seed."""
    t, sampled, filtered = _steady(runs.record(PARAMETERS))
    ranges = runs.over_seeds(PARAMETERS, half_ranges)
    return Data(t, sampled, filtered, [r[0] for r in ranges], [r[1] for r in ranges])


def check(data: Data) -> Sequence[ThesisClaim]:
    """The half-range has to be 2 N within a quarter."""
    middle = float(np.median(data.half_range))
    return [
        claim(
            "force-noise",
            1.5 <= middle <= 2.5,
            half_range=data.half_range,
            filtered_half_range=data.filtered_half_range,
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
