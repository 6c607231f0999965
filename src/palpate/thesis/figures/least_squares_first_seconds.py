"""Figures 6.1 and 6.4: the first four seconds of least squares, on styrofoam and on rubber."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from palpate.bench import Experiment
from palpate.thesis.claims import Claim
from palpate.thesis.least_squares import press_runs, settling
from palpate.thesis.runs import Runs

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, eq=False)
class FirstSeconds:
    """The figure of one surface."""

    NUMBER: str
    TITLE: str
    CAPTION: str
    PARAMETERS: Mapping[str, Experiment]
    surface: str  # of the parameters, the one that is judged
    claim: str  # the beginning of its claims' names
    limit: float  # time within which all is settled [s]

    def run(self, runs: Runs) -> settling.Data:
        """One press a seed on each surface."""
        return settling.run(runs, self.PARAMETERS)

    def check(self, data: settling.Data) -> Sequence[Claim]:
        """K, B and M one by one."""
        source = f"fig. {self.NUMBER}, sec. 6.1"
        return settling.settling_claims(data, self.surface, self.claim, source, self.limit)

    def plot(self, data: settling.Data) -> Figure:
        """The six panels, and the time to settle."""
        return settling.plot(data, self.limit)


FOAM = FirstSeconds(
    "6.1",
    "Least squares on foam: the first four seconds",
    (
        "Recursive least squares from the moment the force reaches 5 N, on a foam that is a spring, a damper and a "
        "mass, and on one that relaxes. The thesis: practically identified in the first 0.12 s (dotted). Insets: the "
        "first 0.3 s. (g), (h): variation of parameters that the thesis does not state."
    ),
    press_runs.FOAMS,
    "plain foam",
    "least-squares-foam-settles",
    0.12,
)
RUBBER = FirstSeconds(
    "6.4",
    "Least squares on rubber: the first four seconds",
    (
        "Recursive least squares from the moment the force reaches 5 N, on rubber. The thesis: practically identified "
        "in the first 0.05 s (dotted). Insets: the first 0.3 s. (g), (h): variation of parameters that the thesis "
        "does not state."
    ),
    {"rubber": press_runs.RUBBER},
    "rubber",
    "least-squares-rubber-settles",
    0.05,
)
STUDIES = (FOAM, RUBBER)
