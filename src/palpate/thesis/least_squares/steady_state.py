"""A later slot of an identification, where K_e and f/x can be compared, and the off-line ratios: figures 6.2, 6.5."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import msgspec
import numpy as np

from palpate.arrays import Array
from palpate.bench import Experiment
from palpate.records import Record
from palpate.report import style
from palpate.thesis.claims import Claim, decided, spread
from palpate.thesis.laboratory.surfaces import own_damping
from palpate.thesis.least_squares import panels, press_runs
from palpate.thesis.least_squares.press_runs import Found, median
from palpate.thesis.runs import Runs

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOVING = 0.5
"""Seconds after the change-over in which the surface moves enough for B and M to be looked for."""
LEAST_VELOCITY = 1e-4
"""[m/s]; less is no encoder count in a tick but rounding."""
LEAST_ACCELERATION = 0.05
"""[m/s^2]; less is what the filter leaves of no motion."""
QUANTILES = (10.0, 50.0, 90.0)
LEVEL, PLAUSIBLE = 0.10, 0.25
"""By what share K may differ from the thesis' level, and B from the surface's own."""


@dataclass(frozen=True)
class Data:
    """Data and criteria of a figure of the later slot."""

    shown: dict[str, Record]  # one press of each surface
    found: dict[str, list[Found]]  # over the seeds
    varied: dict[str, dict[str, list[Found]]]  # of the first surface, or of each
    ratios: dict[
        str, Array
    ]  # of the first surface: quantiles of K, B, M from single samples, shape (seeds, 3)
    truth: dict[str, float]  # M, B, K of the first surface


def run(runs: Runs, surfaces: Mapping[str, Experiment], *, vary: int) -> Data:
    """One press a seed on each surface, and conditions varied on the first `vary` of them."""
    first = next(iter(surfaces.values()))
    each = runs.over_seeds(first, lambda record: by_ratios(press_runs.contact(record)))
    surface = msgspec.to_builtins(runs.laboratory.of(first).surface)
    return Data(
        shown={name: press_runs.contact(runs.one(e)) for name, e in surfaces.items()},
        found={name: runs.over_seeds(e, press_runs.found) for name, e in surfaces.items()},
        varied={
            name: press_runs.swept(runs, press_runs.conditions(e))
            for name, e in list(surfaces.items())[:vary]
        },
        ratios={key: np.array([one[key] for one in each]) for key in "KBM"},
        truth={"M": surface["mass"], "B": own_damping(surface), "K": surface["stiffness"]},
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
    what: tuple[str, str, str, str],
    measure: Callable[[Found], float],
    holds: Callable[[Found], bool],
    unit: str,
    tolerance: str,
    why: str,
) -> Claim:
    """A row that holds if it does for most of the seeds on the first surface.

    Args:
        data: of the figure.
        what: id, source, the claim in words, the thesis' value.
        measure: the number to be printed.
        holds: whether one press shows it.
        unit: of the number.
        tolerance: the threshold in words.
        why: first part of the note.
    """
    (surface, nominal), *_ = data.found.items()
    fails = press_runs.failing(data.varied[surface], holds)
    measured = "; ".join(f"{n} {spread([measure(f) for f in some], unit)}" for n, some in data.found.items())
    others = [n for n in data.found if n != surface]
    there = "".join(_elsewhere(n, sum(map(holds, data.found[n])), len(data.found[n])) for n in others)
    note = f"{why} {press_runs.where_it_fails(fails, len(data.varied[surface]))}{there}"
    verdict = decided(2 * sum(map(holds, nominal)) > len(nominal))
    return Claim(
        what[0], what[1], what[2], what[3], measured, f"{tolerance}; most seeds, {surface}", verdict, note
    )


def level_claim(data: Data, id_: str, source: str, name: str, level: float, why: str) -> Claim:
    """Whether K_e comes to the thesis' level [kN/m] on the surface of this name."""
    return found_claim(
        data,
        (id_, source, f"K_e of {name} is {level:g} kN/m.", f"{level:g} kN/m"),
        lambda f: 1e-3 * f.K,
        lambda f: abs(f.K / (1e3 * level) - 1.0) < LEVEL,
        "kN/m",
        f"within {100 * LEVEL:g} % of {level:g} kN/m",
        why,
    )


def damping_claim(data: Data, id_: str, source: str, why: str) -> Claim:
    """Whether B_e is plausible, which the thesis could only state and the bench can measure."""
    return found_claim(
        data,
        (id_, source, "B_e is plausible.", "in words"),
        lambda f: f.B,
        lambda f: abs(f.B / f.true_B - 1.0) < PLAUSIBLE,
        "N s/m",
        f"within {100 * PLAUSIBLE:g} % of the surface's own B, here {data.truth['B']:g} N s/m",
        f"The thesis could not check it; the bench can. {why}",
    )


def inertia_claim(data: Data, id_: str, source: str, why: str) -> Claim:
    """Whether M_e is negative."""
    return found_claim(
        data,
        (id_, source, "M_e is negative.", "negative"),
        lambda f: f.M,
        lambda f: f.M < 0.0,
        "kg",
        "below zero at 8 s",
        why,
    )


def _elsewhere(name: str, good: int, among: int) -> str:
    return f" On {name} it holds for {good} of {among} seeds."


def ratio_claim(data: Data, id_: str) -> Claim:
    """The ratios of sec. 5.1: is it difficult to obtain B and M with them?"""
    low, _, high = (data.ratios["B"][:, i] / data.truth["B"] for i in range(3))
    m_low, _, m_high = (data.ratios["M"][:, i] for i in range(3))
    f_low, f_middle, f_high = (median(list(1e-3 * data.ratios["K"][:, i])) for i in range(3))
    wide = median(list(high - low))
    return Claim(
        id=id_,
        source="sec. 5.1",
        claim="B_e and M_e are difficult to obtain from ratios of single samples: velocity and acceleration are noisy.",
        thesis="in words",
        measured=(
            f"eight of ten samples of B between {median(list(low)):.2g} and {median(list(high)):.2g} times the true B; "
            f"of M between {median(list(m_low)):.2g} and {median(list(m_high)):.2g} kg (true {data.truth['M']:g} kg)"
        ),
        tolerance="the middle eight tenths of the samples of B span more than the true B itself",
        verdict=decided(wide > 1.0),
        note=(
            f"Of the ratios only f/x at rest is of use: eight of ten samples between {f_low:.3g} and {f_high:.3g} "
            f"kN/m around {f_middle:.3g} kN/m. It is not the surface's K, which is {1e-3 * data.truth['K']:g} kN/m: "
            "the displacement counts from the 5 N point while the force is total, so 20 N are divided by the "
            "displacement of 15 N. The ratio for B inherits that offset and divides it by a velocity of a few encoder "
            "counts; the ratio for M divides the remainder by an acceleration that is noise as soon as the push is "
            "over."
        ),
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
        axes[4].axhline(level, color=panels.COLORS[name], linewidth=0.9, linestyle="--")
        axes[5].axhline(level, color=panels.COLORS[name], linewidth=0.9, linestyle="--")
    for axis, key in ((axes[1], "M"), (axes[3], "B")):
        curves = [
            press[f"{key}_thesis"][press_runs.between(press, *press_runs.SLOT)]
            for press in data.shown.values()
        ]
        panels.calm_limits(axis, np.zeros(1), *curves)
        axis.axhline(0.0, color=style.MEASURED, linewidth=0.9)
    _gaps(axes[6], data, near)
    _ratios(axes[7], data)
    return drawing


def _gaps(axis: Axes, data: Data, near: float) -> None:
    panels.titled(axis, "g", "$K_e$ against f/x, under varied conditions")
    groups = {
        name: {
            condition: [100.0 * f.apart for f in some]
            for condition, some in {"as chosen": data.found[name], **data.varied[name]}.items()
        }
        for name in data.found
    }
    panels.dots(axis, groups, panels.COLORS)
    for limit in (-100.0 * near, 100.0 * near):
        axis.axvline(limit, color=style.FAIL, linewidth=0.9, linestyle=":")
    axis.set_xlabel(f"difference [%]; dotted: {100.0 * near:g} %")


def _ratios(axis: Axes, data: Data) -> None:
    surface = next(iter(data.found))
    panels.titled(axis, "h", f"Ratios of single samples (bars: 8 of 10), {surface}")
    for i, key in enumerate("KBM"):
        low, middle, high = np.median(data.ratios[key], axis=0) / data.truth[key]
        axis.plot([low, high], [i, i], color=style.MEASURED, linewidth=6, solid_capstyle="butt")
        axis.plot(middle, i, "|", color=style.INK, markersize=13, label="ratios, middle" if i == 0 else None)
        fit = median([getattr(f, key) for f in data.found[surface]]) / data.truth[key]
        axis.plot(fit, i, "o", color=style.SERIES[0], label="least squares" if i == 0 else None)
    axis.axvline(1.0, **style.KNOWN, label="true")
    axis.set_xscale("symlog", linthresh=2.0)
    axis.set_yticks(range(3), ["K", "B", "M"])
    axis.set_ylim(2.6, -0.6)
    axis.set_xlabel("share of the true value")
    axis.legend(fontsize=7, frameon=False, loc="upper left")
