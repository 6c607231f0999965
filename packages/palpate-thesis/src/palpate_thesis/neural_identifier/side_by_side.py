"""Least squares and the network on the same presses: their values, settling times and noise (section 7.1)."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from palpate.arrays import Array
from palpate.bench import Experiment
from palpate.identifiers.neural_probe import SETTINGS
from palpate.records import Record
from palpate_thesis.least_squares import press_runs
from palpate_thesis.neural_identifier import network
from palpate_thesis.neural_identifier.claims import RUBBER_BAND, SMALL
from palpate_thesis.neural_identifier.network import NetworkChoice, NetworkPress
from palpate_thesis.runs import Runs

PRESSES = {"foam": network.FOAM, "rubber": network.RUBBER}
METHODS = ("least squares", "network", "least squares, lags matched")
"""The thesis' two methods on its signals, and the first on channels that share one lag (ours)."""
DAMPING_FACTOR = 2.0
"""Largest factor between a realistic damping and the surface's own: the thesis calls B_e of both methods realistic,
although the network's is the smaller one on rubber."""
QUICK = 0.9
"""Longest settling time of a method for practical use [s]: half as much again as the thesis' 0.6 s."""


class SharedPress(NamedTuple):
    """One press, with the surface's own values.

    Args:
        press: signals, force and least squares' estimates, as the network is given them.
        matched: K, B, M of least squares on channels that share one lag, shape (n, 3).
        truth: K, B, M of the surface, shape (3,).
    """

    press: NetworkPress
    matched: Array
    truth: Array


class Identified(NamedTuple):
    """Answer of one method on one press: means over the last half second."""

    K: float  # these six as in `network.Coefficients`
    B: float
    M: float
    settled_K: float
    settled_B: float
    settled_M: float
    ripple: float  # standard deviation of K in the last half second, relative to K
    ratio: float  # f/x of the press [N/m]
    truth: Array  # K, B, M of the surface, shape (3,)

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


class Pair(NamedTuple):
    """Both methods of the thesis on one press."""

    squares: Identified
    network: Identified

    @property
    def faster(self) -> tuple[bool, bool, bool]:
        """True for each of K, B and M that least squares settles first."""
        a, b = self.squares, self.network
        return a.settled_K < b.settled_K, a.settled_B < b.settled_B, a.settled_M < b.settled_M

    @property
    def nearer(self) -> tuple[bool, bool]:
        """True for each of B and M that the network gives nearer to the surface's own."""
        (b, m), (net_b, net_m) = self.squares.errors, self.network.errors
        return net_b < b, net_m < m


class MethodComparison(NamedTuple):
    """Answers of all methods on one surface."""

    first: SharedPress  # of the first noise seed
    curves: list[Array]  # K, B, M of the network along it, a start each
    answers: dict[str, list[Identified]]  # by method; the network's for each press and start
    pairs: list[Pair]
    other_inputs: list[float]  # K asked at the other surface's dummy inputs, over K asked at its own
    unscaled: list[float]  # slope of the force at rest of a network without scaling, over that of one with it


def compare(runs: Runs, experiment: Experiment, surface: str) -> MethodComparison:
    """Run all methods on one press a noise seed, the network from every start."""
    presses = runs.over_seeds(experiment, lambda record: shared_press(record, surface))
    choice, starts = network.chosen_network(runs), network.starts(runs)
    (other,) = SETTINGS.keys() - {surface}
    choices = {
        "own": (choice, surface),
        "other inputs": (choice._replace(scale=SETTINGS[surface].scale), other),
        "unscaled": (choice._replace(scale=(1.0, 1.0, 1.0)), surface),
    }

    def learn(case: tuple[SharedPress, NetworkChoice, str, int]) -> tuple[Array, float]:
        """K, B, M of a network along a press, shape (n, 3), and the slope of its force at rest [N/m]."""
        shared, choice, settings, start = case
        probe, curve = network.learn(shared.press._replace(surface=settings), choice, start)
        return curve[:, :3], network.tangent(probe, shared.press.rest)

    learned = runs.map_each(
        learn,
        {n: [(p, c, named, s) for p in presses for s in starts] for n, (c, named) in choices.items()},
    )
    curves = [curve for curve, _ in learned["own"]]
    repeated = [press for press in presses for _ in starts]
    answers = {
        METHODS[0]: [identified(p, p.press.squares[:, ::-1]) for p in presses],
        METHODS[1]: [identified(p, curve) for p, curve in zip(repeated, curves, strict=True)],
        METHODS[2]: [identified(p, p.matched) for p in presses],
    }
    own_K = np.array([answer.K for answer in answers[METHODS[1]]])
    other_K = np.array(
        [identified(p, c).K for p, (c, _) in zip(repeated, learned["other inputs"], strict=True)]
    )
    slopes, unscaled = (np.array([slope for _, slope in learned[name]]) for name in ("own", "unscaled"))
    squares = [answer for answer in answers[METHODS[0]] for _ in starts]
    return MethodComparison(
        presses[0],
        curves[: min(5, len(starts))],
        answers,
        [Pair(*both) for both in zip(squares, answers[METHODS[1]], strict=True)],
        [*map(float, other_K / own_K)],
        [*map(float, np.abs(unscaled / slopes))],
    )


def shared_press(record: Record, surface: str) -> SharedPress:
    """The first contact of a run."""
    first = press_runs.contact(record)
    material = record.meta["experiment"]["surface"]
    truth = np.array([material["stiffness"], press_runs.own_damping(material), material["mass"]])
    matched = np.column_stack([first[f"{key}_matched"] for key in "KBM"])
    return SharedPress(network.press_of(record, surface), matched, truth)


def identified(shared: SharedPress, curve: Array) -> Identified:
    """Answer of a method from its K, B, M along a press, shape (n, 3)."""
    late = curve[-round(network.LATE / network.TICK) :, 0]
    ripple = float(late.std() / abs(late.mean()))
    return Identified(*network.coefficients(curve), ripple, shared.press.ratio, shared.truth)


def fraction(flags: Sequence[bool]) -> str:
    """How many runs agree: "93 of 100"."""
    return f"{sum(map(bool, flags))} of {len(flags)}"
