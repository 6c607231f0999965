"""Figures 6.7 to 6.9: the neural identifier in the first four seconds, on foam and on rubber, and its error."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from palpate.arrays import Array
from palpate.bench import Experiment
from palpate.identifiers.neural_probe import SETTINGS
from palpate.records import Record
from palpate.report import style
from palpate_thesis.claims import ThesisClaim
from palpate_thesis.least_squares import panels
from palpate_thesis.look import STATED, ZERO, Axes, Figure
from palpate_thesis.neural_identifier import claims, network
from palpate_thesis.neural_identifier.claims import SMALL, ClaimPart, Grounds, share
from palpate_thesis.neural_identifier.network import AMPLITUDES, WEIGHTS, NetworkAnswer, NetworkChoice
from palpate_thesis.runs import Runs

SHOWN_STARTS = 5
SLOW = NetworkChoice(amplitude=25.0, weights=0.01)
"""An amplitude just above the force and weights as small as those in the listing of the controller."""
CALM = 60
"""Milliseconds after which curves set the scale of a panel."""
NAMES = {"foam": "plain foam", "rubber": "rubber"}


class Data(NamedTuple):
    """Data of such a figure: a press, the answers of a few networks on it, and the grounds of the claims."""

    press: network.NetworkPress  # that of the first noise seed
    curves: list[Array]  # K, B, M and error of a few starts on it
    grounds: Grounds


def run(runs: Runs, experiment: Experiment, surface: str) -> Data:
    """One press a noise seed, all starts on each; then the network and the conditions varied."""
    some = network.presses(runs, experiment, surface)
    return Data(
        some[0],
        [
            network.learn(some[0], network.network_of(runs), start)[1]
            for start in network.STARTS[:SHOWN_STARTS]
        ],
        grounds(runs, experiment, surface, some),
    )


def grounds(
    runs: Runs, experiment: Experiment, surface: str, some: Sequence[network.NetworkPress]
) -> Grounds:
    """Grounds of the claims about a surface."""
    x = SETTINGS[surface].values[0]
    at_probe = experiment.approach.switch + runs.laboratory.of(experiment).surface.stiffness * x
    return Grounds(
        surface,
        network.answers(runs, some, network.network_of(runs)),
        network.sweep(runs, some),
        network.answers_under_conditions(runs, experiment, surface),
        at_probe / x / float(np.median([press.ratio for press in some])),
        len(network.starts(runs)),
    )


def plot(data: Data, parts: Sequence[ClaimPart], band: float) -> Figure:
    """Six panels as in the thesis; (g), (h) where in the sweep each part holds; (i) under conditions; (j) all answers.

    Args:
        data: of `run`.
        parts: of the claim.
        band: of K over f/x around 1 in which the claim holds.
    """
    drawing, axes = panels.grid(5)
    name = NAMES[data.grounds.surface]
    panels.six(axes[:6], {name: _record(data)}, "probe", (0.0, network.PRESS))
    _others(axes[1:6:2], data, panels.COLORS[name])
    panels.calm_limits(axes[4], 1e-3 * data.press.force[CALM:] / data.press.inputs[CALM:, 0])
    for axis, thresholds, letter in zip(axes[6:8], (True, False), "gh", strict=True):
        _map(axis, data.grounds.swept, parts, thresholds=thresholds)
        kind = "learn" if thresholds else "stay at zero"
        panels.set_title(axis, letter, f"Where each part holds; thresholds {kind}")
    _conditions(axes[8], data.grounds, parts)
    panels.set_title(axes[8], "i", "As chosen, under varied conditions")
    _cloud(axes[9], data.grounds, band)
    panels.set_title(axes[9], "j", "All answers; framed: where the claim would hold")
    return drawing


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
        for other in curves[1:]:
            axis.plot(t, other, color=color, linewidth=0.8, alpha=0.35)
        squares = scale * data.press.squares[:, "MBK".index(key)]
        axis.plot(t, squares, color=style.MEASURED, linewidth=1.0, linestyle="--")
        panels.calm_limits(axis, *(c[CALM:] for c in curves), squares[200:], margin=0.1)
    ratio = 1e-3 * np.full(len(t), data.press.ratio)
    axes[2].plot(t, ratio, color=style.SERIES[1], linewidth=1.0, linestyle=":")
    handles = [axes[2].lines[i] for i in (0, -2, -1)]
    labels = ("network, five starts", "least squares", "f/x at the end")
    axes[2].legend(handles, labels, ncols=3, loc="lower right")


def _map(
    axis: Axes,
    swept: Mapping[NetworkChoice, Sequence[NetworkAnswer]],
    parts: Sequence[ClaimPart],
    *,
    thresholds: bool,
) -> None:
    found = [swept[NetworkChoice(a, w, thresholds)] for a in AMPLITUDES for w in WEIGHTS]
    shares = np.array([[share(some, part) for some in found] for part in parts])
    _shares(axis, shares, [part.suffix for part in parts])
    n = len(WEIGHTS)
    for i in range(1, len(AMPLITUDES)):
        axis.axvline(i * n - 0.5, color=style.INK, linewidth=0.6)
    middles = [i * n + (n - 1) / 2 for i in range(len(AMPLITUDES))]
    axis.set_xticks(middles, [f"{a:g}" for a in AMPLITUDES])
    axis.set_xlabel(f"output amplitude [N]; within each, weights {WEIGHTS[0]:g} to {WEIGHTS[-1]:g}")


def _conditions(axis: Axes, grounds: Grounds, parts: Sequence[ClaimPart]) -> None:
    cases = {"as chosen": grounds.nominal, **grounds.varied}
    shares = np.array([[share(some, part) for some in cases.values()] for part in parts])
    _shares(axis, shares, [part.suffix for part in parts])
    axis.set_xticks(range(len(cases)), list(cases), rotation=38, ha="right")


def _shares(axis: Axes, shares: Array, rows: Sequence[str]) -> None:
    """Shares from 0 to 1 as shades; a dot where a claim holds."""
    axis.imshow(shares, aspect="auto", cmap="Greens", vmin=0.0, vmax=1.2, interpolation="nearest")
    row, column = np.nonzero(shares >= 0.9)
    axis.plot(column, row, ".", color=style.INK, markersize=4)
    axis.set_yticks(range(len(rows)), rows)
    axis.grid(visible=False)
    axis.tick_params(length=0)


def _cloud(axis: Axes, grounds: Grounds, band: float) -> None:
    from matplotlib.patches import Rectangle

    swept = {
        learns: [a for choice, some in grounds.swept.items() if choice.thresholds is learns for a in some]
        for learns in (True, False)
    }
    for some, color, label in (
        (swept[True], style.SERIES[0], "swept, thresholds learn"),
        (swept[False], style.SERIES[1], "swept, thresholds at zero"),
        (grounds.nominal, style.INK, "as chosen"),
    ):
        at, masses = np.array([(a.over, a.M) for a in some]).T
        axis.plot(at, masses, ".", color=color, markersize=3, label=label, alpha=0.7)
    axis.axvline(grounds.perfect, **ZERO, linestyle="--")
    frame: Any = {"fill": False, "edgecolor": style.FAIL, "zorder": 3}
    axis.add_patch(Rectangle((1.0 - band, 0.0), 2.0 * band, SMALL, **frame))
    axis.set(xlim=(0.5, 2.5), xlabel="$K_e$ over f/x (dashed: a network without error)", ylabel="$M_e$ [kg]")
    axis.set_yscale("symlog", linthresh=0.1)
    axis.legend(loc="center right", markerscale=3)


@dataclass(frozen=True, eq=False)
class NetworkFirstSeconds:
    """The figure of one surface."""

    NUMBER: str
    PARAMETERS: Experiment
    surface: str
    parts: Sequence[ClaimPart]  # of the thesis' claims
    band: float  # of K over f/x around 1 in which the claim holds

    def run(self, runs: Runs) -> Data:
        """One press a noise seed, ten starts on each."""
        return run(runs, self.PARAMETERS, self.surface)

    def check(self, data: Data) -> Sequence[ThesisClaim]:
        """Settling times and values of K, B and M."""
        return claims.claims(data.grounds, self.parts)

    def plot(self, data: Data) -> Figure:
        """The six panels, and where the claims hold."""
        return plot(data, self.parts, self.band)


@dataclass(frozen=True, eq=False)
class NetworkError(NetworkFirstSeconds):
    """The error of the output on foam, as chosen and of a network that learns slowly."""

    def plot(self, data: Data) -> Figure:
        """The error along a press, and when it is gone."""
        drawing, axes = panels.grid(2)
        slow = f"Error with amplitude {SLOW.amplitude:g} N, weights to {SLOW.weights:g}"
        for axis, error, letter, title in (
            (axes[0], data.curves[0][:, 3], "a", "Error as chosen: amplitude 40 N, weights to 0.5"),
            (axes[2], network.learn(data.press, SLOW, 0)[1][:, 3], "b", slow),
        ):
            axis.plot(np.arange(len(error)) * network.TICK, error, color=style.SERIES[0], linewidth=0.7)
            axis.axhspan(-network.GONE, network.GONE, color=style.OK, alpha=0.15, linewidth=0)
            axis.axvline(0.6, **STATED)
            axis.set(xlim=(0.0, network.PRESS), xlabel="time since 5 N [s]", ylabel="error [N]")
            panels.set_title(axis, letter, title)
        for axis, learns, letter in ((axes[1], True, "c"), (axes[3], False, "d")):
            _times(axis, data.grounds.swept, thresholds=learns)
            kind = "learn" if learns else "stay at zero"
            panels.set_title(axis, letter, f"Time until gone; thresholds {kind}")
        return drawing


def _times(axis: Axes, swept: Mapping[NetworkChoice, Sequence[NetworkAnswer]], *, thresholds: bool) -> None:
    for weights in WEIGHTS:
        found = [[a.error_gone for a in swept[NetworkChoice(a, weights, thresholds)]] for a in AMPLITUDES]
        axis.plot(
            AMPLITUDES, np.median(found, axis=1), "o-", markersize=3.5, linewidth=1.0, label=f"{weights:g}"
        )
    axis.axhspan(*claims.TIME, color=style.FAIL, alpha=0.12, linewidth=0)
    axis.set(xscale="log", yscale="log", xlabel="output amplitude [N]", ylabel="time [s]")
    axis.set_xticks(AMPLITUDES, [f"{a:g}" for a in AMPLITUDES])
    axis.minorticks_off()
    axis.legend(title="weights to", ncols=2)


FOAM = NetworkFirstSeconds("6.7", network.FOAM, "foam", claims.FOAM, claims.FOAM_BAND)
RUBBER = NetworkFirstSeconds("6.9", network.RUBBER, "rubber", claims.RUBBER, claims.RUBBER_BAND)
ERROR = NetworkError("6.8", network.FOAM, "foam", (claims.ERROR,), claims.FOAM_BAND)
STUDIES = (FOAM, ERROR, RUBBER)
