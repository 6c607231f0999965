"""Figures 6.1 to 6.5: least squares on foam, plain and from raw signals, and on rubber; and foams that show all."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import NamedTuple

import msgspec
import numpy as np

from palpate.bench import Experiment, with_values
from palpate.records import Record
from palpate_thesis.claims import MAJORITY, Sentence, ThesisClaim, claim
from palpate_thesis.drawing import STATED, ZERO, Figure
from palpate_thesis.least_squares import panels, press_runs
from palpate_thesis.least_squares.press_runs import FIRST, SLOT, PressEstimates, press_estimates
from palpate_thesis.runs import Runs

HALF_DIGIT = 0.005
"""Half a unit of the last digit of the printed times, "0.12" and "0.05" [s]."""
NEAR, LEVEL, PLAUSIBLE = 0.06, 0.10, 0.25
"""Maximum relative differences of K and f/x, of K and the thesis' level, and of B and the surface's own."""
EXPERIMENTS = {"foam": press_runs.PLAIN, "rubber": press_runs.RUBBER}


class Data(NamedTuple):
    """Presses on one surface, and on other foams."""

    shown: Record  # one press
    presses: list[PressEstimates]  # one a seed
    truth: dict[str, float]  # K, B, M of the surface
    foams: dict[str, PressEstimates]


@dataclass(frozen=True, eq=False)
class LeastSquaresFigure:
    """A figure of least squares on one surface."""

    NUMBER: str  # of the figure
    surface: str  # "foam" or "rubber"
    sentences: Sequence[Sentence]  # about its presses
    front: str = "thesis"  # end of the columns of M, B and K that are drawn
    slot: tuple[float, float] = (0.0, FIRST)  # that is drawn [s]
    stated: float | None = None  # time to settle in the thesis [s]
    foams: Mapping[str, Experiment] | None = None  # on which `ALL_AT_ONCE` is tried

    def run(self, runs: Runs) -> Data:
        """One press a seed on the surface; one on each of the other foams."""
        press = EXPERIMENTS[self.surface]
        truth = press_runs.own_values(msgspec.to_builtins(runs.laboratory.adapt(press).surface))
        foams = runs.by_name(self.foams or {}, press_estimates, 1)
        shown, presses = press_runs.contact(runs.record(press)), runs.over_seeds(press, press_estimates)
        return Data(shown, presses, truth, {name: each[0] for name, each in foams.items()})

    def check(self, data: Data) -> Sequence[ThesisClaim]:
        """Each sentence in most of the presses; and all at once on one foam."""
        samples = {key: [p.samples[key] for p in data.presses] for key in "BM"}
        middle = {key: np.nanmedian(values, axis=0) for key, values in samples.items()}
        numbers = {"truth": data.truth, "B": list(middle["B"] / data.truth["B"]), "M": list(middle["M"])}
        rows = [sentence.judge(data.presses, self.surface, **numbers) for sentence in self.sentences]
        return [*rows, _on_one_foam(data.foams)] if data.foams else rows

    def plot(self, data: Data) -> Figure:
        """The thesis' six panels in its slot, with the values that it states."""
        zero, calm = self.stated is None, 0.1 if self.front == "raw" else panels.CALM
        drawing, axes = panels.six(self.surface, data.shown, self.front, self.slot, calm, zero)
        if self.stated is not None:
            for axis in axes:
                axis.axvline(self.stated, **STATED)
        for axis in axes[1:4:2] if zero else ():
            axis.axhline(0.0, **ZERO)
        if self.slot == SLOT:
            axes[5].set_ylim(*axes[4].get_ylim())
            for axis in axes[4:6]:
                axis.axhline(1e-3 * press_runs.ratio(data.shown), **STATED)
        return drawing


def _settles(surface: str, limit: float) -> list[Sentence]:
    """K, B and M settle by the printed time, which stands for all that rounds to it."""

    def settles(key: str) -> Sentence:
        def time(press: PressEstimates) -> float:
            return float(getattr(press, f"settled_{key}"))

        numbers = {"key": key, "limit": limit, "half": HALF_DIGIT}
        id_ = f"least-squares-{surface}-settles.{key}"
        return Sentence(id_, lambda press: time(press) < limit + HALF_DIGIT, time, "s", MAJORITY, numbers)

    return [settles(key) for key in "KBM"]


def round_to(stiffness: float, ratio: float, digit: float) -> tuple[float, float]:
    """Limits of K_e over f/x, less one, if both round to these; `digit` is half a unit of their last digit."""
    return (stiffness - digit) / (ratio + digit) - 1.0, (stiffness + digit) / (ratio - digit) - 1.0


def _level(surface: str, stiffness: float, ratio: float, digit: float) -> list[Sentence]:
    """How near K_e is to f/x, its level, B and M, and the ratios of single samples; printed values in kN/m."""
    id_, (least, most) = f"least-squares-{surface}-level", round_to(stiffness, ratio, digit)

    def at_level(press: PressEstimates) -> bool:
        return abs(1e-3 * press.K / stiffness - 1.0) < LEVEL

    def is_vague(press: PressEstimates) -> bool:
        return press.samples["B"][2] - press.samples["B"][0] > press.true_B

    limits = {"least": 100.0 * least, "most": 100.0 * most}
    return [
        Sentence(id_, lambda p: least <= p.apart <= most, lambda p: 100.0 * p.apart, "%", MAJORITY, limits),
        Sentence(f"{id_}.K", at_level, lambda p: 1e-3 * p.K, "kN/m", MAJORITY),
        Sentence(f"{id_}.B", is_plausible, lambda p: p.B, "N s/m", MAJORITY),
        Sentence(f"{id_}.M", lambda p: p.M < 0.0, lambda p: p.M, "kg", MAJORITY),
        Sentence(f"single-sample-ratios.{surface}", is_vague, fraction=MAJORITY),
    ]


def is_plausible(press: PressEstimates) -> bool:
    """True if B_e is near the surface's own B."""
    return abs(press.B / press.true_B - 1.0) < PLAUSIBLE


_RAW = "least-squares-raw-signals"
RAW = (
    Sentence(f"{_RAW}.M", lambda p: p.M_raw < 0.0, lambda p: p.M_raw, "kg", MAJORITY),
    Sentence(f"{_RAW}.B", lambda p: p.B_raw < 0.0, lambda p: p.B_raw, "N s/m", MAJORITY),
    Sentence(f"{_RAW}.K", lambda p: abs(p.apart_raw) < NEAR, lambda p: 100.0 * p.apart_raw, "%", MAJORITY),
)
SHOWS: Mapping[str, Callable[[PressEstimates], bool]] = {
    "K in 0.12 s": lambda f: f.settled_K <= 0.12,
    "B in 0.12 s": lambda f: f.settled_B <= 0.12,
    "K = f/x": lambda f: abs(f.apart) < NEAR,
    "B > 0": lambda f: f.B > 0.0,
    "M < 0": lambda f: f.M < 0.0,
    **dict(zip(("raw: M < 0", "raw: B < 0", "raw: K = f/x"), (s.holds for s in RAW), strict=True)),
}
"""Properties of a foam that figures 6.1 to 6.3 show."""
ALL_AT_ONCE = Sentence(
    "least-squares-one-foam", lambda p: all(shows(p) for shows in SHOWS.values()), fraction=MAJORITY
)


def _foams() -> dict[str, Experiment]:
    """Foams without memory, and with a relaxing branch of so much stiffness and time."""
    foams = {
        f"B {b:g}": with_values(press_runs.PLAIN, {"surface.damping": b, "surface.mass": 0.05})
        for b in (5.0, 15.0, 30.0, 60.0, 100.0, 200.0, 300.0, 400.0)
    }
    for k, t, b in product((3000.0, 7000.0, 20000.0, 40000.0), (0.02, 0.1, 0.23, 0.6), (5.0, 60.0)):
        branch = {"surface.branch_stiffness": k, "surface.branch_time": t, "surface.damping": b}
        foams[f"{k / 1000:g} kN/m, {t:g} s, B {b:g}"] = with_values(press_runs.RELAXING, branch)
    return foams


def _on_one_foam(foams: Mapping[str, PressEstimates]) -> ThesisClaim:
    table = {name: [bool(shows(press)) for shows in SHOWS.values()] for name, press in foams.items()}
    best = max(table, key=lambda name: sum(table[name]))
    most = sum(table[best])
    lacking = ", ".join(what for what, shown in zip(SHOWS, table[best], strict=True) if not shown)
    return claim(
        ALL_AT_ONCE.id,
        most == len(SHOWS),
        most=most,
        sentences=len(SHOWS),
        best=best,
        lack=f"; the best lacks {lacking}" if lacking else "",
        such=sum(sum(row) == most for row in table.values()),
        foams=len(table),
        names=", ".join(SHOWS),
    )


STUDIES = (
    LeastSquaresFigure("6.1", "foam", _settles("foam", 0.12), stated=0.12),
    LeastSquaresFigure("6.2", "foam", _level("foam", 7.2, 6.8, 0.05), slot=SLOT),
    LeastSquaresFigure("6.3", "foam", RAW, "raw", foams=_foams()),
    LeastSquaresFigure("6.4", "rubber", _settles("rubber", 0.05), stated=0.05),
    LeastSquaresFigure("6.5", "rubber", _level("rubber", 44.0, 44.0, 0.5), slot=SLOT),
)
