"""Figures 6.2 and 6.5: least squares some time later, where K_e and f/x can be compared, and the off-line ratios."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import msgspec
import numpy as np

from palpate.arrays import Array
from palpate.bench import Experiment
from palpate.records import Record
from palpate_thesis.claims import ThesisClaim, claim, spread
from palpate_thesis.drawing import STATED, ZERO, Figure
from palpate_thesis.least_squares import panels, press_runs
from palpate_thesis.least_squares.press_runs import PressEstimates, median
from palpate_thesis.runs import Runs

MOVING = 0.5
"""Seconds after the change-over in which the surface moves enough for B and M to be looked for."""
LEAST_VELOCITY = 1e-4
"""Least velocity of a sample that counts [m/s]; below it is rounding, less than an encoder count in a tick."""
LEAST_ACCELERATION = 0.05
"""Least acceleration of a sample that counts [m/s^2]; below it is the filter's residue at rest."""
QUANTILES = (10.0, 50.0, 90.0)
LEVEL, PLAUSIBLE = 0.10, 0.25
"""Maximum relative difference of K from the thesis' level, and of B from the surface's own."""


class Data(NamedTuple):
    """Data and criteria of a figure of the later slot."""

    surface: str
    shown: Record  # one press
    presses: list[PressEstimates]  # one a seed
    ratios: dict[str, Array]  # quantiles of K, B, M, each shape (seeds, 3)
    truth: dict[str, float]  # M, B, K of the surface


def run(runs: Runs, surface: str, experiment: Experiment) -> Data:
    """One press a seed."""
    each = runs.over_seeds(
        experiment, lambda record: (press_runs.press_estimates(record), by_ratios(press_runs.contact(record)))
    )
    own = msgspec.to_builtins(runs.laboratory.adapt(experiment).surface)
    return Data(
        surface,
        press_runs.contact(runs.record(experiment)),
        [estimates for estimates, _ in each],
        {key: np.array([quantiles[key] for _, quantiles in each]) for key in "KBM"},
        {"M": own["mass"], "B": press_runs.own_damping(own), "K": own["stiffness"]},
    )


def by_ratios(press: Record) -> dict[str, Array]:
    """Quantiles of single-sample estimates by the three ratios of sec. 5.1, each using the result of the previous one.

    K = f/x where all rests; B = (f - K x)/v while the surface moves, of the half of the samples with the smaller
    acceleration, for the thesis asks for none; M = (f - K x - B v)/a. A ratio needs its denominator: samples in which
    the encoders show no motion are left out.
    """
    rest, moving = press_runs.between(press, *press_runs.SLOT), press_runs.between(press, 0.0, MOVING)
    f, x = press["force_measured"], press["displacement"]
    v, a = press["vx_raw"][moving], press["ax_measured"][moving]
    stiffness = f[rest] / x[rest]
    rest_force = f[moving] - _middle(stiffness) * x[moving]
    used = (np.abs(v) > LEAST_VELOCITY) & (np.abs(a) <= np.median(np.abs(a)))
    damping = rest_force[used] / v[used]
    rest_force = rest_force - _middle(damping) * v
    used = np.abs(a) > LEAST_ACCELERATION
    inertia = rest_force[used] / a[used]
    return {
        key: np.percentile(values, QUANTILES) if len(values) else np.full(len(QUANTILES), np.nan)
        for key, values in (("K", stiffness), ("B", damping), ("M", inertia))
    }


def _middle(values: Array) -> float:
    """Median; NaN without values."""
    return float(np.median(values)) if len(values) else float("nan")


def press_claim(
    data: Data,
    id_: str,
    measure: Callable[[PressEstimates], float],
    holds: Callable[[PressEstimates], bool],
    unit: str,
    **numbers: Any,
) -> ThesisClaim:
    """Claim that is reproduced if it holds for most of the seeds.

    Args:
        data: of the figure.
        id_: of the claim.
        measure: the number to be printed.
        holds: True if it holds in one press.
        unit: of the number.
        numbers: further numbers for the claim's texts.
    """
    good = 2 * sum(map(holds, data.presses)) > len(data.presses)
    values = spread([measure(press) for press in data.presses], unit)
    return claim(id_, good, surface=data.surface, surfaces=f"{data.surface} {values}", **numbers)


def _ratio_claim(data: Data, id_: str) -> ThesisClaim:
    """The ratios of sec. 5.1: is it difficult to obtain B and M with them?"""
    scaled = {"K": 1e-3 * data.ratios["K"], "B": data.ratios["B"] / data.truth["B"], "M": data.ratios["M"]}
    return claim(
        id_,
        median(scaled["B"][:, 2] - scaled["B"][:, 0]) > 1.0,
        true_M=data.truth["M"],
        true_K=1e-3 * data.truth["K"],
        **{key: [median(values[:, i]) for i in range(3)] for key, values in scaled.items()},
    )


def plausible(press: PressEstimates) -> bool:
    """True if B_e is near the surface's own B."""
    return abs(press.B / press.true_B - 1.0) < PLAUSIBLE


@dataclass(frozen=True, eq=False)
class Later:
    """The figure of one surface."""

    NUMBER: str
    PARAMETERS: Experiment
    surface: str
    claim: str  # the beginning of its claims' names
    ratio: str  # the name of the claim on single samples
    printed: tuple[float, float]  # K_e and f/x [kN/m]
    digit: float  # half a unit of their last digit [kN/m]

    def run(self, runs: Runs) -> Data:
        """One press a seed."""
        return run(runs, self.surface, self.PARAMETERS)

    def check(self, data: Data) -> Sequence[ThesisClaim]:
        """How near K_e is to f/x, its level, B and M, and the ratios."""
        id_, kilo = self.claim, 1e3 * self.printed[0]
        limits = {"least": 100.0 * self.apart[0], "most": 100.0 * self.apart[1]}
        return [
            press_claim(data, id_, lambda f: 100.0 * f.apart, self.near, "%", **limits),
            press_claim(
                data, f"{id_}.K", lambda f: 1e-3 * f.K, lambda f: abs(f.K / kilo - 1.0) < LEVEL, "kN/m"
            ),
            press_claim(data, f"{id_}.B", lambda f: f.B, plausible, "N s/m", true_B=data.truth["B"]),
            press_claim(data, f"{id_}.M", lambda f: f.M, lambda f: f.M < 0.0, "kg"),
            _ratio_claim(data, self.ratio),
        ]

    @property
    def apart(self) -> tuple[float, float]:
        """Limits of K_e over f/x, less one, between which both can round to the printed values."""
        (stiffness, ratio), d = self.printed, self.digit
        return (stiffness - d) / (ratio + d) - 1.0, (stiffness + d) / (ratio - d) - 1.0

    def near(self, press: PressEstimates) -> bool:
        """True if K_e and f/x are as far apart as the printed values."""
        least, most = self.apart
        return least <= press.apart <= most

    def plot(self, data: Data) -> Figure:
        """The thesis' six panels in the later slot."""
        drawing, axes = panels.grid(3)
        press = data.shown
        panels.six(axes, self.surface, press, "thesis", press_runs.SLOT)
        axes[5].set_ylim(*axes[4].get_ylim())
        for axis in axes[4:6]:
            axis.axhline(1e-3 * press_runs.ratio(press), **STATED)
        inside = press_runs.between(press, *press_runs.SLOT)
        for axis, key in ((axes[1], "M"), (axes[3], "B")):
            panels.calm_limits(axis, np.zeros(1), press[f"{key}_thesis"][inside])
            axis.axhline(0.0, **ZERO)
        return drawing


_NAMES = ("least-squares-foam-level", "single-sample-ratios.foam")
FOAM = Later("6.2", press_runs.PLAIN, "foam", *_NAMES, printed=(7.2, 6.8), digit=0.05)
_NAMES = ("least-squares-rubber-level", "single-sample-ratios.rubber")
RUBBER = Later("6.5", press_runs.RUBBER, "rubber", *_NAMES, printed=(44.0, 44.0), digit=0.5)
STUDIES = (FOAM, RUBBER)
