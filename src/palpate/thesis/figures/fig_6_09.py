"""Figure 6.9: the first four seconds of the neural identifier on rubber."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from palpate.thesis.claims import Claim
from palpate.thesis.neural_identifier import claims, figure, network
from palpate.thesis.runs import Runs

if TYPE_CHECKING:
    from matplotlib.figure import Figure

NUMBER = "6.9"
TITLE = "Neural identifier on rubber: the first four seconds"
CAPTION = (
    "As figure 6.7, on a rubber of its own (f/x 62 kN/m here, 44 in figure 6.5), asked at 0.2 mm, 10 mm/s, 0.5 m/s². "
    "The thesis: about 0.6 s, K 56 beside f/x 62 kN/m, B smaller than that of least squares, M small and positive."
)
PARAMETERS = network.RUBBER


def run(runs: Runs) -> figure.Data:
    """One press a noise seed, ten starts on each."""
    return figure.run(runs, PARAMETERS, "rubber")


def check(data: figure.Data) -> Sequence[Claim]:
    """When K, B and M are there, and what they are."""
    return claims.claims(data.grounds, claims.RUBBER, "NN-R", "fig. 6.9, sec. 6.2")


def plot(data: figure.Data) -> Figure:
    """The six panels, and where the claims hold."""
    return figure.plot(data, claims.RUBBER, claims.RUBBER_BAND)
