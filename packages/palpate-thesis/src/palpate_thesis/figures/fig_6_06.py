"""Figure 6.6: the learning rate of the neural identifier."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from palpate.arrays import Array
from palpate.report import style
from palpate_thesis.claims import ThesisClaim, claim, often, spread
from palpate_thesis.drawing import Axes, Figure
from palpate_thesis.least_squares import panels
from palpate_thesis.neural_identifier import network
from palpate_thesis.neural_identifier.network import NetworkAnswer, NetworkPress
from palpate_thesis.runs import Runs

NUMBER = "6.6"
PARAMETERS = network.FOAM
RATES = (1e-6, 3e-6, 1e-5, 3e-5, 1e-4, 3e-4, 1e-3, 3e-3, 1e-2, 3e-2, 1e-1)
SHOWN = {1e-6: style.SERIES[0], 1e-5: style.SERIES[1], 1e-4: style.SERIES[2], 1e-2: style.SERIES[3]}
SMALLER = (1e-4, 3e-5, 1e-5, 3e-6)
"""The thesis' rate and smaller ones, among which each has to take longer than the one before."""


class Data(NamedTuple):
    """One press learned at several rates, and the answers over the seeds."""

    press: NetworkPress
    curves: dict[float, Array]  # K, B, M and error by rate, of the first press and start
    answers: dict[float, list[NetworkAnswer]]  # by rate


def run(runs: Runs) -> Data:
    """One press a seed, learned at every rate."""
    presses = network.presses(runs, PARAMETERS, "foam")
    chosen, start = network.chosen_network(runs), network.starts(runs)[0]
    curves = {rate: network.learn(presses[0], chosen._replace(rate=rate), start)[1] for rate in SHOWN}
    answers = {rate: network.answers(runs, presses, chosen._replace(rate=rate)) for rate in RATES}
    return Data(presses[0], curves, answers)


def check(data: Data) -> Sequence[ThesisClaim]:
    """Smaller takes longer; too large never converges."""
    times = [f"{rate:g}: {spread([a.error_gone for a in data.answers[rate]], 's', 2)}" for rate in SMALLER]
    first, largest = stuck_from(data.answers), data.answers[RATES[-1]]
    return [
        claim(
            "network-learning-rate.slower",
            often(slower_throughout(data.answers)),
            times="; ".join(times),
            gone=network.GONE,
        ),
        claim(
            "network-learning-rate.too-large",
            bool(np.isfinite(first)),
            stuck=f"from rate {first:g}" if np.isfinite(first) else "at none that was tried",
            largest=RATES[-1],
            runs=sum(map(stuck, largest)),
            of=len(largest),
        ),
    ]


def slower_throughout(by_rate: Mapping[float, Sequence[NetworkAnswer]]) -> list[bool]:
    """For each run, True if every smaller rate takes longer."""
    times = np.array([[a.error_gone for a in by_rate[rate]] for rate in SMALLER])
    finite = np.where(np.isfinite(times), times, 1e3)
    return [bool(ok) for ok in np.all(np.diff(finite, axis=0) > 0.0, axis=0)]


def stuck(answer: NetworkAnswer) -> bool:
    """True if the error is not gone at the end."""
    return not np.isfinite(answer.error_gone)


def stuck_from(by_rate: Mapping[float, Sequence[NetworkAnswer]]) -> float:
    """The smallest rate above the thesis' from which on all are too large; infinite if there is none."""
    large = [rate for rate in RATES if rate > SMALLER[0]]
    good = [i for i, rate in enumerate(large) if not often(map(stuck, by_rate[rate]))]
    first = good[-1] + 1 if good else 0
    return large[first] if first < len(large) else float("inf")


PANELS = {
    "a": ("Force and the network's output", "f [N]"),
    "b": ("$K_e$ by probing; dotted: f/x", "$K_e$ [kN/m]"),
    "c": ("Error of the output", "error [N]"),
    "d": ("Time until it is gone; line: medians", "time [s]"),
}


def plot(data: Data) -> Figure:
    """Output of the network and K by probing along one press; time until the error is gone over the rate."""
    drawing, axes = panels.grid(2)
    _curves(axes, data)
    for axis, (letter, (title, label)) in zip(axes, PANELS.items(), strict=True):
        panels.set_title(axis, letter, title)
        axis.set_ylabel(label)
    _times(axes[3], data.answers)
    return drawing


def _curves(axes: list[Axes], data: Data) -> None:
    t = np.arange(len(data.press.force)) * network.TICK
    axes[0].plot(t, data.press.force, color=style.MEASURED, linewidth=0.6, label="measured")
    for rate, color in SHOWN.items():
        curve = data.curves[rate]
        axes[0].plot(t, data.press.force - curve[:, 3], color=color, linewidth=1.0, label=f"{rate:g}")
        axes[1].plot(t, 1e-3 * curve[:, 0], color=color, linewidth=1.0)
        axes[2].plot(t, curve[:, 3], color=color, linewidth=0.8)
    axes[1].axhline(1e-3 * data.press.ratio, **style.KNOWN)
    for axis, limits in zip(axes[:3], ((-2.0, 42.0), (0.0, 21.0), (-25.0, 25.0)), strict=True):
        axis.set(xlim=(0.0, network.PRESS), ylim=limits, xlabel="time since 5 N [s]")
    axes[0].legend(ncols=2, loc="upper right", bbox_to_anchor=(1.0, 0.92))


def _times(axis: Axes, by_rate: Mapping[float, Sequence[NetworkAnswer]]) -> None:
    times = np.array([[a.error_gone for a in answers] for answers in by_rate.values()])
    rates = np.repeat(np.array(list(by_rate))[:, None], times.shape[1], axis=1)
    done, color = np.isfinite(times), style.SERIES[0]
    middle = np.median(times, axis=1)
    axis.plot(rates[done], times[done], ".", color=color, markersize=4, alpha=0.5)
    axis.plot(rates[:, 0], np.where(np.isfinite(middle), middle, np.nan), color=color, linewidth=1.1)
    axis.plot(rates[~done], np.full(int((~done).sum()), 1.4 * network.PRESS), "x", color=color, markersize=4)
    axis.axhline(network.PRESS, color=style.INK, linewidth=0.6)
    axis.set(xscale="log", yscale="log", xlabel="learning rate; cross: not within the 4 s")
