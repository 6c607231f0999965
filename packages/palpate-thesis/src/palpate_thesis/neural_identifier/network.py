"""Presses for the neural identifier, networks that learn from them, and their answers."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from palpate.arrays import Array
from palpate.bench import Experiment, load, with_values
from palpate.identifiers.neural_probe import SETTINGS, NeuralProbe
from palpate.records import Record
from palpate_thesis.laboratory import Laboratory
from palpate_thesis.least_squares import press_runs
from palpate_thesis.neural_identifier.listed_sum import ListedSumProbe
from palpate_thesis.runs import Runs

PRESS = 4.0
"""Seconds of contact that the figures show [s]."""
LATE_SAMPLES = 500
"""Milliseconds at the end over which answers, force and displacement are averaged."""
FOAM = press_runs.nearer(with_values(load("foam-rls"), {"run.press": PRESS, "surface.stiffness": 5450.0}))
"""Its K is chosen so that f/x comes out near the thesis' 6.7 kN/m."""
RUBBER = press_runs.nearer(
    with_values(load("rubber-rls"), {"run.press": PRESS, "surface.stiffness": 49200.0})
)
"""A rubber of its own: f/x is 62 kN/m in this run of the thesis and 44 in the one for least squares."""
STARTS = tuple(range(10))
"""Seeds of the weights at the start; all are tried on the press of every noise seed."""
MEAN_OVER = 0.05
"""Length of the running mean under which an error is looked at: what is left is no noise [s]."""
GONE = 1.0
"""An error of the output is almost zero within this [N]: 5 % of the desired force."""
TICK = 1e-3
RUBBER_BAND = 0.15
"""Maximum relative difference of a realistic K and f/x: on rubber the thesis' own are 10 % apart."""
SMALL = 1.0
"""Upper limit of a small mass [kg]."""
DAMPING_FACTOR = 2.0
"""Largest factor between a realistic damping and the surface's own: the thesis calls B_e of both methods realistic,
although the network's is the smaller one on rubber."""


class NetworkPress(NamedTuple):
    """One contact, as the thesis' identifiers are given it, and what is known of it."""

    surface: str  # whose scales and probe the thesis gives: "foam" or "rubber"
    inputs: Array  # displacement [m], velocity [m/s], acceleration [m/s^2], shape (n, 3), one a millisecond
    force: Array  # filtered [N], shape (n,)
    ratio: float  # f/x at the end [N/m]
    squares: Array  # K, B, M of recursive least squares, shape (n, 3)
    matched: Array  # K, B, M of least squares on channels that share one lag, shape (n, 3)
    truth: Array  # K, B, M of the surface, shape (3,)

    @property
    def rest(self) -> float:
        """Mean displacement at the end [m]."""
        return float(self.inputs[-LATE_SAMPLES:, 0].mean())


def press_of(record: Record, surface: str) -> NetworkPress:
    """The first seconds of the first contact of a run."""
    first, n = press_runs.contact(record), round(PRESS / TICK)
    inputs = np.column_stack([first[c][:n] for c in ("displacement", "vx_raw", "ax_measured")])
    force = first["force_measured"][:n]
    ratio = float(force[-LATE_SAMPLES:].mean() / inputs[-LATE_SAMPLES:, 0].mean())
    squares, matched = (
        np.column_stack([first[f"{key}_{front}"][:n] for key in "KBM"]) for front in ("thesis", "matched")
    )
    truth = np.array(list(press_runs.own_values(record.meta["experiment"]["surface"]).values()))
    return NetworkPress(surface, inputs, force, ratio, squares, matched, truth)


def presses(runs: Runs, experiment: Experiment, surface: str) -> list[NetworkPress]:
    """One press a noise seed."""
    return runs.over_seeds(experiment, lambda record: press_of(record, surface))


class NetworkChoice(NamedTuple):
    """Unstated parameters of the thesis' network, and its stated learning rate (1e-4).

    As chosen here: an output of up to twice the desired force, weights from -0.5 to 0.5, thresholds that learn (which
    sec. 5.2 does say).
    """

    amplitude: float = 40.0
    weights: float = 0.5
    thresholds: bool = True
    rate: float = 1e-4
    scale: tuple[float, float, float] | None = None  # the thesis' own where None
    listed_sum: bool = False  # the listing's v.h in place of the text's v.s(h)

    def probe(self, surface: str, start: int) -> NeuralProbe:
        """The 3-4-1 network before it has learned anything."""
        setting = SETTINGS[surface] if self.scale is None else SETTINGS[surface]._replace(scale=self.scale)
        weights, thresholds = self.weights, self.thresholds
        kind = ListedSumProbe if self.listed_sum else NeuralProbe
        return kind(setting, self.amplitude, self.rate, seed=start, weights=weights, thresholds=thresholds)


def identifier_network(laboratory: Laboratory, rate: float = 1e-4) -> NetworkChoice:
    """The network of a laboratory."""
    lab = laboratory
    return NetworkChoice(lab.amplitude, lab.weights, rate=rate, listed_sum=lab.output_sum == 1.0)


def starts(runs: Runs) -> tuple[int, ...]:
    """The seeds of the weights that its claims are looked at over: all, or the laboratory's own."""
    return STARTS if runs.laboratory.start is None else (int(runs.laboratory.start),)


class Identified(NamedTuple):
    """Answer of one method on one press: K, B and M, means over the last half second, and their settling times."""

    K: float  # [N/m]
    B: float  # [N s/m]
    M: float  # [kg]
    settled_K: float  # time from which it stays within 10 % of its last value [s]
    settled_B: float
    settled_M: float  # within 10 % of its largest value: see `mass_settled_after`
    ripple: float  # standard deviation of K in the last half second, relative to K
    ratio: float  # f/x of the press [N/m]
    squares_B: float  # least squares' B of the same press [N s/m]
    truth: Array  # K, B, M of the surface, shape (3,)
    error_gone: float  # from when on the mean error of the output is within GONE [s]; infinite: never

    @property
    def over(self) -> float:
        """K as a multiple of f/x."""
        return self.K / self.ratio

    @property
    def relative_B(self) -> float:
        """B as a multiple of the surface's own."""
        return float(self.B / self.truth[1])

    @property
    def realistic(self) -> tuple[bool, bool, bool]:
        """True for each of K, B and M that is realistic."""
        return (
            abs(self.over - 1.0) <= RUBBER_BAND,
            1.0 / DAMPING_FACTOR <= self.relative_B <= DAMPING_FACTOR,
            0.0 < self.M < SMALL,
        )

    @property
    def errors(self) -> tuple[float, float]:
        """Distance of B and M from the surface's own [N s/m, kg]."""
        return abs(float(self.B - self.truth[1])), abs(float(self.M - self.truth[2]))


def identified(press: NetworkPress, curve: Array) -> Identified:
    """Answer of a method from its K, B, M, and the error of its output if it has one, shape (n, 3) or (n, 4)."""
    end, late = len(curve) * TICK, curve[-LATE_SAMPLES:]
    K, B, M = map(float, late[:, :3].mean(axis=0))
    k, b = (press_runs.settled_after(values, end) for values in curve.T[:2])
    m = press_runs.mass_settled_after(curve[:, 2], end)
    ripple, squares_B = float(late[:, 0].std() / abs(K)), float(press.squares[-1, 1])
    gone = error_gone(curve[:, 3]) if curve.shape[1] > 3 else float("nan")
    return Identified(K, B, M, k, b, m, ripple, press.ratio, squares_B, press.truth, gone)


def tangent(probe: NeuralProbe, x: float) -> float:
    """Slope of the network's force over displacement at x, by central difference [N/m]."""
    d = 0.02 * x
    return (probe.force((x + d, 0.0, 0.0)) - probe.force((x - d, 0.0, 0.0))) / (2.0 * d)


def learn(press: NetworkPress, choice: NetworkChoice, start: int) -> tuple[NeuralProbe, Array]:
    """The network after the press, and K, B, M and the output's error along it, shape (n, 4)."""
    probe = choice.probe(press.surface, start)
    return probe, probe.trajectory(press.inputs, press.force)


def error_gone(error: Array) -> float:
    """From when on the running mean of an error stays within `GONE` [s]; infinite if it does not at the end."""
    n = round(MEAN_OVER / TICK)
    sums = np.cumsum(np.concatenate([np.zeros(n), error]))
    count = np.minimum(np.arange(1, len(error) + 1), n)
    large = np.flatnonzero(~(np.abs((sums[n:] - sums[:-n]) / count) <= GONE))
    if not len(large):
        return 0.0
    return float("inf") if large[-1] == len(error) - 1 else float((large[-1] + 1) * TICK)


def answers(runs: Runs, contacts: Sequence[NetworkPress], choice: NetworkChoice) -> list[Identified]:
    """Every start on every press."""
    cases = [(press, start) for press in contacts for start in starts(runs)]
    return runs.map(lambda case: identified(case[0], learn(case[0], choice, case[1])[1]), cases)
