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
from palpate_thesis.force_control.tracking import (
    FOAM,
    RUBBER,
    SINE,
    Tracking,
    since_contact,
    slot,
    tracking,
)
from palpate_thesis.runs import Runs

NUMBER = "neural-is-an-integrator"
AMPLITUDE, TICK, RATE = 20.0, 1e-3, 5e-5
GAIN = RATE * (AMPLITUDE / 2) ** 2 / TICK
"""Integral gain equivalent to the text's learning rate: 5 per second."""
RATES = (1e-6, 5e-6, 1e-5, 5e-5, 1e-4, 2e-4, 5e-4)
GAINS = np.array(RATES) * (AMPLITUDE / 2) ** 2 / TICK
"""That of each learning rate tried [1/s]."""
PI: Mapping[str, Any] = {"controller": {"kind": "proportional-integral", "kf": 0.25, "ki": GAIN}}
LONG = {"run.press": 15.0}
PARAMETERS: Mapping[str, Experiment] = {
    "foam, steps": with_values(FOAM, LONG),
    "foam, steps and sine": with_values(FOAM, {**LONG, **SINE}),
    "rubber, steps": with_values(RUBBER, LONG),
    "rubber, steps and sine": with_values(RUBBER, {**LONG, **SINE}),
}
JUDGED = (10.0, 15.0)
SHARE = 0.10
"""Within which gains and RMS errors have to agree."""
FITTED = 5.0
"""Seconds after contact over which the gain is measured [s]."""


class BothControllers(NamedTuple):
    """An experiment under both controllers."""

    network: Record
    pi: Record
    network_runs: list[Tracking]
    pi_runs: list[Tracking]


class Data(NamedTuple):
    """Measured values for `check` and `plot`."""

    pairs: dict[str, BothControllers]
    gains: dict[str, Array]  # by surface: (rates, seeds) [1/s]


def run(runs: Runs) -> Data:
    """Both controllers on all four experiments, and the network's gain over its learning rate."""
    pairs = {name: _pair(runs, e) for name, e in PARAMETERS.items()}
    gains = {name: _gains(runs, e) for name, e in (("foam", FOAM), ("rubber", RUBBER))}
    return Data(pairs, gains)


def check(data: Data) -> Sequence[ThesisClaim]:
    """Gains and errors have to agree within a tenth."""
    at = RATES.index(RATE)
    small = [i for i, rate in enumerate(RATES) if rate <= 1e-4]
    worst = max(np.abs(g / GAINS[:, None] - 1.0)[small].max() for g in data.gains.values())
    table = "; ".join(
        f"{name} {_median(p.network_runs):.2f} and {_median(p.pi_runs):.2f} N"
        for name, p in data.pairs.items()
    )
    seeds = len(next(iter(data.pairs.values())).pi_runs)
    apart = max(abs(_median(p.network_runs) / _median(p.pi_runs) - 1.0) for p in data.pairs.values())
    return [
        claim(
            "neural-integrator.gain",
            worst <= SHARE,
            gain=GAIN,
            surfaces="; ".join(
                (f"{name} {spread(list(g[at]), 'per second')}" for name, g in data.gains.items())
            ),
            worst=worst,
            fitted=FITTED,
            share=SHARE,
        ),
        claim(
            "neural-integrator.errors",
            apart <= SHARE,
            cases=table,
            apart=apart,
            seeds=seeds,
            share=SHARE,
        ),
    ]


def plot(data: Data) -> Figure:
    """Four overlays, and the gain over the rate."""
    drawing, grid = panels([1.9, 1.9, 2.5], columns=2, width=11.0)
    for axis, (name, pair) in zip([*grid[0], *grid[1]], data.pairs.items(), strict=True):
        _overlay(axis, name, pair)
    style.legend(grid[0][0])
    for axis in grid[1]:
        axis.set_xlabel("time since contact [s]")
    for axis, (name, measured) in zip(grid[2], data.gains.items(), strict=True):
        _gain_panel(axis, name, measured)
    return drawing


def _overlay(axis: Axes, name: str, pair: BothControllers) -> None:
    wide: Any = {"color": style.SERIES[1], "linewidth": 3.2, "alpha": 0.5, "label": "network"}
    axis.plot(pair.network["t"], pair.network["force"], **wide)
    axis.plot(pair.pi["t"], pair.pi["force"], color=style.SERIES[0], linewidth=1.0, label="PI")
    axis.plot(pair.pi["t"], pair.pi["force_desired"], **style.KNOWN, label="desired")
    limits(axis, pair.network)
    axis.set_title(f"{name}: {_median(pair.network_runs):.2f} and {_median(pair.pi_runs):.2f} N")
    axis.set(ylabel="force [N]", xlim=JUDGED)


def _gain_panel(axis: Axes, name: str, measured: Array) -> None:
    axis.plot(RATES, GAINS, color=style.INK, linewidth=1, label="eta (A/2)²/Ts")
    ring: Any = {"color": style.SERIES[0], "markersize": 6, "fillstyle": "none", "label": name}
    axis.plot(RATES, np.median(measured, axis=1), "o", **ring)
    axis.axvline(RATE, color=style.MEASURED, linewidth=1, linestyle="--", label="the text's")
    axis.axvline(1e-4, color=style.MEASURED, linewidth=1, linestyle=":", label="the listing's")
    axis.set(xscale="log", yscale="log", xlabel="learning rate eta", ylabel="K_i [1/s]")
    style.legend(axis, ncols=2)


def _pair(runs: Runs, experiment: Experiment) -> BothControllers:
    measure = tracking(*JUDGED)
    plain = with_values(experiment, PI)
    network_runs, pi_runs = runs.over_seeds(experiment, measure), runs.over_seeds(plain, measure)
    network_shown, pi_shown = (slot(runs.record(e), *JUDGED) for e in (experiment, plain))
    return BothControllers(network_shown, pi_shown, network_runs, pi_runs)


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


def _median(runs: Sequence[Tracking]) -> float:
    return float(np.median([run.rms for run in runs]))
