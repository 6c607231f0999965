"""Figures 6.7 to 6.9: the neural identifier in the first four seconds, on foam and on rubber, and its error."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from palpate.arrays import Array
from palpate.bench import Experiment
from palpate.records import Record
from palpate.report import style
from palpate_thesis.claims import ThesisClaim
from palpate_thesis.drawing import STATED, Axes, Figure
from palpate_thesis.drawing import panels as rows_of_panels
from palpate_thesis.least_squares import panels
from palpate_thesis.neural_identifier import claims, network
from palpate_thesis.neural_identifier.claims import ClaimPart
from palpate_thesis.neural_identifier.network import NetworkAnswer
from palpate_thesis.runs import Runs

SHOWN_STARTS = 5
CALM = 60
"""Milliseconds after which curves set the scale of a panel."""


class Data(NamedTuple):
    """Data of such a figure: a press, the answers of a few networks on it, and the answers of all runs."""

    surface: str
    press: network.NetworkPress  # that of the first noise seed
    curves: list[Array]  # K, B, M and error of a few starts on it
    answers: list[NetworkAnswer]


def _record(data: Data) -> Record:
    press, t = data.press, np.arange(len(data.press.force)) * network.TICK
    columns: dict[str, Any] = {
        "displacement": press.inputs[:, 0].copy(),
        "force_measured": press.force,
        "t": t,
    }
    columns |= {f"{key}_probe": data.curves[0][:, i].copy() for i, key in enumerate("KBM")}
    return Record(columns, dict.fromkeys(columns, ""), {})


def _others(axes: list[Axes], data: Data, color: str) -> None:
    """Other starts, and least squares, into the panels of M, B and K."""
    t = np.arange(len(data.press.force)) * network.TICK
    for axis, key, (_, scale) in zip(axes, "MBK", panels.PARAMETERS.values(), strict=True):
        column = "KBM".index(key)
        curves = [scale * curve[:, column] for curve in data.curves]
        for other in curves:
            axis.plot(t, other, color=color, linewidth=0.8, alpha=0.6)
        squares = scale * data.press.squares[:, "MBK".index(key)]
        axis.plot(t, squares, color=style.MEASURED, linewidth=1.0, linestyle="--")
        panels.calm_limits(axis, *(c[CALM:] for c in curves), squares[200:], margin=0.1)
    ratio = 1e-3 * np.full(len(t), data.press.ratio)
    axes[2].plot(t, ratio, color=style.SERIES[1], linewidth=1.0, linestyle=":")
    handles = [axes[2].lines[i] for i in (0, -2, -1)]
    labels = ("network, five starts", "least squares", "f/x at the end")
    axes[2].legend(handles, labels, ncols=3, loc="lower right")


@dataclass(frozen=True, eq=False)
class NetworkFigure:
    """A figure of the network on one surface."""

    NUMBER: str
    PARAMETERS: Experiment
    surface: str
    parts: Sequence[ClaimPart]  # of the thesis' claims

    def run(self, runs: Runs) -> Data:
        """One press a noise seed, all starts on each."""
        presses, chosen = network.presses(runs, self.PARAMETERS, self.surface), network.chosen_network(runs)
        starts = list(dict.fromkeys((*network.starts(runs), *network.STARTS)))[:SHOWN_STARTS]
        curves = [network.learn(presses[0], chosen, start)[1] for start in starts]
        return Data(self.surface, presses[0], curves, network.answers(runs, presses, chosen))

    def check(self, data: Data) -> Sequence[ThesisClaim]:
        """Settling times and values of K, B and M."""
        return claims.claims(self.surface, data.answers, self.parts)


class NetworkFirstSeconds(NetworkFigure):
    """Coefficients by the network in the first four seconds."""

    def plot(self, data: Data) -> Figure:
        """Six panels as in the thesis."""
        drawing, axes = panels.grid(3)
        panels.six(axes, data.surface, _record(data), "probe", (0.0, network.PRESS))
        for axis, (_, scale), i in zip(axes[1::2], panels.PARAMETERS.values(), (2, 1, 0), strict=True):
            panels.calm_limits(axis, scale * data.curves[0][CALM:, i])
        panels.calm_limits(axes[4], 1e-3 * data.press.force[CALM:] / data.press.inputs[CALM:, 0])
        return drawing

    def beside(self, data: Data) -> Figure:
        """M, B and K of five starts, by least squares (dashed), and f/x (dotted)."""
        drawing, rows = rows_of_panels([1.8, 1.8, 1.8])
        axes = [row[0] for row in rows]
        _others(axes, data, panels.COLORS[data.surface])
        for axis, (label, _) in zip(axes, panels.PARAMETERS.values(), strict=True):
            axis.set(ylabel=label, xlim=(0.0, network.PRESS), xlabel="time since 5 N [s]")
        return drawing


class NetworkError(NetworkFigure):
    """The error of the output on foam."""

    def plot(self, data: Data) -> Figure:
        """The error along a press."""
        error = data.curves[0][:, 3]
        drawing, ((axis,),) = rows_of_panels([2.6])
        axis.plot(np.arange(len(error)) * network.TICK, error, color=style.SERIES[0], linewidth=0.7)
        axis.axhspan(-network.GONE, network.GONE, color=style.OK, alpha=0.15, linewidth=0)
        axis.axvline(0.6, **STATED)
        axis.set(xlim=(0.0, network.PRESS), xlabel="time since 5 N [s]", ylabel="error [N]")
        return drawing


FOAM = NetworkFirstSeconds("6.7", network.FOAM, "foam", claims.FOAM)
RUBBER = NetworkFirstSeconds("6.9", network.RUBBER, "rubber", claims.RUBBER)
ERROR = NetworkError("6.8", network.FOAM, "foam", (claims.ERROR,))
STUDIES = (FOAM, ERROR, RUBBER)
