"""Figure 3.7: gain of the second-order analog low-pass, from its component values."""

from collections.abc import Sequence
from itertools import product
from typing import NamedTuple

import numpy as np

from palpate.arrays import Array
from palpate.report import style
from palpate_thesis.claims import ThesisClaim, claim
from palpate_thesis.drawing import Figure
from palpate_thesis.runs import Runs

NUMBER = "3.7"
PARAMETERS = {"R1": 100.0, "R2": 1.5, "C1": 470e-6, "C2": 10e-6}
"""As printed, in ohm and farad; read as kilo-ohm and nanofarad they give the same gain."""
COMPONENTS = 0.05
"""Tolerance of a component."""
NEAR = 0.05
FREQUENCY = np.geomspace(10.0, 2000.0, 400)


class Data(NamedTuple):
    """The gain and its characteristic frequencies."""

    gain: Array  # [dB]
    low: Array  # least and most over the components' tolerances
    high: Array
    corner: float  # [Hz]
    quality: float
    cutoff: float  # -3 dB [Hz]
    cutoffs: tuple[float, float]  # over the components' tolerances
    resonance: float  # largest gain [dB]


def run(_: Runs) -> Data:
    """Nothing to be measured: the transfer function is printed."""
    values = np.array(list(PARAMETERS.values()))
    varied = [values * (1.0 + COMPONENTS * np.array(s)) for s in product((-1, 0, 1), repeat=4)]
    gains = np.array([_gain(v, FREQUENCY) for v in varied])
    cutoffs = [_cutoff(v) for v in varied]
    corner, quality = _corner(values)
    gain = _gain(values, FREQUENCY)
    return Data(
        gain=gain,
        low=gains.min(axis=0),
        high=gains.max(axis=0),
        corner=corner,
        quality=quality,
        cutoff=_cutoff(values),
        cutoffs=(min(cutoffs), max(cutoffs)),
        resonance=float(gain.max()),
    )


def _corner(values: Array) -> tuple[float, float]:
    """Corner frequency [Hz] and quality of T(s) as printed under fig. 3.6."""
    r1, r2, c1, c2 = values
    w0 = 1.0 / np.sqrt(r1 * r2 * c1 * c2)
    return float(w0 / (2.0 * np.pi)), float(w0 * r1 * r2 * c1 / (r1 + r2))


def gain_at(frequency: float) -> float:
    """Gain with the printed values at a frequency [Hz], in decibels."""
    return float(_gain(np.array(list(PARAMETERS.values())), np.array(frequency)))


def _gain(values: Array, frequency: Array) -> Array:
    corner, quality = _corner(values)
    s = 1j * frequency / corner
    return np.asarray(-20.0 * np.log10(np.abs(s * s + s / quality + 1.0)))


def _cutoff(values: Array) -> float:
    """Where half the power is left [Hz]: |T|^2 = 1/2 is quadratic in the frequency's square."""
    corner, quality = _corner(values)
    b = 1.0 / quality**2 - 2.0
    return float(corner * np.sqrt((-b + np.sqrt(b * b + 4.0)) / 2.0))


def check(data: Data) -> Sequence[ThesisClaim]:
    """The corner is where it was designed; the cut-off is not."""
    numbers = {"found": data, "decibels": 20.0 * np.log10(data.quality)}
    return [
        claim("anti-alias-components", abs(data.corner / 190.0 - 1.0) < NEAR, **numbers),
        claim("anti-alias-components.cutoff", abs(data.cutoff / 190.0 - 1.0) < NEAR, **numbers),
    ]


def plot(data: Data) -> Figure:
    """The gain, its asymptotes, and both frequencies."""
    drawing, (axis,) = style.figure(1, height=3.4)
    axis.fill_between(FREQUENCY, data.low, data.high, color=style.SERIES[0], alpha=0.15, linewidth=0.0)
    axis.plot(FREQUENCY, data.gain, color=style.SERIES[0], linewidth=1.6, label="gain")
    beyond = np.maximum(FREQUENCY / data.corner, 1.0)
    asymptotes = -40.0 * np.log10(beyond)
    axis.plot(FREQUENCY, asymptotes, "--", color=style.MEASURED, linewidth=1.0, label="asymptotes")
    axis.axvline(data.corner, color=style.OK, linewidth=1.0, label=f"corner {data.corner:.0f} Hz")
    axis.axvline(data.cutoff, color=style.FAIL, linewidth=1.0, label=f"-3 dB at {data.cutoff:.0f} Hz")
    axis.axhline(-3.01, color=style.FAIL, linewidth=0.8, linestyle=":")
    axis.set(
        xscale="log", xlabel="frequency [Hz]", ylabel="gain [dB]", xlim=(10.0, 2000.0), ylim=(-45.0, 5.0)
    )
    style.legend(axis)
    return drawing
