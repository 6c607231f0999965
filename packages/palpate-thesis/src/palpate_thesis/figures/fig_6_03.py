"""Figure 6.3: least squares on styrofoam from raw signals; and whether any one foam shows figures 6.1 to 6.3."""

from collections.abc import Callable, Sequence
from itertools import product
from typing import NamedTuple

import numpy as np

from palpate.bench import Experiment, with_values
from palpate_thesis.claims import ThesisClaim, claim
from palpate_thesis.drawing import ZERO, Figure
from palpate_thesis.figures import fig_6_02_05 as later
from palpate_thesis.least_squares import panels, press_runs
from palpate_thesis.least_squares.press_runs import PressEstimates
from palpate_thesis.runs import Runs

NUMBER = "6.3"
PLAIN_DAMPINGS = (5.0, 15.0, 30.0, 60.0, 100.0, 200.0, 300.0, 400.0)
BRANCHES = tuple(product((3000.0, 7000.0, 20000.0, 40000.0), (0.02, 0.1, 0.23, 0.6), (5.0, 60.0)))
NEAR = 0.06


def _plain(damping: float) -> Experiment:
    return with_values(press_runs.PLAIN, {"surface.damping": damping, "surface.mass": 0.05})


def _relaxing(branch: float, time: float, damping: float) -> Experiment:
    return with_values(
        press_runs.RELAXING,
        {"surface.branch_stiffness": branch, "surface.branch_time": time, "surface.damping": damping},
    )


PARAMETERS = {
    **{f"B {b:g}": _plain(b) for b in PLAIN_DAMPINGS},
    **{f"{k / 1000:g} kN/m, {t:g} s, B {b:g}": _relaxing(k, t, b) for k, t, b in BRANCHES},
}
"""The foams that are tried: without memory, and with a relaxing branch of so much stiffness and time."""
SHOWS: dict[str, Callable[[PressEstimates], bool]] = {
    "K in 0.12 s": lambda f: f.settled_K <= 0.12,
    "B in 0.12 s": lambda f: f.settled_B <= 0.12,
    "K = f/x": lambda f: abs(f.apart) < NEAR,
    "B > 0": lambda f: f.B > 0.0,
    "M < 0": lambda f: f.M < 0.0,
    "raw: K = f/x": lambda f: abs(f.apart_raw) < NEAR,
    "raw: B < 0": lambda f: f.B_raw < 0.0,
    "raw: M < 0": lambda f: f.M_raw < 0.0,
}
"""Sentences of figures 6.1 to 6.3 about a foam."""


class Data(NamedTuple):
    """The press of figure 6.2 from raw signals, and what each foam shows."""

    later: later.Data
    foams: dict[str, PressEstimates]

    @property
    def table(self) -> dict[str, list[bool]]:
        """Truth of each sentence in `SHOWS`, by foam."""
        return {name: [bool(shows(f)) for shows in SHOWS.values()] for name, f in self.foams.items()}


def run(runs: Runs) -> Data:
    """One press a seed on the foam; one on each of the others."""
    foams = runs.by_name(PARAMETERS, press_runs.press_estimates, 1)
    return Data(later.run(runs, "foam", press_runs.PLAIN), {name: each[0] for name, each in foams.items()})


def check(data: Data) -> Sequence[ThesisClaim]:
    """Signs of M and B, K, and all at once."""
    counts = {name: sum(row) for name, row in data.table.items()}
    most = max(counts.values())
    best = next(name for name, count in counts.items() if count == most)
    lacking = [what for what, shown in zip(SHOWS, data.table[best], strict=True) if not shown]
    lack = f"; the best lacks {', '.join(lacking)}" if lacking else ""
    return [
        *_raw_signs(data),
        claim(
            "least-squares-one-foam",
            most == len(SHOWS),
            most=most,
            sentences=len(SHOWS),
            best=best,
            lack=lack,
            such=sum(c == most for c in counts.values()),
            foams=len(counts),
            names=", ".join(SHOWS),
        ),
    ]


def _raw_signs(data: Data) -> list[ThesisClaim]:
    """Signs of M and B, and K, from raw signals."""
    raw = {
        "M": ("kg", "raw: M < 0", lambda f: f.M_raw),
        "B": ("N s/m", "raw: B < 0", lambda f: f.B_raw),
        "K": ("%", "raw: K = f/x", lambda f: 100.0 * f.apart_raw),
    }
    return [
        later.press_claim(data.later, f"least-squares-raw-signals.{key}", measure, SHOWS[shown], unit)
        for key, (unit, shown, measure) in raw.items()
    ]


def plot(data: Data) -> Figure:
    """The six panels from raw signals."""
    drawing, axes = panels.grid(3)
    press = data.later.shown
    panels.six(axes, "foam", press, "raw", (0.0, press_runs.FIRST))
    panels.calm_limits(axes[4], panels.calm_ratio(press, "force_sampled"))
    late = press_runs.between(press, 0.1, press_runs.FIRST)
    for axis, (key, (_, scale)) in zip(axes[1:6:2], panels.PARAMETERS.items(), strict=True):
        panels.calm_limits(axis, np.zeros(1), scale * press[f"{key}_raw"][late])
        axis.axhline(0.0, **ZERO)
    return drawing
