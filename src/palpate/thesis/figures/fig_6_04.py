"""Figure 6.4: the first four seconds of least squares on rubber."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from palpate.thesis.claims import Claim
from palpate.thesis.least_squares import press_runs, settling
from palpate.thesis.runs import Runs

if TYPE_CHECKING:
    from matplotlib.figure import Figure

NUMBER = "6.4"
TITLE = "Least squares on rubber: the first four seconds"
CAPTION = (
    "Recursive least squares from the moment the force reaches 5 N, on rubber. The thesis: practically identified in "
    "the first 0.05 s (dotted). Insets: the first 0.3 s. (g), (h): what the thesis does not give, varied."
)
PARAMETERS = {"rubber": press_runs.RUBBER}
LIMIT = 0.05


def run(runs: Runs) -> settling.Data:
    """One press a seed."""
    return settling.run(runs, PARAMETERS)


def check(data: settling.Data) -> Sequence[Claim]:
    """K, B and M one by one."""
    return settling.settling_claims(data, "rubber", "RLS-R1", "fig. 6.4, sec. 6.1", LIMIT)


def plot(data: settling.Data) -> Figure:
    """The six panels, and the time to settle."""
    return settling.plot(data, LIMIT)
