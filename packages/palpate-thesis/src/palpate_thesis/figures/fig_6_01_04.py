"""Figures 6.1 and 6.4: the first four seconds of least squares, and how fast it settles, on foam and on rubber."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from palpate.bench import Experiment
from palpate.records import Record
from palpate_thesis.claims import ThesisClaim, claim
from palpate_thesis.drawing import STATED, Figure
from palpate_thesis.least_squares import panels, press_runs
from palpate_thesis.least_squares.press_runs import PressEstimates, median
from palpate_thesis.runs import VARIED_SEEDS, Runs

HALF_DIGIT = 0.005
"""Half a unit of the last digit of the printed times, "0.12" and "0.05" [s]."""


class Data(NamedTuple):
    """Data and criteria of a figure of the first seconds."""

    shown: Record  # one press
    presses: list[PressEstimates]  # one a seed
    varied: dict[str, list[PressEstimates]]


def settles(press: PressEstimates, key: str, limit: float) -> bool:
    """True if a coefficient has settled by the printed time, which stands for all that rounds to it."""
    return bool(getattr(press, f"settled_{key}") < limit + HALF_DIGIT)


def _drift(press: Record, limit: float) -> tuple[float, float]:
    """How far M_e goes before the limit, and how far after [kg]."""
    values = press["M_thesis"][: round(1e3 * press_runs.FIRST)]
    split = round(1e3 * limit)
    return float(np.ptp(values[:split])), float(np.ptp(values[split:]))


@dataclass(frozen=True, eq=False)
class LeastSquaresFirstSeconds:
    """The figure of one surface."""

    NUMBER: str
    PARAMETERS: Experiment
    surface: str
    claim: str  # the beginning of its claims' names
    limit: float  # time within which all is settled [s]

    def run(self, runs: Runs) -> Data:
        """One press a seed; conditions varied."""
        return Data(
            press_runs.contact(runs.record(self.PARAMETERS)),
            runs.over_seeds(self.PARAMETERS, press_runs.press_estimates),
            runs.by_name(press_runs.conditions(self.PARAMETERS), press_runs.press_estimates, VARIED_SEEDS),
        )

    def check(self, data: Data) -> Sequence[ThesisClaim]:
        """K, B and M one by one: settled for good within the limit?"""
        jump, later = _drift(data.shown, self.limit)
        times = {key: [getattr(press, f"settled_{key}") for press in data.presses] for key in "KBM"}
        return [
            claim(
                f"{self.claim}.{key}",
                median(times[key]) < self.limit + HALF_DIGIT,
                key=key,
                limit=self.limit,
                surface=self.surface,
                times=times[key],
                half=HALF_DIGIT,
                jump=jump,
                later=later,
            )
            for key in "KBM"
        ]

    def plot(self, data: Data) -> Figure:
        """The thesis' six panels, with the limit of the time to settle."""
        drawing, axes = panels.grid(3)
        panels.six(axes, self.surface, data.shown, "thesis", (0.0, press_runs.FIRST))
        panels.calm_limits(axes[4], panels.calm_ratio(data.shown))
        for axis, (key, (_, scale)) in zip(axes[1:6:2], panels.PARAMETERS.items(), strict=True):
            panels.calm_limits(axis, scale * panels.calm(data.shown, f"{key}_thesis", press_runs.FIRST))
        for axis in axes:
            axis.axvline(self.limit, **STATED)
        return drawing

    def beside(self, data: Data) -> Figure:
        """Time until K_e is settled under each varied condition; dashed: the limit."""
        return panels.settling({"as chosen": data.presses, **data.varied}, self.limit)


FOAM = LeastSquaresFirstSeconds("6.1", press_runs.PLAIN, "foam", "least-squares-foam-settles", 0.12)
RUBBER = LeastSquaresFirstSeconds("6.4", press_runs.RUBBER, "rubber", "least-squares-rubber-settles", 0.05)
STUDIES = (FOAM, RUBBER)
