"""Figures 6.1 and 6.4: the first four seconds of least squares, and how fast it settles, on foam and on rubber."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import NamedTuple

import numpy as np

from palpate.arrays import Array, Mask
from palpate.bench import Experiment
from palpate.records import Record
from palpate.report import style
from palpate_thesis.claims import ThesisClaim, claim, spread
from palpate_thesis.least_squares import panels, press_runs
from palpate_thesis.least_squares.press_runs import PressEstimates, median
from palpate_thesis.look import STATED, Axes, Figure
from palpate_thesis.runs import VARIED_SEEDS, Runs

COVARIANCES = 10.0 ** np.arange(2, 13)
"""P(0) that are tried; the thesis does not give it."""
STARTS = {"2e5": 2e5, "2e4": 2e4}
"""K(0) of the thesis' text and of its listing [N/m]."""
SHAPES = {"P(0) = p I": (1.0, 1.0, 1.0), "P(0) = p diag(1, 1e4, 1e8)": (1.0, 1e4, 1e8)}
"""P(0) alike in all three, and in proportion to the squares of usual M, B and K."""
BAND = 0.10
RELAXING = "On {} the estimate follows the relaxation for seconds and the claim fails. "


class Data(NamedTuple):
    """Data and criteria of a figure of the first seconds."""

    shown: dict[str, Record]  # one press of each surface
    found: dict[str, list[PressEstimates]]  # over the seeds
    started: dict[str, dict[tuple[str, str], Array]]  # time to settle by K(0) and shape; of M, B, K by P(0)
    varied: dict[str, list[PressEstimates]]  # of the first surface


def run(runs: Runs, surfaces: Mapping[str, Experiment]) -> Data:
    """One press a seed on each surface; starting values and conditions varied."""
    first = next(iter(surfaces.values()))
    return Data(
        shown={name: press_runs.contact(runs.one(e)) for name, e in surfaces.items()},
        found=runs.by_name(surfaces, press_runs.numbers_of),
        started={name: _settle_by_start(runs, e) for name, e in surfaces.items()},
        varied=press_runs.sweep(runs, press_runs.conditions(first)),
    )


def _settle_by_start(runs: Runs, experiment: Experiment) -> dict[tuple[str, str], Array]:
    """Time to settle, shape (number of P(0), 3), the middle of a few seeds."""
    (each,) = runs.by_name(
        {"": experiment}, lambda record: _by_start(press_runs.contact(record)), VARIED_SEEDS
    ).values()
    return {key: np.median([one[key] for one in each], axis=0) for key in each[0]}


def _by_start(press: Record) -> dict[tuple[str, str], Array]:
    first = round(1e3 * press_runs.FIRST)
    phi, force = (values[:first] for values in press_runs.thesis_signals(press))
    stiffness = press_runs.ratio(press, (press_runs.FIRST - 1.0, press_runs.FIRST))

    def settling_times(k0: float, shape: tuple[float, ...], p: float) -> list[float]:
        theta = press_runs.trajectory(phi, force, (0.0, 0.0, k0), [p * share for share in shape])
        if abs(theta[-1, 2] / stiffness - 1.0) > BAND:
            return [np.inf] * 3
        return [press_runs.settled_after(theta[:, i]) for i in range(3)]

    return {
        (start, shape): np.array([settling_times(STARTS[start], SHAPES[shape], p) for p in COVARIANCES])
        for start, shape in product(STARTS, SHAPES)
    }


def _settling_claim(data: Data, surface: str, id_: str, limit: float, key: str) -> ThesisClaim:
    times = {name: [getattr(f, f"settled_{key}") for f in some] for name, some in data.found.items()}
    others = [name for name in data.found if name != surface]
    fails = press_runs.failing(data.varied, lambda f: bool(getattr(f, f"settled_{key}") <= limit))
    jump, later = _drift(data.shown[surface], limit)
    return claim(
        f"{id_}.{key}",
        median(times[surface]) <= limit,
        key=key,
        limit=limit,
        surface=surface,
        times=times[surface],
        others="".join(f"; {name} {spread(times[name], 's')}" for name in others),
        edge=_edge(times[surface], limit),
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
        f"{reach_in_words(times[:, column] <= limit)} with K(0) = {start} and {shape}"
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
    good = sum(t <= limit for t in times)
    return "" if good in (0, len(times)) else f"It is close: {good} of {len(times)} seeds satisfy it. "


def _drift(press: Record, limit: float) -> tuple[float, float]:
    """How far M_e goes before the limit, and how far after [kg]."""
    values = press["M_thesis"][: round(1e3 * press_runs.FIRST)]
    split = round(1e3 * limit)
    return float(np.ptp(values[:split])), float(np.ptp(values[split:]))


def plot(data: Data, limit: float) -> Figure:
    """The thesis' six panels; under them the time to settle, by starting values and by conditions."""
    drawing, axes = panels.grid(4)
    panels.six(axes, data.shown, "thesis", (0.0, press_runs.FIRST))
    _scales(axes, data.shown)
    for axis in axes[:6]:
        axis.axvline(limit, **STATED)
    _starts(axes[6], data, limit)
    _conditions(axes[7], data, limit)
    return drawing


def _scales(axes: list[Axes], presses: Mapping[str, Record]) -> None:
    some = list(presses.values())
    panels.calm_limits(axes[4], *map(panels.calm_ratio, some))
    for axis, (key, (_, scale)) in zip(axes[1:6:2], panels.PARAMETERS.items(), strict=True):
        curves = [scale * panels.calm(p, f"{key}_thesis", press_runs.FIRST) for p in some]
        panels.calm_limits(axis, *curves)
        inset = axis.inset_axes((0.52, 0.52, 0.46, 0.46))
        for name, p in presses.items():
            early = press_runs.between(p, 0.0, 0.3)
            line = scale * p[f"{key}_thesis"][early]
            inset.plot(p["t"][early], line, color=panels.COLORS[name], linewidth=1.0)
        panels.calm_limits(inset, *(scale * panels.calm(p, f"{key}_thesis", 0.3) for p in some))
        inset.spines[:].set(visible=True, color=style.LINE)
        inset.tick_params(labelsize=6.5)
        inset.set_xlim(0.0, 0.3)


def _starts(axis: Axes, data: Data, limit: float) -> None:
    panels.set_title(axis, "g", "Time until $K_e$ stays within 10 %, by P(0) and $K_e(0)$")
    for name, by_start in data.started.items():
        for (start, shape), times in by_start.items():
            mark, alpha, kind = ("o", 1.0, "") if shape == next(iter(SHAPES)) else ("s", 0.4, ", scaled")
            axis.plot(
                COVARIANCES,
                np.where(np.isfinite(times[:, 2]), times[:, 2], np.nan),
                {"2e5": "-", "2e4": "--"}[start],
                marker=mark,
                markersize=3.5,
                color=panels.COLORS[name],
                alpha=alpha,
                linewidth=1.1,
                label=f"K(0) {start}{kind}" if name == next(iter(data.started)) else None,
            )
    axis.axhline(limit, **STATED)
    axis.set(xscale="log", yscale="log", xlabel="p in P(0); no dot: $K_e$ never right", ylabel="time [s]")
    axis.legend()


def _conditions(axis: Axes, data: Data, limit: float) -> None:
    panels.set_title(axis, "h", f"Time to settle under varied conditions, {next(iter(data.found))}")
    nominal = {"as chosen": next(iter(data.found.values()))}
    colors = {"$K_e$": style.K, "$B_e$": style.B, "$M_e$": style.M}
    groups = {
        f"${key}_e$": {
            name: [getattr(f, f"settled_{key}") for f in some]
            for name, some in {**nominal, **data.varied}.items()
        }
        for key in "KBM"
    }
    panels.dots(axis, groups, colors)
    axis.axvline(limit, **STATED)
    axis.set(xscale="log", xlabel="time [s]")
    axis.legend()


@dataclass(frozen=True, eq=False)
class LeastSquaresFirstSeconds:
    """The figure of one surface."""

    NUMBER: str
    PARAMETERS: Mapping[str, Experiment]
    surface: str  # of the parameters, the one that is judged
    claim: str  # the beginning of its claims' names
    limit: float  # time within which all is settled [s]

    def run(self, runs: Runs) -> Data:
        """One press a seed on each surface."""
        return run(runs, self.PARAMETERS)

    def check(self, data: Data) -> Sequence[ThesisClaim]:
        """K, B and M one by one: settled for good within the limit?"""
        return [_settling_claim(data, self.surface, self.claim, self.limit, key) for key in "KBM"]

    def plot(self, data: Data) -> Figure:
        """The six panels, and the time to settle."""
        return plot(data, self.limit)


FOAM = LeastSquaresFirstSeconds("6.1", press_runs.FOAMS, "plain foam", "least-squares-foam-settles", 0.12)
RUBBER = LeastSquaresFirstSeconds(
    "6.4", {"rubber": press_runs.RUBBER}, "rubber", "least-squares-rubber-settles", 0.05
)
STUDIES = (FOAM, RUBBER)
