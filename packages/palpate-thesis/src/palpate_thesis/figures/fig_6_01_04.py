"""Figures 6.1 and 6.4: the first four seconds of least squares, and how fast it settles, on foam and on rubber."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import NamedTuple

import numpy as np

from palpate.arrays import Array, Mask
from palpate.bench import Experiment
from palpate.records import Record
from palpate_thesis.claims import ThesisClaim, claim, spread
from palpate_thesis.drawing import STATED, Figure
from palpate_thesis.least_squares import panels, press_runs
from palpate_thesis.least_squares.press_runs import PressEstimates, median
from palpate_thesis.runs import VARIED_SEEDS, Runs

COVARIANCES = 10.0 ** np.arange(2, 13)
"""P(0) that are tried; the thesis does not give it."""
STARTS = {"2e5": 2e5, "2e4": 2e4}
"""K(0) of the thesis' text and of its listing [N/m]."""
SHAPES = {"P(0) = p I": (1.0, 1.0, 1.0), "P(0) = p diag(1, 1e4, 1e8)": (1.0, 1e4, 1e8)}
"""P(0) alike in all three, and in proportion to the squares of usual M, B and K."""
BAND = 0.10
HALF_DIGIT = 0.005
"""Half a unit of the last digit of the printed times, "0.12" and "0.05" [s]."""
RELAXING = "On {} the estimate follows the relaxation for seconds and the claim fails. "


class Data(NamedTuple):
    """Data and criteria of a figure of the first seconds."""

    shown: dict[str, Record]  # one press of each surface
    presses: dict[str, list[PressEstimates]]  # of each surface, over the seeds
    started: dict[str, dict[tuple[str, str], Array]]  # time to settle by K(0) and shape; of M, B, K by P(0)
    varied: dict[str, list[PressEstimates]]  # of the first surface


def _settle_by_start(runs: Runs, experiment: Experiment) -> dict[tuple[str, str], Array]:
    """Time to settle, shape (number of P(0), 3), the middle of a few seeds."""
    (each,) = runs.by_name(
        {"": experiment}, lambda record: _by_start(press_runs.contact(record)), VARIED_SEEDS
    ).values()
    return {key: np.median([settling[key] for settling in each], axis=0) for key in each[0]}


def _by_start(press: Record) -> dict[tuple[str, str], Array]:
    first = round(1e3 * press_runs.FIRST)
    phi, force = (values[:first] for values in press_runs.thesis_signals(press))
    stiffness = press_runs.ratio(press, (press_runs.FIRST - 1.0, press_runs.FIRST))

    def settling_times(k0: float, shape: tuple[float, ...], p: float) -> list[float]:
        theta = press_runs.trajectory(phi, force, (0.0, 0.0, k0), [p * share for share in shape])
        if abs(theta[-1, 2] / stiffness - 1.0) > BAND:
            return [np.inf] * 3
        return [
            press_runs.mass_settled_after(theta[:, 0]),
            *(press_runs.settled_after(theta[:, i]) for i in (1, 2)),
        ]

    return {
        (start, shape): np.array([settling_times(STARTS[start], SHAPES[shape], p) for p in COVARIANCES])
        for start, shape in product(STARTS, SHAPES)
    }


def settles(press: PressEstimates, key: str, limit: float) -> bool:
    """True if a coefficient has settled by the printed time, which stands for all that rounds to it."""
    return bool(getattr(press, f"settled_{key}") < limit + HALF_DIGIT)


def _settling_claim(data: Data, surface: str, id_: str, limit: float, key: str) -> ThesisClaim:
    times = {name: [getattr(f, f"settled_{key}") for f in presses] for name, presses in data.presses.items()}
    others = [name for name in data.presses if name != surface]
    fails = press_runs.failing(data.varied, lambda f: settles(f, key, limit))
    jump, later = _drift(data.shown[surface], limit)
    return claim(
        f"{id_}.{key}",
        median(times[surface]) < limit + HALF_DIGIT,
        key=key,
        limit=limit,
        surface=surface,
        times=times[surface],
        others="".join(f"; {name} {spread(times[name], 's')}" for name in others),
        half=HALF_DIGIT,
        edge=_edge(times[surface], limit + HALF_DIGIT),
        relaxing=RELAXING.format(others[0]) if others else "",
        held=_range_of_starts(data, surface, key, limit),
        jump=jump,
        later=later,
        where=press_runs.where_it_fails(fails, len(data.varied)),
    )


def _range_of_starts(data: Data, surface: str, key: str, limit: float) -> str:
    """Over which part of the sweep of P(0) and K(0) the claim holds."""
    column = "MBK".index(key)
    parts = [
        f"{reach_in_words(times[:, column] < limit + HALF_DIGIT)} with K(0) = {start} and {shape}"
        for (start, shape), times in data.started[surface].items()
    ]
    return (
        f"Of P(0), tried from p = 1e2 to 1e12, it holds for {'; '.join(parts)}. The verdict rests on 1e10 I."
    )


def reach_in_words(good: Mask) -> str:
    """The part of the sweep of p that is good, in words."""
    p = COVARIANCES[good]
    if not len(p):
        return "no p"
    if len(p) == len(COVARIANCES):
        return "every p"
    whole = bool(good[np.argmax(good) :].all())
    return f"p from {p.min():.0e} up" if whole else f"p = {', '.join(f'{v:.0e}' for v in p)}"


def _edge(times: list[float], limit: float) -> str:
    """How many seeds hold it, where that is no matter of course."""
    good = sum(t < limit for t in times)
    return "" if good in (0, len(times)) else f"It is close: {good} of {len(times)} seeds satisfy it. "


def _drift(press: Record, limit: float) -> tuple[float, float]:
    """How far M_e goes before the limit, and how far after [kg]."""
    values = press["M_thesis"][: round(1e3 * press_runs.FIRST)]
    split = round(1e3 * limit)
    return float(np.ptp(values[:split])), float(np.ptp(values[split:]))


@dataclass(frozen=True, eq=False)
class LeastSquaresFirstSeconds:
    """The figure of one surface."""

    NUMBER: str
    PARAMETERS: Mapping[str, Experiment]
    surface: str  # of the parameters, the one that is judged
    claim: str  # the beginning of its claims' names
    limit: float  # time within which all is settled [s]

    def run(self, runs: Runs) -> Data:
        """One press a seed on each surface; starting values and conditions varied."""
        surfaces = self.PARAMETERS
        first = next(iter(surfaces.values()))
        return Data(
            shown={name: press_runs.contact(runs.record(e)) for name, e in surfaces.items()},
            presses=runs.by_name(surfaces, press_runs.press_estimates),
            started={name: _settle_by_start(runs, e) for name, e in surfaces.items()},
            varied=press_runs.sweep(runs, press_runs.conditions(first)),
        )

    def check(self, data: Data) -> Sequence[ThesisClaim]:
        """K, B and M one by one: settled for good within the limit?"""
        return [_settling_claim(data, self.surface, self.claim, self.limit, key) for key in "KBM"]

    def plot(self, data: Data) -> Figure:
        """The thesis' six panels, with the limit of the time to settle."""
        drawing, axes = panels.grid(3)
        press = data.shown[self.surface]
        panels.six(axes, {self.surface: press}, "thesis", (0.0, press_runs.FIRST))
        panels.calm_limits(axes[4], panels.calm_ratio(press))
        for axis, (key, (_, scale)) in zip(axes[1:6:2], panels.PARAMETERS.items(), strict=True):
            panels.calm_limits(axis, scale * panels.calm(press, f"{key}_thesis", press_runs.FIRST))
        for axis in axes:
            axis.axvline(self.limit, **STATED)
        return drawing

    def beside(self, data: Data) -> Figure:
        """Time until K_e is settled under each varied condition; dashed: the limit."""
        return panels.settling(data.presses | data.varied, self.limit)


FOAM = LeastSquaresFirstSeconds("6.1", press_runs.FOAMS, "plain foam", "least-squares-foam-settles", 0.12)
RUBBER = LeastSquaresFirstSeconds(
    "6.4", {"rubber": press_runs.RUBBER}, "rubber", "least-squares-rubber-settles", 0.05
)
STUDIES = (FOAM, RUBBER)
