"""Explanation 2: the neural controller is, to first order, an integral controller."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from palpate.arrays import Array
from palpate.bench import Experiment, with_values
from palpate.records import Record
from palpate.report import style
from palpate_thesis.claims import ThesisClaim, claim, spread
from palpate_thesis.drawing import Axes, Figure, limits, panels
from palpate_thesis.force_control.tracking import FOAM, RUBBER, SINE, since_contact, slot, tracking
from palpate_thesis.runs import Runs

NUMBER = "neural-is-an-integrator"
AMPLITUDE, TICK, RATE = 20.0, 1e-3, 5e-5
GAIN = RATE * (AMPLITUDE / 2) ** 2 / TICK
"""Integral gain equivalent to the text's learning rate: 5 per second."""
RATES = (1e-6, 5e-6, 1e-5, 5e-5, 1e-4, 2e-4, 5e-4)
GAINS = np.array(RATES) * (AMPLITUDE / 2) ** 2 / TICK
"""That of each learning rate tried [1/s]."""
PI: Mapping[str, Any] = {"controller": {"kind": "proportional-integral", "kf": 0.25, "ki": GAIN}}
JUDGED = (10.0, 15.0)
SHARE = 0.10
"""Within which gains and RMS errors have to agree."""
FITTED = 5.0
"""Seconds after contact over which the gain is measured [s]."""
PARAMETERS: Mapping[str, Experiment] = {
    f"{surface}, {force}": with_values(experiment, {"run.press": JUDGED[1], **changes})
    for surface, experiment in (("foam", FOAM), ("rubber", RUBBER))
    for force, changes in (("steps", {}), ("steps and sine", SINE))
}


class Data(NamedTuple):
    """Measured values for `check` and `plot`; pairs are of the network and of the PI."""

    shown: dict[str, list[Record]]  # a pair for each experiment
    errors: dict[str, list[list[float]]]  # a pair of RMS errors over the seeds [N]
    gains: dict[str, Array]  # by surface: (rates, seeds) [1/s]

    def medians(self, name: str) -> tuple[float, float]:
        """Median RMS error of the network and of the PI in an experiment [N]."""
        network, plain = (float(np.median(errors)) for errors in self.errors[name])
        return network, plain


def run(runs: Runs) -> Data:
    """Both controllers on all four experiments, and the network's gain over its learning rate."""
    measure = tracking(*JUDGED)
    pairs = {name: [e, with_values(e, PI)] for name, e in PARAMETERS.items()}
    shown = {name: [slot(runs.record(e), *JUDGED) for e in pair] for name, pair in pairs.items()}
    errors = {
        name: [[run.rms for run in runs.over_seeds(e, measure)] for e in pair] for name, pair in pairs.items()
    }
    return Data(shown, errors, {"foam": _gains(runs, FOAM), "rubber": _gains(runs, RUBBER)})


def check(data: Data) -> Sequence[ThesisClaim]:
    """Gains and errors have to agree within a tenth."""
    at, small = RATES.index(RATE), np.array(RATES) <= 1e-4
    worst = max(np.abs(g / GAINS[:, None] - 1.0)[small].max() for g in data.gains.values())
    medians = {name: data.medians(name) for name in data.errors}
    apart = max(abs(network / plain - 1.0) for network, plain in medians.values())
    gains = (f"{name} {spread(list(g[at]), 'per second')}" for name, g in data.gains.items())
    return [
        claim(
            "neural-integrator.gain",
            bool(worst <= SHARE),
            gain=GAIN,
            values="; ".join(gains),
            worst=worst,
            fitted=FITTED,
            share=SHARE,
        ),
        claim(
            "neural-integrator.errors",
            apart <= SHARE,
            cases="; ".join(f"{name} {a:.2f} and {b:.2f} N" for name, (a, b) in medians.items()),
            apart=apart,
            seeds=data.gains["foam"].shape[1],
            share=SHARE,
        ),
    ]


def plot(data: Data) -> Figure:
    """Four overlays, and the gain over the rate."""
    drawing, grid = panels([1.9, 1.9, 2.5], columns=2, width=11.0)
    for axis, (name, (network, plain)) in zip([*grid[0], *grid[1]], data.shown.items(), strict=True):
        color = style.SERIES[1]
        axis.plot(network["t"], network["force"], color=color, linewidth=3.2, alpha=0.5, label="network")
        axis.plot(plain["t"], plain["force"], color=style.SERIES[0], linewidth=1.0, label="PI")
        axis.plot(plain["t"], plain["force_desired"], **style.KNOWN, label="desired")
        limits(axis, network)
        axis.set_title("{}: {:.2f} and {:.2f} N".format(name, *data.medians(name)))
        axis.set(ylabel="force [N]", xlim=JUDGED)
    style.legend(grid[0][0])
    for axis, (name, measured) in zip(grid[2], data.gains.items(), strict=True):
        _gain_panel(axis, name, measured)
    return drawing


def _gain_panel(axis: Axes, name: str, measured: Array) -> None:
    axis.plot(RATES, GAINS, color=style.INK, linewidth=1, label="eta (A/2)²/Ts")
    ring: Any = {"color": style.SERIES[0], "markersize": 6, "fillstyle": "none", "label": name}
    axis.plot(RATES, np.median(measured, axis=1), "o", **ring)
    axis.axvline(RATE, color=style.MEASURED, linewidth=1, linestyle="--", label="the text's")
    axis.axvline(1e-4, color=style.MEASURED, linewidth=1, linestyle=":", label="the listing's")
    axis.set(xscale="log", yscale="log", xlabel="learning rate eta", ylabel="K_i [1/s]")
    style.legend(axis, ncols=2)


def _gains(runs: Runs, experiment: Experiment) -> Array:
    e = with_values(experiment, {"run.press": FITTED})
    by_rate = {rate: with_values(e, {"controller.learning_rate": rate}) for rate in RATES}
    return np.array(list(runs.by_name(by_rate, fit_integral_gain).values()))


def fit_integral_gain(record: Record) -> float:
    """Slope of the network's command over the integral of the measured force error [1/s]."""
    pressing = since_contact(record) >= 0.0
    error = (record["force_desired"] - record["force_measured"])[pressing]
    integral, command = TICK * np.cumsum(error)[:-1], record["memory_fx"][pressing][1:]
    return float(np.polyfit(integral, command, 1)[0])
