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
FEW = 5
"""Starts on each press of a varied condition."""
OTHERS = (25.0, 100.0)
"""Output amplitudes besides the chosen one, since the rate's meaning hangs on them [N]."""


class Data(NamedTuple):
    """Data of the figure: one press learned at several rates, and the times over seeds and conditions."""

    press: NetworkPress
    curves: dict[float, Array]  # K, B, M and error by rate, of the first press and start
    answers: dict[float, dict[float, list[NetworkAnswer]]]  # by amplitude and rate, one press a seed
    varied: dict[str, dict[float, list[NetworkAnswer]]]  # by condition and rate
    amplitude: float  # of the network as chosen [N]


def run(runs: Runs) -> Data:
    """One press a seed, learned at every rate and several amplitudes; conditions with two noise seeds each."""
    presses = network.presses(runs, PARAMETERS, "foam")
    chosen = network.chosen_network(runs)
    starts = network.starts(runs)
    curves = {rate: network.learn(presses[0], chosen._replace(rate=rate), starts[0])[1] for rate in SHOWN}
    choices = [chosen._replace(amplitude=a, rate=rate) for a in (chosen.amplitude, *OTHERS) for rate in RATES]
    by_amplitude: dict[float, dict[float, list[NetworkAnswer]]] = {}
    for choice, answers in network.sweep(runs, presses, choices).items():
        by_amplitude.setdefault(choice.amplitude, {})[choice.rate] = answers
    conditions = network.varied_presses(runs, PARAMETERS, "foam")
    varied = {
        name: {rate: network.answers(runs, few, chosen._replace(rate=rate), starts[:FEW]) for rate in SMALLER}
        for name, few in conditions.items()
    }
    return Data(presses[0], curves, by_amplitude, varied, chosen.amplitude)


def check(data: Data) -> Sequence[ThesisClaim]:
    """Smaller takes longer; too large never converges."""
    by_rate = data.answers[data.amplitude]
    return [_slower(data, by_rate), _too_large(data, by_rate)]


def _slower(data: Data, by_rate: Mapping[float, Sequence[NetworkAnswer]]) -> ThesisClaim:
    times = [f"{rate:g}: {spread([a.error_gone for a in by_rate[rate]], 's', 2)}" for rate in SMALLER]
    tried = data.varied | {f"output amplitude {a:g} N": data.answers[a] for a in OTHERS}
    bad = [name for name, answers in tried.items() if not often(slower_throughout(answers))]
    limits = f"It does not hold with: {', '.join(bad)}." if bad else "It holds under all of them."
    nearest = min(
        by_rate, key=lambda rate: abs(float(np.median([a.error_gone for a in by_rate[rate]])) - 0.6)
    )
    return claim(
        "network-learning-rate.slower",
        often(slower_throughout(by_rate)),
        times="; ".join(times),
        gone=network.GONE,
        nearest=nearest,
        amplitudes=" and ".join(f"{a:g}" for a in OTHERS),
        conditions=len(data.varied),
        limits=limits,
    )


def _too_large(data: Data, by_rate: Mapping[float, Sequence[NetworkAnswer]]) -> ThesisClaim:
    first = {a: stuck_from(by_rate) for a, by_rate in data.answers.items()}
    stuck_rates = ", ".join(f"{rate:g} at {a:g} N" for a, rate in first.items() if np.isfinite(rate))
    largest = by_rate[RATES[-1]]
    return claim(
        "network-learning-rate.too-large",
        bool(np.isfinite(first[data.amplitude])),
        stuck=stuck_rates or "none that was tried",
        largest=RATES[-1],
        runs=sum(map(stuck, largest)),
        of=len(largest),
        factor=first[data.amplitude] / 1e-4,
    )


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
    hopeless = [often([stuck(a) for a in by_rate[rate]]) for rate in large]
    good = [i for i, bad in enumerate(hopeless) if not bad]
    first = good[-1] + 1 if good else 0
    return large[first] if first < len(large) else float("inf")


PANELS = {
    "a": ("Force and the network's output", "f [N]"),
    "b": ("$K_e$ by probing; dotted: f/x", "$K_e$ [kN/m]"),
    "c": ("Error of the output", "error [N]"),
    "d": ("Time until it is gone; lines: medians", "time [s]"),
}


def plot(data: Data) -> Figure:
    """Output of the network and K by probing along one press; time until the error is gone over the rate."""
    drawing, axes = panels.grid(2)
    _curves(axes, data)
    for axis, (letter, (title, label)) in zip(axes, PANELS.items(), strict=True):
        panels.set_title(axis, letter, title)
        axis.set_ylabel(label)
    for (amplitude, by_rate), color in zip(data.answers.items(), style.SERIES, strict=False):
        _times(axes[3], by_rate, f"{amplitude:g} N", color)
    axes[3].axhline(network.PRESS, color=style.INK, linewidth=0.6)
    axes[3].set(xscale="log", yscale="log", xlabel="learning rate; cross: not within the 4 s")
    axes[3].legend(title="output amplitude", loc="lower left")
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


def _times(axis: Axes, by_rate: Mapping[float, Sequence[NetworkAnswer]], label: str, color: str) -> None:
    times = np.array([[a.error_gone for a in by_rate] for by_rate in by_rate.values()])
    rates = np.repeat(np.array(list(by_rate))[:, None], times.shape[1], axis=1)
    done = np.isfinite(times)
    axis.plot(rates[done], times[done], ".", color=color, markersize=4, alpha=0.5)
    middle = np.median(times, axis=1)
    middle[~np.isfinite(middle)] = np.nan
    axis.plot(rates[:, 0], middle, color=color, linewidth=1.1, label=label)
    axis.plot(rates[~done], np.full(int((~done).sum()), 1.4 * network.PRESS), "x", color=color, markersize=4)
