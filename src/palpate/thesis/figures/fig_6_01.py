"""Figure 6.1: the first four seconds of least squares on styrofoam."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from palpate.thesis import rls, rls_first
from palpate.thesis.claims import Claim
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
PARAMETERS = rls.FOAMS
LIMIT = 0.12


def run(runs: Runs) -> rls_first.Data:
    """One press a seed on each foam."""
    return rls_first.run(runs, PARAMETERS)


def check(data: rls_first.Data) -> Sequence[Claim]:
    """K, B and M one by one."""
    return rls_first.settling_claims(data, "plain foam", "RLS-S1", "fig. 6.1, sec. 6.1", LIMIT)


def plot(data: rls_first.Data) -> Figure:
    """The six panels, and the time to settle."""
    return rls_first.plot(data, LIMIT)
