"""Figures 6.7 and 6.9: the first four seconds of the neural identifier, on styrofoam and on rubber."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from palpate.thesis.claims import Claim
from palpate.thesis.neural_identifier import claims, figure, network
from palpate.thesis.runs import Runs

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, eq=False)
class FirstSeconds:
    """The figure of one surface."""

    NUMBER: str
    TITLE: str
    CAPTION: str
    PARAMETERS: Any
    surface: str
    claim: str  # the beginning of its claims' names
    expected: Any  # what the thesis has
    band: Any  # what is shaded

    def run(self, runs: Runs) -> figure.Data:
        """One press a noise seed, ten starts on each."""
        return figure.run(runs, self.PARAMETERS, self.surface)

    def check(self, data: figure.Data) -> Sequence[Claim]:
        """Settling times and values of K, B and M."""
        return claims.claims(data.grounds, self.expected, self.claim, f"fig. {self.NUMBER}, sec. 6.2")

    def plot(self, data: figure.Data) -> Figure:
        """The six panels, and where the claims hold."""
        return figure.plot(data, self.expected, self.band)


FOAM = FirstSeconds(
    "6.7",
    "Neural identifier on foam: the first four seconds",
    (
        "A 3-4-1 network learns the force (learning rate 1e-4) and gives M, B and K by probes at 2 mm, 10 mm/s, 1 "
        "m/s²; five sets of initial weights, with least squares on the same press (dashed). The thesis: identified "
        "after about 0.6 s, K 6.6 beside f/x 6.7 kN/m, B like that of least squares, M small and positive. (g), (h): "
        "output amplitude, initial weights and thresholds, which it does not state; a dot where a part of the claim "
        "is true."
    ),
    network.FOAM,
    "foam",
    "network-foam",
    claims.FOAM,
    claims.FOAM_BAND,
)
RUBBER = FirstSeconds(
    "6.9",
    "Neural identifier on rubber: the first four seconds",
    (
        "As figure 6.7, on another rubber (f/x 62 kN/m here, 44 in figure 6.5), with probes at 0.2 mm, 10 mm/s, 0.5 "
        "m/s². The thesis: about 0.6 s, K 56 beside f/x 62 kN/m, B smaller than that of least squares, M small and "
        "positive."
    ),
    network.RUBBER,
    "rubber",
    "network-rubber",
    claims.RUBBER,
    claims.RUBBER_BAND,
)
STUDIES = (FOAM, RUBBER)
