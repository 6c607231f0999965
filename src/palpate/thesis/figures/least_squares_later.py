"""Figures 6.2 and 6.5: least squares some time later, on styrofoam and on rubber."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from palpate.bench import Experiment
from palpate.thesis.claims import Claim
from palpate.thesis.least_squares import press_runs, steady_state
from palpate.thesis.runs import Runs

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, eq=False)
class Later:
    """The figure of one surface; `judged` is the last of its parameters, and the others are shown beside it."""

    NUMBER: str
    TITLE: str
    CAPTION: str
    PARAMETERS: Mapping[str, Experiment]
    judged: str  # of the parameters
    called: str  # in a sentence
    claim: str  # the beginning of its claims' names
    ratio: str  # the name of the claim on single samples
    apart: float  # K_e and f/x at most, as a share
    level: float  # of K_e [kN/m]
    agree: tuple[
        str, str, str
    ]  # claim, the thesis' value, why; with places for the shares at 4 s and at 8 s [%]
    why: tuple[str, str, str]  # the levels of K_e, of B and of M are what they are

    @property
    def source(self) -> str:
        """Where the thesis has it."""
        return f"fig. {self.NUMBER}, sec. 6.1"

    def run(self, runs: Runs) -> steady_state.Data:
        """One press a seed on each surface."""
        return steady_state.run(runs, self.PARAMETERS, vary=len(self.PARAMETERS))

    def check(self, data: steady_state.Data) -> Sequence[Claim]:
        """How near K_e is to f/x, its level, B and M, and the ratios."""
        level, damping, inertia = self.why
        id_, source = self.claim, self.source
        return [
            self._agreement(data),
            steady_state.level_claim(data, f"{id_}.K", source, self.called, self.level, level),
            steady_state.damping_claim(data, f"{id_}.B", source, damping),
            steady_state.inertia_claim(data, f"{id_}.M", source, inertia),
            steady_state.ratio_claim(data, self.ratio),
        ]

    def _agreement(self, data: steady_state.Data) -> Claim:
        claim, thesis, note = self.agree
        found = data.found[self.judged]
        early = 100.0 * press_runs.median([f.early_apart for f in found])
        late = 100.0 * press_runs.median([f.apart for f in found])
        return steady_state.found_claim(
            data,
            (self.claim, self.source, claim, thesis),
            lambda f: 100.0 * f.apart,
            lambda f: abs(f.apart) < self.apart,
            "%",
            f"K_e at 8 s within {100 * self.apart:.0f} % of mean force over mean displacement from 6 to 8 s",
            note.format(early=early, late=late),
        )

    def plot(self, data: steady_state.Data) -> Figure:
        """The six panels, the differences, and the ratios."""
        return steady_state.plot(data, self.apart)


FOAM = Later(
    "6.2",
    "Least squares on foam: some time later",
    (
        "The press of figure 6.1 between 6 and 8 s, f/x and K_e on one scale (dashed: mean of f/x). The thesis: "
        "K_e 7.2 against f/x 6.8 kN/m, less than 6 % apart; B_e plausible; M_e negative. (g): the difference "
        "under varied conditions. (h): estimates from single samples by the ratios of section 5.1."
    ),
    press_runs.FOAMS,
    "relaxing foam",
    "the foam",
    "least-squares-foam-level",
    "single-sample-ratios.foam",
    0.06,
    7.2,
    (
        "K_e and f/x are almost the same, less than 6 % apart.",
        "7.2 against 6.8 kN/m (5.9 %)",
        (
            "Both divide the same force by the same displacement, so their agreement proves little: both are a "
            "quarter to a third above the surface's own stiffness, because the displacement counts from the 5 N "
            "point. A relaxing foam causes the thesis' gap of 6 %, with K_e above f/x, and the gap shrinks with time "
            "({early:.1f} % at 4 s, {late:.1f} % at 8 s); a foam without memory gives none."
        ),
    ),
    (
        (
            "The stiffness of the plain foam was chosen to give f/x near 6.8 kN/m, so this level is an input and no "
            "confirmation."
        ),
        (
            "On the plain foam the 5 N offset increases B_e by a third, and the lag of the force cancels two thirds "
            "of that (see why-negative-mass). The relaxing foam has no single damping, and the estimate there depends "
            "on time."
        ),
        (
            "The cause is not a small M_e: the force lags, and a lagging force acts as a negative mass (see "
            "why-negative-mass). On the relaxing foam it would be negative even with perfect signals. The more "
            "damping, the more negative; with little damping it is positive."
        ),
    ),
)
RUBBER = Later(
    "6.5",
    "Least squares on rubber: some time later",
    (
        "The press of figure 6.4 between 6 and 8 s, f/x and K_e on one scale (dashed: mean of f/x). The thesis: "
        "both 44 kN/m; B_e plausible; M_e negative. (g): the difference under varied conditions. (h): "
        "estimates from single samples by the ratios of section 5.1."
    ),
    {"rubber": press_runs.RUBBER},
    "rubber",
    "the rubber",
    "least-squares-rubber-level",
    "single-sample-ratios.rubber",
    0.02,
    44.0,
    (
        "K_e and f/x are the same to two digits.",
        "44 and 44 kN/m",
        (
            "Both divide the same force by the same displacement. They are a quarter above the rubber's own 34.5 "
            "kN/m, because the displacement counts from the 5 N point while the force is total."
        ),
    ),
    (
        (
            "The rubber's stiffness was chosen for this, so the level is an input and no confirmation. The "
            "penetration is only half a millimetre: the exact 5 N point changes K_e by several percent from seed to "
            "seed."
        ),
        (
            "The 5 N offset increases B_e by a half, and the lag of the force reduces it by more than that (see "
            "why-negative-mass): a plausible sum is not necessarily correct."
        ),
        (
            "A rubber of 50 g cannot weigh minus two kilograms; the lag of the force causes this estimate (see "
            "why-negative-mass)."
        ),
    ),
)
STUDIES = (FOAM, RUBBER)
