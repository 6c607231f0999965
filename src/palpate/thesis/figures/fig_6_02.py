"""Figure 6.2: least squares on styrofoam, some time later."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from palpate.thesis.claims import Claim
from palpate.thesis.least_squares import press_runs, steady_state
from palpate.thesis.runs import Runs

if TYPE_CHECKING:
    from matplotlib.figure import Figure

NUMBER = "6.2"
TITLE = "Least squares on foam: some time later"
CAPTION = (
    "The press of figure 6.1 between 6 and 8 s, f/x and K_e on one scale (dashed: mean of f/x). The thesis: K_e 7.2 "
    "against f/x 6.8 kN/m, less than 6 % apart; B_e plausible; M_e negative. (g): the difference under varied "
    "conditions. (h): what single samples give by the ratios of section 5.1."
)
PARAMETERS = press_runs.FOAMS
SOURCE = "fig. 6.2, sec. 6.1"
APART = 0.06


def run(runs: Runs) -> steady_state.Data:
    """One press a seed on each foam."""
    return steady_state.run(runs, PARAMETERS, vary=2)


def check(data: steady_state.Data) -> Sequence[Claim]:
    """How near K_e is to f/x, its level, B and M, and the ratios."""
    return [
        _apart(data),
        _level(data),
        _damping(data),
        _inertia(data),
        steady_state.ratio_claim(data, "RLS-RATIO.S"),
    ]


def _apart(data: steady_state.Data) -> Claim:
    early = 100.0 * press_runs.median([f.early_apart for f in data.found["relaxing foam"]])
    late = 100.0 * press_runs.median([f.apart for f in data.found["relaxing foam"]])
    return steady_state.found_claim(
        data,
        (
            "RLS-S2",
            SOURCE,
            "K_e and f/x are almost the same, less than 6 % apart.",
            "7.2 against 6.8 kN/m (5.9 %)",
        ),
        lambda f: 100.0 * f.apart,
        lambda f: abs(f.apart) < APART,
        "%",
        "K_e at 8 s within 6 % of mean force over mean displacement from 6 to 8 s",
        "Both divide the same force by the same displacement, so that they agree says little about either: both are a "
        "quarter to a third above the surface's own stiffness, since the displacement counts from the 5 N point. The "
        "thesis' gap of 6 % with K_e above f/x is what a foam that relaxes gives, and it shrinks with time "
        f"({early:.1f} % at 4 s, {late:.1f} % at 8 s); a foam without memory gives none.",
    )


def _level(data: steady_state.Data) -> Claim:
    return steady_state.level_claim(
        data,
        "RLS-S2.K",
        SOURCE,
        "the foam",
        7.2,
        "The stiffness of the plain foam was chosen for f/x to come out near 6.8 kN/m, so this level is put in and no "
        "confirmation.",
    )


def _damping(data: steady_state.Data) -> Claim:
    return steady_state.damping_claim(
        data,
        "RLS-S2.B",
        SOURCE,
        "On the plain foam the 5 N offset puts a third on B_e, and "
        "the lag of the force takes two thirds of that off again (see why-negative-mass). The relaxing foam has no "
        "single damping, and the estimate there depends on how long one waits.",
    )


def _inertia(data: steady_state.Data) -> Claim:
    return steady_state.inertia_claim(
        data,
        "RLS-S2.M",
        SOURCE,
        "Not because M_e is small: the force arrives late, and a late force looks like a negative mass (see "
        "why-negative-mass). On the relaxing foam it would be negative even with perfect signals. The more damping, "
        "the more negative; with little damping it is positive.",
    )


def plot(data: steady_state.Data) -> Figure:
    """The six panels, the differences, and the ratios."""
    return steady_state.plot(data, APART)
