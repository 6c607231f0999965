"""Figure 6.8: the error of the neural identifier's output on styrofoam."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from palpate.arrays import Array
from palpate.report import style
from palpate_thesis.claims import ThesisClaim, texts
from palpate_thesis.figures import fig_6_07_09 as first_seconds
from palpate_thesis.least_squares import panels
from palpate_thesis.look import Axes, Figure
from palpate_thesis.neural_identifier import claims, network
from palpate_thesis.neural_identifier.network import AMPLITUDES, WEIGHTS, NetworkChoice
from palpate_thesis.runs import Runs

NUMBER = "6.8"
TITLE, CAPTION = texts(NUMBER)
PARAMETERS = network.FOAM
NEAR = NetworkChoice(amplitude=25.0, weights=0.01)
"""An amplitude just above the force and weights as small as those in the listing of the controller."""


@dataclass(frozen=True)
class Data:
    """Data of the figure: the answers of figure 6.7, and the error of a network that learns slowly."""

    shown: first_seconds.Data
    near: Array  # error of the network that learns slowly [N]


def run(runs: Runs) -> Data:
    """The runs of figure 6.7, and a network that learns slowly."""
    shown = first_seconds.run(runs, PARAMETERS, "foam")
    return Data(shown, network.learn(shown.press, NEAR, 0)[1][:, 3])


def check(data: Data) -> Sequence[ThesisClaim]:
    """When the error is almost zero."""
    return claims.claims(data.shown.grounds, (claims.ERROR,))


def plot(data: Data) -> Figure:
    """The error along a press, and when it is gone."""
    drawing, axes = panels.grid(2)
    for axis, error, letter, title in (
        (axes[0], data.shown.curves[0][:, 3], "a", "Error as chosen: amplitude 40 N, weights to 0.5"),
        (axes[2], data.near, "b", f"Error with amplitude {NEAR.amplitude:g} N, weights to {NEAR.weights:g}"),
    ):
        axis.plot(np.arange(len(error)) * network.TICK, error, color=style.SERIES[0], linewidth=0.7)
        axis.axhspan(-network.GONE, network.GONE, color=style.OK, alpha=0.15, linewidth=0)
        axis.axvline(0.6, color=style.FAIL, linewidth=0.9, linestyle=":")
        axis.set(xlim=(0.0, network.PRESS), xlabel="time since 5 N [s]", ylabel="error [N]")
        panels.set_title(axis, letter, title)
    for axis, thresholds, letter in ((axes[1], True, "c"), (axes[3], False, "d")):
        _times(axis, data, thresholds=thresholds)
        panels.set_title(
            axis, letter, f"Time until gone; thresholds {'learn' if thresholds else 'stay at zero'}"
        )
    return drawing


def _times(axis: Axes, data: Data, *, thresholds: bool) -> None:
    colors = style.SERIES[:5]
    swept = data.shown.grounds.swept
    for weights, color in zip(WEIGHTS, colors, strict=True):
        found = [[a.error_gone for a in swept[NetworkChoice(a, weights, thresholds)]] for a in AMPLITUDES]
        middle = np.median(found, axis=1)
        axis.plot(AMPLITUDES, middle, "o-", color=color, markersize=3.5, linewidth=1.0, label=f"{weights:g}")
    axis.axhspan(*claims.TIME, color=style.FAIL, alpha=0.12, linewidth=0)
    axis.set(xscale="log", yscale="log", xlabel="output amplitude [N]", ylabel="time [s]")
    axis.set_xticks(AMPLITUDES, [f"{a:g}" for a in AMPLITUDES])
    axis.minorticks_off()
    axis.legend(title="weights to", ncols=2)
