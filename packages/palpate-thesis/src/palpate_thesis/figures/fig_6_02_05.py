"""Figures 6.2 and 6.5: least squares some time later, where K_e and f/x can be compared, and the off-line ratios."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import msgspec
import numpy as np

from palpate.arrays import Array
from palpate.bench import Experiment
from palpate.records import Record
from palpate.report import style
from palpate_thesis.claims import ThesisClaim, claim, spread
from palpate_thesis.least_squares import panels, press_runs
from palpate_thesis.least_squares.press_runs import PressEstimates, median
from palpate_thesis.look import STATED, ZERO, Axes, Figure
from palpate_thesis.runs import Runs

MOVING = 0.5
"""Seconds after the change-over in which the surface moves enough for B and M to be looked for."""
LEAST_VELOCITY = 1e-4
"""[m/s]; less is no encoder count in a tick but rounding."""
LEAST_ACCELERATION = 0.05
"""[m/s^2]; less is what the filter leaves of no motion."""
QUANTILES = (10.0, 50.0, 90.0)
LEVEL, PLAUSIBLE = 0.10, 0.25
"""By what share K may differ from the thesis' level, and B from the surface's own."""


class Data(NamedTuple):
    """Data and criteria of a figure of the later slot."""

    shown: dict[str, Record]  # one press of each surface
    found: dict[str, list[PressEstimates]]  # over the seeds
    varied: dict[str, dict[str, list[PressEstimates]]]  # of the first surface, or of each
    ratios: dict[str, Array]  # of the first surface: quantiles of K, B, M, each shape (seeds, 3)
    truth: dict[str, float]  # M, B, K of the first surface


def run(runs: Runs, surfaces: Mapping[str, Experiment], *, vary: int) -> Data:
    """One press a seed on each surface, and conditions varied on the first `vary` of them."""
    first = next(iter(surfaces.values()))
    each = runs.over_seeds(first, lambda record: by_ratios(press_runs.contact(record)))
    surface = msgspec.to_builtins(runs.laboratory.of(first).surface)
    return Data(
        shown={name: press_runs.contact(runs.one(e)) for name, e in surfaces.items()},
        found=runs.by_name(surfaces, press_runs.numbers_of),
        varied={
            name: press_runs.sweep(runs, press_runs.conditions(e))
            for name, e in list(surfaces.items())[:vary]
        },
        ratios={key: np.array([one[key] for one in each]) for key in "KBM"},
        truth={"M": surface["mass"], "B": press_runs.own_damping(surface), "K": surface["stiffness"]},
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
    left = f[moving] - _middle(stiffness) * x[moving]
    seen = (np.abs(v) > LEAST_VELOCITY) & (np.abs(a) <= np.median(np.abs(a)))
    damping = left[seen] / v[seen]
    left = left - _middle(damping) * v
    seen = np.abs(a) > LEAST_ACCELERATION
    inertia = left[seen] / a[seen]
    return {
        key: np.percentile(values, QUANTILES) if len(values) else np.full(len(QUANTILES), np.nan)
        for key, values in (("K", stiffness), ("B", damping), ("M", inertia))
    }


def _middle(values: Array) -> float:
    """The median; not a number of none, as where nothing moved."""
    return float(np.median(values)) if len(values) else float("nan")


def found_claim(
    data: Data,
    id_: str,
    measure: Callable[[PressEstimates], float],
    holds: Callable[[PressEstimates], bool],
    unit: str,
    **numbers: Any,
) -> ThesisClaim:
    """A row that holds if it does for most of the seeds on the first surface.

    Args:
        data: of the figure.
        id_: of the claim.
        measure: the number to be printed.
        holds: whether one press shows it.
        unit: of the number.
        numbers: further ones, for the claim's texts.
    """
    (surface, nominal), *others = data.found.items()
    fails = press_runs.failing(data.varied[surface], holds)
    there = [f" On {n} it holds for {sum(map(holds, some))} of {len(some)} seeds." for n, some in others]
    return claim(
        id_,
        2 * sum(map(holds, nominal)) > len(nominal),
        surface=surface,
        surfaces="; ".join(f"{n} {spread([measure(f) for f in v], unit)}" for n, v in data.found.items()),
        where=press_runs.where_it_fails(fails, len(data.varied[surface])) + "".join(there),
        **numbers,
    )


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


def plot(data: Data, near: float) -> Figure:
    """The thesis' six panels in the later slot; under them K against f/x by condition, and the ratios.

    Args:
        data: of the figure.
        near: share of f/x by which K may differ.
    """
    drawing, axes = panels.grid(4)
    panels.six(axes, data.shown, "thesis", press_runs.SLOT)
    axes[5].set_ylim(*axes[4].get_ylim())
    for name, press in data.shown.items():
        level = 1e-3 * press_runs.ratio(press)
        for axis in axes[4:6]:
            axis.axhline(level, color=panels.COLORS[name], linewidth=0.9, linestyle="--")
    presses = data.shown.values()
    for axis, key in ((axes[1], "M"), (axes[3], "B")):
        slots = (press[f"{key}_thesis"][press_runs.between(press, *press_runs.SLOT)] for press in presses)
        panels.calm_limits(axis, np.zeros(1), *slots)
        axis.axhline(0.0, **ZERO)
    _gaps(axes[6], data, near)
    _ratios(axes[7], data)
    return drawing


def _gaps(axis: Axes, data: Data, near: float) -> None:
    panels.set_title(axis, "g", "$K_e$ against f/x, under varied conditions")
    groups = {
        name: {
            condition: [100.0 * f.apart for f in some]
            for condition, some in {"as chosen": data.found[name], **data.varied[name]}.items()
        }
        for name in data.found
    }
    panels.dots(axis, groups, panels.COLORS)
    for limit in (-100.0 * near, 100.0 * near):
        axis.axvline(limit, **STATED)
    axis.set_xlabel(f"difference [%]; dotted: {100.0 * near:g} %")


def _ratios(axis: Axes, data: Data) -> None:
    surface = next(iter(data.found))
    panels.set_title(axis, "h", f"Ratios of single samples (bars: 8 of 10), {surface}")
    for i, key in enumerate("KBM"):
        low, middle, high = np.median(data.ratios[key], axis=0) / data.truth[key]
        axis.plot([low, high], [i, i], color=style.MEASURED, linewidth=6, solid_capstyle="butt")
        labels = (None, None) if i else ("ratios, middle", "least squares")
        axis.plot(middle, i, "|", color=style.INK, markersize=13, label=labels[0])
        fit = median([getattr(f, key) for f in data.found[surface]]) / data.truth[key]
        axis.plot(fit, i, "o", color=style.SERIES[0], label=labels[1])
    axis.axvline(1.0, **style.KNOWN, label="true")
    axis.set_xscale("symlog", linthresh=2.0)
    axis.set_yticks(range(3), ["K", "B", "M"])
    axis.set_ylim(2.6, -0.6)
    axis.set_xlabel("share of the true value")
    axis.legend(loc="upper left")


def plausible(found: PressEstimates) -> bool:
    """Whether B_e is near the surface's own B, which the thesis could only state and the bench can measure."""
    return abs(found.B / found.true_B - 1.0) < PLAUSIBLE


@dataclass(frozen=True, eq=False)
class Later:
    """The figure of one surface; `judged` is the last of its parameters, and the others are shown beside it."""

    NUMBER: str
    PARAMETERS: Mapping[str, Experiment]
    judged: str  # of the parameters
    claim: str  # the beginning of its claims' names
    ratio: str  # the name of the claim on single samples
    apart: float  # K_e and f/x at most, as a share
    level: float  # of K_e [kN/m]

    def run(self, runs: Runs) -> Data:
        """One press a seed on each surface."""
        return run(runs, self.PARAMETERS, vary=len(self.PARAMETERS))

    def check(self, data: Data) -> Sequence[ThesisClaim]:
        """How near K_e is to f/x, its level, B and M, and the ratios."""
        found, id_, kilo = data.found[self.judged], self.claim, 1e3 * self.level
        early, late = (100.0 * median([getattr(f, a) for f in found]) for a in ("early_apart", "apart"))
        return [
            found_claim(data, id_, lambda f: 100.0 * f.apart, self.near, "%", early=early, late=late),
            found_claim(
                data, f"{id_}.K", lambda f: 1e-3 * f.K, lambda f: abs(f.K / kilo - 1.0) < LEVEL, "kN/m"
            ),
            found_claim(data, f"{id_}.B", lambda f: f.B, plausible, "N s/m", true_B=data.truth["B"]),
            found_claim(data, f"{id_}.M", lambda f: f.M, lambda f: f.M < 0.0, "kg"),
            _ratio_claim(data, self.ratio),
        ]

    def near(self, found: PressEstimates) -> bool:
        """Whether K_e is near f/x."""
        return abs(found.apart) < self.apart

    def plot(self, data: Data) -> Figure:
        """The six panels, the differences, and the ratios."""
        return plot(data, self.apart)


_NAMES = ("least-squares-foam-level", "single-sample-ratios.foam")
FOAM = Later("6.2", press_runs.FOAMS, "relaxing foam", *_NAMES, apart=0.06, level=7.2)
_NAMES = ("least-squares-rubber-level", "single-sample-ratios.rubber")
RUBBER = Later("6.5", {"rubber": press_runs.RUBBER}, "rubber", *_NAMES, apart=0.02, level=44.0)
STUDIES = (FOAM, RUBBER)
