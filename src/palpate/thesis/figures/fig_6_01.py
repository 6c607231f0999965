"""Figure 6.1: the first four seconds of least squares on styrofoam."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from palpate.thesis.claims import Claim
from palpate.thesis.least_squares import press_runs, settling
from palpate.thesis.runs import Runs

if TYPE_CHECKING:
    from matplotlib.figure import Figure

NUMBER = "6.1"
TITLE = "Least squares on foam: the first four seconds"
CAPTION = (
    "Recursive least squares from the moment the force reaches 5 N, on a foam that is a spring, a damper and a mass, "
    "and on one that relaxes. The thesis: practically identified in the first 0.12 s (dotted). Insets: the first "
    "0.3 s. (g), (h): what the thesis does not give, varied."
)
PARAMETERS = press_runs.FOAMS
LIMIT = 0.12


def run(runs: Runs) -> settling.Data:
    """One press a seed on each foam."""
    return settling.run(runs, PARAMETERS)


def check(data: settling.Data) -> Sequence[Claim]:
    """K, B and M one by one."""
    return settling.settling_claims(data, "plain foam", "RLS-S1", "fig. 6.1, sec. 6.1", LIMIT)


def plot(data: settling.Data) -> Figure:
    """The six panels, and the time to settle."""
    return settling.plot(data, LIMIT)
