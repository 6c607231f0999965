"""Figures 3.5 and 3.7: the 190 Hz analog filter, by the spectra of the force signal and by its component values."""

from collections.abc import Sequence
from itertools import product
from typing import NamedTuple

import numpy as np

from palpate.arrays import Array
from palpate.bench import load, with_values
from palpate.bench.summary import CONTACT
from palpate.records import Record
from palpate.report import style
from palpate_thesis.claims import ThesisClaim, claim
from palpate_thesis.drawing import Figure
from palpate_thesis.least_squares.press_runs import nearer
from palpate_thesis.runs import Runs

PARAMETERS = {"R1": 100.0, "R2": 1.5, "C1": 470e-6, "C2": 10e-6}
"""As printed, in ohm and farad; read as kilo-ohm and nanofarad they give the same gain."""
PRINTED = np.array(list(PARAMETERS.values()))
COMPONENTS = NEAR = 0.05
"""Tolerance of a component, and of a frequency from the printed one."""
FREQUENCY = np.geomspace(10.0, 2000.0, 400)
STEADY = 12.0
"""Seconds at the end of the press that are looked at [s]."""
RATE, SEGMENT = 1000.0, 500
"""Sampling [Hz], and samples of a Welch segment: 2 Hz a line, some 50 segments."""
LINES = np.arange(SEGMENT // 2 + 1, dtype=float) * (RATE / SEGMENT)
BAND, ALMOST = 120.0, 1.0
"""Frequencies [Hz] in which spectra are almost the same [dB]: well under what an eye sees on a graph of 60 dB."""
TONE, HARMONIC = 480.0, 960.0


class Gain(NamedTuple):
    """The gain over `FREQUENCY` and its characteristic frequencies."""

    gain: Array  # [dB]
    low: Array  # least and most over the components' tolerances
    high: Array
    corner: float  # [Hz]
    quality: float
    cutoff: float  # -3 dB [Hz]
    cutoffs: tuple[float, float]  # over the components' tolerances
    resonance: float  # largest gain [dB]


def _corner(values: Array) -> tuple[float, float]:
    """Corner frequency [Hz] and quality of T(s) as printed under fig. 3.6."""
    r1, r2, c1, c2 = values
    w0 = 1.0 / np.sqrt(r1 * r2 * c1 * c2)
    return float(w0 / (2.0 * np.pi)), float(w0 * r1 * r2 * c1 / (r1 + r2))


def gain_at(frequency: float | Array, values: Array = PRINTED) -> Array:
    """Gain at a frequency [Hz] in decibels, with the printed values or others."""
    corner, quality = _corner(values)
    s = 1j * np.asarray(frequency) / corner
    return np.asarray(-20.0 * np.log10(np.abs(s * s + s / quality + 1.0)))


def _cutoff(values: Array) -> float:
    """Where half the power is left [Hz]: |T|^2 = 1/2 is quadratic in the frequency's square."""
    corner, quality = _corner(values)
    b = 1.0 / quality**2 - 2.0
    return float(corner * np.sqrt((-b + np.sqrt(b * b + 4.0)) / 2.0))


class Components:
    """Figure 3.7: gain of the second-order analog low-pass, from its component values."""

    NUMBER = "3.7"

    def run(self, _: Runs) -> Gain:
        """Nothing to be measured: the transfer function is printed."""
        varied = [PRINTED * (1.0 + COMPONENTS * np.array(s)) for s in product((-1, 0, 1), repeat=4)]
        gains, cutoffs = np.array([gain_at(FREQUENCY, v) for v in varied]), [_cutoff(v) for v in varied]
        gain, ends = gain_at(FREQUENCY), (min(cutoffs), max(cutoffs))
        low, high = gains.min(axis=0), gains.max(axis=0)
        return Gain(gain, low, high, *_corner(PRINTED), _cutoff(PRINTED), ends, float(gain.max()))

    def check(self, data: Gain) -> Sequence[ThesisClaim]:
        """The corner is where it was designed; the cut-off is not."""
        numbers = {"found": data, "decibels": 20.0 * np.log10(data.quality)}
        return [
            claim("anti-alias-components", abs(data.corner / 190.0 - 1.0) < NEAR, **numbers),
            claim("anti-alias-components.cutoff", abs(data.cutoff / 190.0 - 1.0) < NEAR, **numbers),
        ]

    def plot(self, data: Gain) -> Figure:
        """The gain, its asymptotes, and both frequencies."""
        drawing, (axis,) = style.figure(1, height=3.4)
        axis.fill_between(FREQUENCY, data.low, data.high, color=style.SERIES[0], alpha=0.15, linewidth=0.0)
        axis.plot(FREQUENCY, data.gain, color=style.SERIES[0], linewidth=1.6, label="gain")
        asymptotes = -40.0 * np.log10(np.maximum(FREQUENCY / data.corner, 1.0))
        axis.plot(FREQUENCY, asymptotes, "--", color=style.MEASURED, linewidth=1.0, label="asymptotes")
        axis.axvline(data.corner, color=style.OK, linewidth=1.0, label=f"corner {data.corner:.0f} Hz")
        axis.axvline(data.cutoff, color=style.FAIL, linewidth=1.0, label=f"-3 dB at {data.cutoff:.0f} Hz")
        axis.axhline(-3.01, color=style.FAIL, linewidth=0.8, linestyle=":")
        axis.set(xscale="log", xlabel="frequency [Hz]", ylabel="gain [dB]", xlim=(10.0, 2000.0))
        axis.set_ylim(-45.0, 5.0)
        style.legend(axis)
        return drawing


def sampled_at(frequency: float) -> float:
    """Frequency at which a tone is read after the sampling [Hz]."""
    return abs(frequency - RATE * round(frequency / RATE))


class Spectra:
    """Figure 3.5: spectra of the force signal with and without the filter before the sampling."""

    NUMBER = "3.5"
    PARAMETERS = with_values(nearer(load("foam-hybrid")), {"run.press": 14.0})

    def run(self, runs: Runs) -> dict[str, list[Array]]:
        """Spectra of two runs a seed, alike but for the filter [N^2/Hz], a value for each of `LINES`."""
        filters = {"without filter": False, "with the 190 Hz filter": True}
        return runs.by_name(
            {
                n: with_values(self.PARAMETERS, {"force_sensor.analog_filter": on})
                for n, on in filters.items()
            },
            _spectrum,
        )

    def check(self, data: dict[str, list[Array]]) -> Sequence[ThesisClaim]:
        """Agreement below 120 Hz, steady force aside; and where 480 Hz goes."""
        inside = (LINES > 0.0) & (LINES < BAND)
        decibels = (10.0 * np.log10(np.array(spectra)[:, inside]) for spectra in data.values())
        apart = list(np.abs(np.subtract(*decibels)).max(axis=1))
        stays, folds, loss = sampled_at(TONE), sampled_at(HARMONIC), -float(gain_at(HARMONIC))
        return [
            claim("anti-alias-spectra", bool(np.median(apart) <= ALMOST), apart=apart, almost=ALMOST),
            claim("anti-alias-spectra.aliasing", stays < BAND, stays=stays, folds=folds, gain=loss),
        ]

    def plot(self, data: dict[str, list[Array]]) -> Figure:
        """Both spectra of the first seed over the frequency."""
        drawing, (axis,) = style.figure(1, height=3.4)
        for (name, spectra), color in zip(data.items(), (style.MEASURED, style.SERIES[0]), strict=True):
            axis.plot(LINES[1:], 10.0 * np.log10(spectra[0][1:]), color=color, linewidth=1.2, label=name)
        axis.axvspan(0.0, BAND, color=style.OK, alpha=0.08, linewidth=0.0)
        axis.text(5.0, -53.0, "below 120 Hz", color=style.OK)
        axis.set(xlabel="frequency [Hz]", ylabel="power density [dB re 1 N²/Hz]", xlim=(0.0, RATE / 2))
        style.legend(axis)
        return drawing


def _spectrum(record: Record) -> Array:
    from scipy.signal import welch

    t = record["t"]
    steady = (record["phase"] == CONTACT) & (t > t[-1] - STEADY)
    _, power = welch(record["force_sampled"][steady], fs=RATE, nperseg=SEGMENT)
    return np.asarray(power)


STUDIES = (Spectra(), Components())
