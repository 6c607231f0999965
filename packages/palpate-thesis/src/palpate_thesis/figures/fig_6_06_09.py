"""Figures 6.6 to 6.9: the neural identifier's learning rate, its first four seconds on foam and rubber, its error."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from palpate.arrays import Array
from palpate.bench import Experiment
from palpate.identifiers.neural_probe import SETTINGS
from palpate.records import Record
from palpate.report import style
from palpate_thesis.claims import Sentence, ThesisClaim, claim, often, spread
from palpate_thesis.drawing import STATED, Axes, Figure
from palpate_thesis.drawing import panels as rows_of_panels
from palpate_thesis.least_squares import panels
from palpate_thesis.neural_identifier import network
from palpate_thesis.neural_identifier.network import GONE, RUBBER_BAND, SMALL, Identified, NetworkPress
from palpate_thesis.runs import Runs

TIME = (0.3, 0.9)
"""Limits of "about 0.6 s": half of it more or less [s]."""
FOAM_BAND = 0.06
"""Maximum relative difference of K and f/x on foam: section 6.1 says "almost same" of less than 6 %."""
RATIO_BAND = 0.10
"""Maximum relative difference of f/x from the printed one: a network that gives one K on every surface would otherwise
agree on the surface that has it."""
RATES = (1e-6, 3e-6, 1e-5, 3e-5, 1e-4, 3e-4, 1e-3, 3e-3, 1e-2, 3e-2, 1e-1)
SHOWN = {1e-6: style.SERIES[0], 1e-5: style.SERIES[1], 1e-4: style.SERIES[2], 1e-2: style.SERIES[3]}
SMALLER = (1e-4, 3e-5, 1e-5, 3e-6)
"""The thesis' rate and smaller ones, among which each has to take longer than the one before."""
CALM = 0.06
"""Time after which curves set the scale of a panel [s]."""


class Data(NamedTuple):
    """One press, the networks' curves along it, and the answers of all runs, by learning rate."""

    press: NetworkPress  # that of the first noise seed
    curves: dict[float, Array]  # K, B, M and error of the first start
    answers: dict[float, list[Identified]]


def learn_at(runs: Runs, experiment: Experiment, surface: str, rates: Sequence[float]) -> Data:
    """One press a noise seed, all starts on each, at every rate."""
    presses, start = network.presses(runs, experiment, surface), network.starts(runs)[0]
    choices = {rate: network.identifier_network(runs.laboratory, rate) for rate in rates}
    curves = {rate: network.learn(presses[0], choice, start)[1] for rate, choice in choices.items()}
    answers = {rate: network.answers(runs, presses, choice) for rate, choice in choices.items()}
    return Data(presses[0], curves, answers)


@dataclass(frozen=True, eq=False)
class NetworkFigure:
    """A figure of the network on one surface, at the thesis' learning rate."""

    NUMBER: str
    PARAMETERS: Experiment
    surface: str
    sentences: Sequence[Sentence]

    def run(self, runs: Runs) -> Data:
        """One press a noise seed, all starts on each."""
        return learn_at(runs, self.PARAMETERS, self.surface, SMALLER[:1])

    def check(self, data: Data) -> Sequence[ThesisClaim]:
        """Settling times and values of K, B and M."""
        (answers,) = data.answers.values()
        K, ratio = (1e-3 * float(np.median([getattr(a, name) for a in answers])) for name in ("K", "ratio"))
        probe = 1e3 * SETTINGS[self.surface].values[0]
        return [s.judge(answers, stiffness=K, ratio=ratio, probe=probe) for s in self.sentences]

    def plot(self, data: Data) -> Figure:
        """Six panels as in the thesis."""
        press, (curve,) = data.press, data.curves.values()
        columns: dict[str, Any] = {"displacement": press.inputs[:, 0].copy(), "force_measured": press.force}
        columns |= {"t": network.TICK * np.arange(len(curve))}
        columns |= {f"{key}_probe": values.copy() for key, values in zip("KBM", curve.T, strict=False)}
        record = Record(columns, dict.fromkeys(columns, ""), {})
        drawing, _ = panels.six(self.surface, record, "probe", (0.0, network.PRESS), CALM)
        return drawing


class NetworkError(NetworkFigure):
    """The error of the output on foam."""

    def plot(self, data: Data) -> Figure:
        """The error along a press."""
        (curve,) = data.curves.values()
        drawing, ((axis,),) = rows_of_panels([2.6])
        axis.plot(np.arange(len(curve)) * network.TICK, curve[:, 3], color=style.SERIES[0], linewidth=0.7)
        axis.axhspan(-GONE, GONE, color=style.OK, alpha=0.15, linewidth=0)
        axis.axvline(0.6, **STATED)
        axis.set(xlim=(0.0, network.PRESS), xlabel="time since 5 N [s]", ylabel="error [N]")
        return drawing


def _in_time(id_: str, time: Callable[[Identified], float]) -> Sentence:
    numbers = {"first": TIME[0], "last": TIME[1], "limit": GONE, "key": id_[-1]}
    return Sentence(id_, lambda a: TIME[0] <= time(a) <= TIME[1], time, "s", numbers=numbers)


def _sentences(
    surface: str, band: float, ratio: float, similar: Callable[[Identified], bool]
) -> list[Sentence]:
    """Times and values of K, B and M, with f/x as printed [N/m]."""

    def near(a: Identified) -> bool:
        return abs(a.over - 1.0) <= band and abs(a.ratio / ratio - 1.0) <= RATIO_BAND

    id_ = f"network-{surface}"
    return [
        _in_time(f"{id_}.time-K", lambda a: a.settled_K),
        _in_time(f"{id_}.time-B", lambda a: a.settled_B),
        _in_time(f"{id_}.time-M", lambda a: a.settled_M),
        Sentence(f"{id_}.K", near, lambda a: a.over, "times f/x"),
        Sentence(f"{id_}.B", similar, lambda a: a.B / a.squares_B, "times that of least squares"),
        Sentence(f"{id_}.M", lambda a: 0.0 < a.M < SMALL, lambda a: a.M, "kg", numbers={"small": SMALL}),
    ]


FOAM = _sentences("foam", FOAM_BAND, 6700.0, lambda a: 2 / 3 <= a.B / a.squares_B <= 1.5)
RUBBER = _sentences("rubber", RUBBER_BAND, 62000.0, lambda a: 0.0 < a.B < a.squares_B)
ERROR = _in_time("network-foam.error", lambda a: a.error_gone)


class LearningRate:
    """Figure 6.6: one press on foam learned at several rates."""

    NUMBER = "6.6"

    def run(self, runs: Runs) -> Data:
        """One press a seed, learned at every rate."""
        return learn_at(runs, network.FOAM, "foam", RATES)

    def check(self, data: Data) -> Sequence[ThesisClaim]:
        """Smaller takes longer; too large never converges."""
        gone = {rate: [a.error_gone for a in data.answers[rate]] for rate in SMALLER}
        times = "; ".join(f"{rate:g}: {spread(values, 's', 2)}" for rate, values in gone.items())
        slower, first = often(slower_throughout(data.answers)), stuck_from(data.answers)
        words = f"from rate {first:g}" if first <= RATES[-1] else "at none that was tried"
        largest = [stuck(answer) for answer in data.answers[RATES[-1]]]
        numbers = {"stuck": words, "largest": RATES[-1], "runs": sum(largest), "of": len(largest)}
        return [
            claim("network-learning-rate.slower", slower, times=times, gone=GONE),
            claim("network-learning-rate.too-large", first <= RATES[-1], **numbers),
        ]

    def plot(self, data: Data) -> Figure:
        """Output of the network and K by probing along one press; time until the error is gone over the rate."""
        drawing, axes = panels.grid(2)
        t, force = np.arange(len(data.press.force)) * network.TICK, data.press.force
        axes[0].plot(t, force, color=style.MEASURED, linewidth=0.6, label="measured")
        for rate, color in SHOWN.items():
            K, error = data.curves[rate][:, 0], data.curves[rate][:, 3]
            axes[0].plot(t, force - error, color=color, linewidth=1.0, label=f"{rate:g}")
            axes[1].plot(t, 1e-3 * K, color=color, linewidth=1.0)
            axes[2].plot(t, error, color=color, linewidth=0.8)
        axes[1].axhline(1e-3 * data.press.ratio, **style.KNOWN)
        for axis, limits in zip(axes, ((-2.0, 42.0), (0.0, 21.0), (-25.0, 25.0)), strict=False):
            axis.set(xlim=(0.0, network.PRESS), ylim=limits, xlabel="time since 5 N [s]")
        axes[0].legend(ncols=2, loc="upper right", bbox_to_anchor=(1.0, 0.92))
        _times(axes[3], data.answers)
        for axis, letter, (title, label) in zip(axes, "abcd", PANELS.items(), strict=True):
            panels.set_title(axis, letter, title)
            axis.set_ylabel(label)
        return drawing


PANELS = {
    "Force and the network's output": "f [N]",
    "$K_e$ by probing; dotted: f/x": "$K_e$ [kN/m]",
    "Error of the output": "error [N]",
    "Time until it is gone; line: medians": "time [s]",
}


def _times(axis: Axes, by_rate: Mapping[float, Sequence[Identified]]) -> None:
    rates, color = np.array(list(by_rate)), style.SERIES[0]
    times = np.array([[a.error_gone for a in answers] for answers in by_rate.values()])
    for run in times.T:
        done = np.isfinite(run)
        axis.plot(rates[done], run[done], ".", color=color, markersize=4, alpha=0.5)
        axis.plot(rates[~done], 0.0 * rates[~done] + 1.4 * network.PRESS, "x", color=color, markersize=4)
    middle = np.median(times, axis=1)
    axis.plot(rates, np.where(np.isfinite(middle), middle, np.nan), color=color, linewidth=1.1)
    axis.axhline(network.PRESS, color=style.INK, linewidth=0.6)
    axis.set(xscale="log", yscale="log", xlabel="learning rate; cross: not within the 4 s")


def slower_throughout(by_rate: Mapping[float, Sequence[Identified]]) -> list[bool]:
    """For each run, True if every smaller rate takes longer."""
    times = np.array([[a.error_gone for a in by_rate[rate]] for rate in SMALLER])
    finite = np.where(np.isfinite(times), times, 1e3)
    return [bool(ok) for ok in np.all(np.diff(finite, axis=0) > 0.0, axis=0)]


def stuck(answer: Identified) -> bool:
    """True if the error is not gone at the end."""
    return not np.isfinite(answer.error_gone)


def stuck_from(by_rate: Mapping[float, Sequence[Identified]]) -> float:
    """The smallest rate above the thesis' from which on all are too large; infinite if there is none."""
    large = [rate for rate in RATES if rate > SMALLER[0]]
    good = [i for i, rate in enumerate(large) if not often(map(stuck, by_rate[rate]))]
    first = good[-1] + 1 if good else 0
    return large[first] if first < len(large) else float("inf")


STUDIES = (
    LearningRate(),
    NetworkFigure("6.7", network.FOAM, "foam", FOAM),
    NetworkError("6.8", network.FOAM, "foam", [ERROR]),
    NetworkFigure("6.9", network.RUBBER, "rubber", RUBBER),
)
