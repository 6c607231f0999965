"""Figure 3.5: spectra of the force signal with and without the 190 Hz analog filter before the sampling."""

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
from palpate_thesis.figures import fig_3_07
from palpate_thesis.least_squares.press_runs import nearer
from palpate_thesis.runs import Runs

NUMBER = "3.5"
PARAMETERS = with_values(nearer(load("foam-hybrid")), {"run.press": 14.0})
STEADY = 12.0
"""Seconds at the end of the press that are looked at [s]."""
RATE, SEGMENT = 1000.0, 500
"""Sampling [Hz], and samples of a Welch segment: 2 Hz a line, some 50 segments."""
FREQUENCY = np.arange(SEGMENT // 2 + 1, dtype=float) * (RATE / SEGMENT)
BAND = 120.0
ALMOST = 1.0
"""Almost the same [dB]; well under what an eye sees on a graph of 60 dB."""
TONE, HARMONIC = 480.0, 960.0


class Data(NamedTuple):
    """Spectra and their differences."""

    plain: Array  # spectrum of the first seed, unfiltered [N^2/Hz]
    filtered: Array
    apart: list[float]  # largest difference below 120 Hz of each seed [dB]


def run(runs: Runs) -> Data:
    """Two runs a seed, alike but for the filter."""
    by_filter = {on: with_values(PARAMETERS, {"force_sensor.analog_filter": on}) for on in (False, True)}
    pairs = list(zip(*runs.by_name(by_filter, _spectrum).values(), strict=True))
    plain, filtered = pairs[0]
    return Data(plain, filtered, [_apart(*pair) for pair in pairs])


def _spectrum(record: Record) -> Array:
    from scipy.signal import welch

    t = record["t"]
    steady = (record["phase"] == CONTACT) & (t > t[-1] - STEADY)
    _, power = welch(record["force_sampled"][steady], fs=RATE, nperseg=SEGMENT)
    return np.asarray(power)


def _apart(plain: Array, filtered: Array) -> float:
    """Largest difference of a line below 120 Hz, steady force aside [dB]."""
    inside = (FREQUENCY > 0.0) & (FREQUENCY < BAND)
    return float(np.max(np.abs(10.0 * np.log10(filtered[inside] / plain[inside]))))


def sampled_at(frequency: float) -> float:
    """Frequency at which a tone is read after the sampling [Hz]."""
    return abs(frequency - RATE * round(frequency / RATE))


def check(data: Data) -> Sequence[ThesisClaim]:
    """Agreement below 120 Hz; where 480 Hz goes."""
    loss = -float(fig_3_07.gain_at(HARMONIC))
    stays, folds = sampled_at(TONE), sampled_at(HARMONIC)
    return [
        claim("anti-alias-spectra", bool(np.median(data.apart) <= ALMOST), apart=data.apart, almost=ALMOST),
        claim("anti-alias-spectra.aliasing", stays < BAND, stays=stays, folds=folds, gain=loss),
    ]


def plot(data: Data) -> Figure:
    """Both spectra over the frequency."""
    drawing, (axis,) = style.figure(1, height=3.4)
    shown = FREQUENCY > 0.0
    for power, color, label in (
        (data.plain, style.MEASURED, "without filter"),
        (data.filtered, style.SERIES[0], "with the 190 Hz filter"),
    ):
        decibels = 10.0 * np.log10(power[shown])
        axis.plot(FREQUENCY[shown], decibels, color=color, linewidth=1.2, label=label)
    axis.axvspan(0.0, BAND, color=style.OK, alpha=0.08, linewidth=0.0)
    axis.text(5.0, -53.0, "below 120 Hz", color=style.OK)
    axis.set(xlabel="frequency [Hz]", ylabel="power density [dB re 1 N²/Hz]", xlim=(0.0, RATE / 2))
    style.legend(axis)
    return drawing
