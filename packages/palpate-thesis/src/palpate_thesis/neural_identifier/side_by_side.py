"""Least squares and the network on the same presses: their values, settling times and noise (section 7.1)."""

from typing import NamedTuple

import numpy as np

from palpate.arrays import Array
from palpate.bench import Experiment
from palpate.identifiers.neural_probe import SETTINGS
from palpate_thesis.neural_identifier import network
from palpate_thesis.neural_identifier.network import Identified, NetworkChoice, NetworkPress, identified
from palpate_thesis.runs import Runs

METHODS = ("least squares", "network", "least squares, lags matched")
"""The thesis' two methods on its signals, and the first on channels that share one lag (ours)."""


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

    first: NetworkPress  # of the first noise seed
    curves: list[Array]  # K, B, M and error of the network along it, a start each
    answers: dict[str, list[Identified]]  # by method; the network's for each press and start
    pairs: list[Pair]
    other_inputs: list[float]  # K asked at the other surface's dummy inputs, over K asked at its own
    unscaled: list[float]  # slope of the force at rest of a network without scaling, over that of one with it


def compare(runs: Runs, experiment: Experiment, surface: str) -> MethodComparison:
    """Run all methods on one press a noise seed, the network from every start."""
    presses, choice = network.presses(runs, experiment, surface), network.identifier_network(runs.laboratory)
    cases = [(press, start) for press in presses for start in network.starts(runs)]
    (other,) = SETTINGS.keys() - {surface}
    choices = {
        "own": (choice, surface),
        "other inputs": (choice._replace(scale=SETTINGS[surface].scale), other),
        "unscaled": (choice._replace(scale=(1.0, 1.0, 1.0)), surface),
    }

    def learn(case: tuple[NetworkPress, int, NetworkChoice, str]) -> tuple[Array, float]:
        """K, B, M and error of a network along a press, shape (n, 4), and the slope of its force at rest [N/m]."""
        press, start, choice, settings = case
        probe, curve = network.learn(press._replace(surface=settings), choice, start)
        return curve, network.tangent(probe, press.rest)

    learned = runs.map_each(learn, {name: [(*case, *how) for case in cases] for name, how in choices.items()})
    answers = {
        name: [identified(press, curve) for (press, _), (curve, _) in zip(cases, results, strict=True)]
        for name, results in learned.items()
    }
    squares = [identified(press, press.squares) for press, _ in cases]
    by_method = (
        [identified(p, p.squares) for p in presses],
        answers["own"],
        [identified(p, p.matched) for p in presses],
    )
    slopes, unscaled = (np.array([slope for _, slope in learned[name]]) for name in ("own", "unscaled"))
    return MethodComparison(
        presses[0],
        [curve for curve, _ in learned["own"][: min(5, len(network.starts(runs)))]],
        dict(zip(METHODS, by_method, strict=True)),
        [Pair(*both) for both in zip(squares, answers["own"], strict=True)],
        [b.K / a.K for a, b in zip(answers["own"], answers["other inputs"], strict=True)],
        [*map(float, np.abs(unscaled / slopes))],
    )
