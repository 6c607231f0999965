"""Figure 3.5: spectra of the force signal with and without the 190 Hz analog filter before the sampling."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from palpate.arrays import Array
from palpate.bench import load, with_values
from palpate.bench.summary import CONTACT
from palpate.instruments import analog_filter_190
from palpate.records import Record
from palpate.report import style
from palpate.signals.filters import Biquad
from palpate_thesis.claims import ThesisClaim, claim
from palpate_thesis.drawing import Axes, Figure
from palpate_thesis.least_squares.press_runs import nearer
from palpate_thesis.runs import Runs

NUMBER = "3.5"
PARAMETERS = with_values(nearer(load("foam-hybrid")), {"run.press": 14.0})
STEADY = 12.0
"""Seconds at the end of the press that are looked at [s]."""
SEGMENT = 500
"""Samples of a Welch segment: 2 Hz a line, some 50 segments."""
BAND = 120.0
ALMOST = 1.0
"""Almost the same [dB]; well under what an eye sees on a graph of 60 dB."""
TONES = (480.0, 960.0)
AMPLITUDE = 0.5
PHYSICS = 20000.0


class Data(NamedTuple):
    """Spectra, their differences, and tones."""

    frequency: Array  # [Hz]
    plain: Array  # spectrum of the first seed, unfiltered [N^2/Hz]
    filtered: Array
    apart: list[float]  # largest difference below 120 Hz of each seed [dB]
    lines: dict[str, Array]  # amplitudes of what a tone becomes at 1 kHz, by line [N]
    bins: Array  # their frequencies [Hz]


def run(runs: Runs) -> Data:
    """Two runs a seed, alike but for the filter."""
    by_filter = {on: with_values(PARAMETERS, {"force_sensor.analog_filter": on}) for on in (False, True)}
    spectra = list(zip(*runs.by_name(by_filter, _spectrum).values(), strict=True))
    bins, lines = tones_sampled()
    return Data(
        frequency=_frequency(),
        plain=spectra[0][0],
        filtered=spectra[0][1],
        apart=[_apart(*pair) for pair in spectra],
        lines=lines,
        bins=bins,
    )


def _spectrum(record: Record) -> Array:
    from scipy.signal import welch

    t = record["t"]
    steady = (record["phase"] == CONTACT) & (t > t[-1] - STEADY)
    _, power = welch(record["force_sampled"][steady], fs=1000.0, nperseg=SEGMENT)
    return np.asarray(power)


def _frequency() -> Array:
    """Frequencies of the spectra's lines [Hz]."""
    return np.arange(SEGMENT // 2 + 1, dtype=float) * (1000.0 / SEGMENT)


def _apart(plain: Array, filtered: Array) -> float:
    """Largest difference of a line below 120 Hz, steady force aside [dB]."""
    frequency = _frequency()
    inside = (frequency > 0.0) & (frequency < BAND)
    return float(np.max(np.abs(10.0 * np.log10(filtered[inside] / plain[inside]))))


def tones_sampled() -> tuple[Array, dict[str, Array]]:
    """A tone of 480 Hz and one of 960 Hz, sampled at 1 kHz, through the filter and past it."""
    from scipy.signal import lfilter

    t = np.arange(round(PHYSICS)) / PHYSICS
    filter_190: Biquad = analog_filter_190(PHYSICS)
    b, a = (filter_190.b0, filter_190.b1, filter_190.b2), (1.0, filter_190.a1, filter_190.a2)
    lines = {}
    for tone in TONES:
        line = AMPLITUDE * np.sin(2.0 * np.pi * tone * t + 0.3)
        lines[f"{tone:g} Hz"] = _amplitudes(line)
        lines[f"{tone:g} Hz, filtered"] = _amplitudes(np.asarray(lfilter(b, a, line)))
    return _frequency(), lines


def _amplitudes(line: Array) -> Array:
    sampled = line[:: round(PHYSICS / 1e3)][-SEGMENT:]
    return 2.0 * np.abs(np.fft.rfft(sampled)) / SEGMENT


def check(data: Data) -> Sequence[ThesisClaim]:
    """Agreement below 120 Hz; where 480 Hz goes."""
    return [
        claim("anti-alias-spectra", bool(np.median(data.apart) <= ALMOST), apart=data.apart, almost=ALMOST),
        _folding(data),
    ]


def _folding(data: Data) -> ThesisClaim:
    stays = _peak(data, "480 Hz")
    folds, past = _peak(data, "960 Hz"), _peak(data, "960 Hz, filtered")
    loss = 20.0 * np.log10(past[1] / folds[1])
    return claim("anti-alias-spectra.aliasing", stays[0] < BAND, stays=stays[0], folds=folds[0], gain=-loss)


def _peak(data: Data, line: str) -> tuple[float, float]:
    at = int(np.argmax(data.lines[line]))
    return float(data.bins[at]), float(data.lines[line][at])


def plot(data: Data) -> Figure:
    """Both spectra, and the tones."""
    drawing, (left, right) = style.grid((9.0, 4.1), 1, 2, width_ratios=(1.6, 1.0))
    _spectra(left, data)
    _draw_folding(right, data)
    return drawing


def _spectra(axis: Axes, data: Data) -> None:
    shown = data.frequency > 0.0
    for power, color, label in (
        (data.plain, style.MEASURED, "without filter"),
        (data.filtered, style.SERIES[0], "with the 190 Hz filter"),
    ):
        decibels = 10.0 * np.log10(power[shown])
        axis.plot(data.frequency[shown], decibels, color=color, linewidth=1.2, label=label)
    axis.axvspan(0.0, BAND, color=style.OK, alpha=0.08, linewidth=0.0)
    axis.text(5.0, -53.0, "below 120 Hz", color=style.OK)
    axis.set(xlabel="frequency [Hz]", ylabel="power density [dB re 1 N²/Hz]", xlim=(0.0, 500.0))
    style.legend(axis)


def _draw_folding(axis: Axes, data: Data) -> None:
    for line in data.lines:
        frequency, amplitude = _peak(data, line)
        aside, alpha = (8.0, 0.45) if "filtered" in line else (0.0, 1.0)
        color = style.SERIES[1] if line.startswith("480") else style.FAIL
        bar: dict[str, Any] = {"color": color, "linewidth": 3.5, "alpha": alpha, "label": line}
        axis.vlines(frequency + aside, 0.0, amplitude, **bar)
    axis.axvspan(0.0, BAND, color=style.OK, alpha=0.08, linewidth=0.0)
    axis.set(xlabel="read at [Hz]", ylabel="amplitude [N]", xlim=(0.0, 500.0), ylim=(0.0, 0.6))
    axis.legend(loc="upper center")
