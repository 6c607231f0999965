"""Figure 6.7: the first four seconds of the neural identifier on styrofoam."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from palpate.thesis.claims import Claim
from palpate.thesis.neural_identifier import claims, figure, network
from palpate.thesis.runs import Runs

if TYPE_CHECKING:
    from matplotlib.figure import Figure

NUMBER = "6.7"
TITLE = "Neural identifier on foam: the first four seconds"
CAPTION = (
    "A 3-4-1 network learns the force (learning rate 1e-4) and is asked for M, B and K at 2 mm, 10 mm/s, 1 m/s²; five "
    "starts, with least squares on the same press (dashed). The thesis: identified after about 0.6 s, K 6.6 beside f/x "
    "6.7 kN/m, B like that of least squares, M small and positive. (g), (h): output amplitude, initial weights and "
    "thresholds, which it does not give; a dot where a part of the claim holds."
)
PARAMETERS = network.FOAM


def run(runs: Runs) -> figure.Data:
    """One press a noise seed, ten starts on each."""
    return figure.run(runs, PARAMETERS, "foam")


def check(data: figure.Data) -> Sequence[Claim]:
    """When K, B and M are there, and what they are."""
    return claims.claims(data.grounds, claims.FOAM, "NN-S", "fig. 6.7, sec. 6.2")


def plot(data: figure.Data) -> Figure:
    """The six panels, and where the claims hold."""
    return figure.plot(data, claims.FOAM, claims.FOAM_BAND)
