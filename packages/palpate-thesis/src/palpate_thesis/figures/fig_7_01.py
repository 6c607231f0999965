"""Section 7.1: his conclusions, sentence by sentence, and the force control that they leave to the reader."""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from palpate.report import style
from palpate.report.page import Table
from palpate_thesis.claims import CONCLUSION, ThesisClaim, claim, often, spread
from palpate_thesis.claims import tables as texts_of_all
from palpate_thesis.drawing import Axes, Figure, panels
from palpate_thesis.force_control import gain_sets
from palpate_thesis.force_control.gain_sets import ONE_SET, ForceComparison
from palpate_thesis.force_control.tracking import FOLLOWS
from palpate_thesis.least_squares.panels import PARAMETERS as AXES
from palpate_thesis.least_squares.panels import calm_limits
from palpate_thesis.neural_identifier import network, side_by_side
from palpate_thesis.neural_identifier.claims import RUBBER_BAND, SMALL
from palpate_thesis.neural_identifier.side_by_side import (
    DAMPING_FACTOR,
    METHODS,
    PRESSES,
    QUICK,
    Identified,
    MethodComparison,
    Pair,
    fraction,
)
from palpate_thesis.runs import Runs

NUMBER = "7.1"
PARAMETERS = PRESSES
SQUARES, NETWORK, MATCHED = METHODS
RATIO, OWN = "times f/x", "times the surface's own"
COLORS = {SQUARES: style.INK, NETWORK: style.SERIES[0], MATCHED: style.SERIES[1]}
CALM = 60
"""Milliseconds after which curves set the scale of a panel."""
COLUMNS: Mapping[str, Callable[[Identified], float]] = {
    "K_e [kN/m]": lambda a: 1e-3 * a.K,
    "K_e over f/x": lambda a: a.over,
    "B_e [N s/m]": lambda a: a.B,
    "M_e [kg]": lambda a: a.M,
    "K settles [s]": lambda a: a.settled_K,
    "B settles [s]": lambda a: a.settled_B,
    "M settles [s]": lambda a: a.settled_M,
    "ripple of K [%]": lambda a: 100.0 * a.ripple,
}
"""Columns of the first table."""


LIMITS = {"band": RUBBER_BAND, "factor": DAMPING_FACTOR, "small": SMALL, "quick": QUICK}
Value = tuple[str, str, str]
"""Method, attribute of `Identified`, and unit of a placeholder."""


def dominates(pair: Pair) -> bool:
    """True if one method is faster in K and nearer in both B and M."""
    return (pair.faster[0] and not any(pair.nearer)) or (not pair.faster[0] and all(pair.nearer))


def _settled(key: str) -> dict[str, Value]:
    name = f"settled_{key}"
    return {"squares": (SQUARES, name, "s"), "network": (NETWORK, name, "s")}


ROWS: Mapping[str, tuple[Callable[[Pair], bool], Mapping[str, Value]]] = {
    "stiffness.least-squares": (lambda p: p.squares.realistic[0], {"values": (SQUARES, "over", RATIO)}),
    "stiffness.network": (lambda p: p.network.realistic[0], {"values": (NETWORK, "over", RATIO)}),
    "damping.least-squares": (lambda p: p.squares.realistic[1], {"values": (SQUARES, "relative_B", OWN)}),
    "damping.network": (lambda p: p.network.realistic[1], {"values": (NETWORK, "relative_B", OWN)}),
    "mass.least-squares": (lambda p: p.squares.M < 0.0, {"values": (SQUARES, "M", "kg")}),
    "mass.network": (lambda p: p.network.realistic[2], {"values": (NETWORK, "M", "kg")}),
    "suitable": (lambda p: sum(p.network.realistic) > sum(p.squares.realistic), {}),
    "faster.K": (lambda p: p.faster[0], _settled("K")),
    "faster.B": (lambda p: p.faster[1], _settled("B")),
    "faster.M": (lambda p: p.faster[2], _settled("M")),
    "feasible": (lambda p: all(a.realistic[0] and a.settled_K <= QUICK for a in p), _settled("K")),
    "situation": (lambda p: not dominates(p), {}),
    "preferred.quick": (lambda p: p.faster[0], {}),
    "preferred.all": (lambda p: all(p.nearer), {}),
}
"""Sentences about both methods: truth for one press, and the values that are printed."""


class Data(NamedTuple):
    """Comparisons of identifiers and of controllers."""

    identified: dict[str, MethodComparison]  # by surface
    force: ForceComparison


def run(runs: Runs) -> Data:
    """The presses of figures 6.7 and 6.9 by every method, and the steps of 6.11 and 6.16 by every controller."""
    identified = {surface: side_by_side.compare(runs, e, surface) for surface, e in PRESSES.items()}
    return Data(identified, gain_sets.compare(runs))


def check(data: Data) -> Sequence[ThesisClaim]:
    """A row for each sentence of section 7.1, and for the gains of section 6.3, in the order of their texts."""
    rows = [
        claim("conclusion-two-methods", "not checkable"),
        *(_needs_nine_of_ten(data, f"{CONCLUSION}-{row}", *of) for row, of in ROWS.items()),
        _inputs(data, "similar", "other_inputs", lambda ratio: abs(ratio - 1.0) > RUBBER_BAND),
        _inputs(data, "scaled", "unscaled", lambda ratio: ratio < 0.1),
        *_gains(data.force),
    ]
    return sorted(rows, key=lambda row: list(texts_of_all()["claims"]).index(row.id))


def _needs_nine_of_ten(
    data: Data, id_: str, holds: Callable[[Pair], bool], values: Mapping[str, Value]
) -> ThesisClaim:
    """A row that has to hold in 9 of 10 runs on each surface, with the values of its placeholders."""
    flags = {surface: [holds(pair) for pair in c.pairs] for surface, c in data.identified.items()}
    counts = "; ".join(f"{surface} {fraction(good)} runs" for surface, good in flags.items())
    words = {
        place: "; ".join(
            f"{surface} {spread([getattr(a, name) for a in c.answers[method]], unit)}"
            for surface, c in data.identified.items()
        )
        for place, (method, name, unit) in values.items()
    }
    return claim(id_, all(map(often, flags.values())), counts=counts, **LIMITS, **words)


def _inputs(data: Data, part: str, name: str, holds: Callable[[float], bool]) -> ThesisClaim:
    """Does the network fail where its inputs are not as the thesis asks?"""
    ratios = {surface: getattr(c, name) for surface, c in data.identified.items()}
    return claim(
        f"conclusion-inputs.{part}",
        all(often(map(holds, values)) for values in ratios.values()),
        values="; ".join(f"{s} {spread(values)}" for s, values in ratios.items()),
        **LIMITS,
    )


def _gains(force: ForceComparison) -> list[ThesisClaim]:
    """Hybrid gains have to be changed with the surface, neural gains do not."""
    follow = {key: often(run.follows for run in runs) for key, runs in force.runs.items()}
    both = {name: all(follow[name, surface] for surface in gain_sets.SURFACES) for name in ONE_SET}
    *hybrids, neural = ONE_SET
    described = {name: _described(force, name) for name in ONE_SET}
    return [
        claim(
            "conclusion-gains.hybrid",
            not any(both[name] for name in hybrids),
            described="; ".join(f"{name}: {described[name]}" for name in hybrids),
            follows=FOLLOWS,
        ),
        claim("conclusion-gains.neural", both[neural], described=described[neural], follows=FOLLOWS),
    ]


def _described(force: ForceComparison, name: str) -> str:
    return ", ".join(
        f"{surface} RMS {spread([run.settled for run in force.runs[name, surface]], 'N')}, "
        f"{fraction([run.follows for run in force.runs[name, surface]])} follow"
        for surface in gain_sets.SURFACES
    )


def tables(data: Data) -> list[Table]:
    """Methods and controllers side by side: medians and ranges over the seeds."""
    rows = []
    for surface, c in data.identified.items():
        K, B, M = c.first.truth
        rows.append(
            [f"{surface}: its own values", f"{1e-3 * K:.3g}", "", f"{B:.3g}", f"{M:.3g}", "", "", "", ""]
        )
        for method, answers in c.answers.items():
            rows.append(
                [f"{surface}: {method}", *(spread([f(a) for a in answers]) for f in COLUMNS.values())]
            )
    force = [
        [
            f"{surface}: {name}",
            data.force.gains[name, surface],
            spread([run.settled for run in runs]),
            spread([run.rms for run in runs]),
            spread([100.0 * run.off for run in runs]),
            fraction([run.follows for run in runs]),
        ]
        for (name, surface), runs in sorted(data.force.runs.items(), key=lambda item: item[0][1])
    ]
    head = (
        "controller",
        "gains",
        "RMS error outside the steps [N]",
        "with steps [N]",
        "interval ends off by [%]",
        "follow",
    )
    return [
        Table("Identification: the same presses by each method", ("method", *COLUMNS), rows),
        Table("Force control: the same steps by each controller", head, force),
    ]


def plot(data: Data) -> Figure:
    """K, B, M of each method along one press, and the force under each controller with one set of gains."""
    drawing, grid = panels([1.9, 1.9, 1.9, 2.2], 2, 11.0)
    for column, (surface, c) in enumerate(data.identified.items()):
        for row, key in enumerate("KBM"):
            _coefficient(grid[row][column], c, key)
        grid[0][column].set_title(surface)
        _force(grid[3][column], data.force, surface)
    for axis in (grid[1][0], grid[3][0]):
        style.legend(axis)
    return drawing


def _coefficient(axis: Axes, c: MethodComparison, key: str) -> None:
    label, scale = AXES[key]
    i = "KBM".index(key)
    t = np.arange(len(c.first.matched)) * network.TICK
    curves = {SQUARES: c.first.press.squares[:, 2 - i], MATCHED: c.first.matched[:, i]}
    for number, curve in enumerate(c.curves):
        axis.plot(
            t,
            scale * curve[:, i],
            color=COLORS[NETWORK],
            linewidth=0.8,
            alpha=0.5,
            label=None if number else NETWORK,
        )
    for method, curve in curves.items():
        axis.plot(t, scale * curve, color=COLORS[method], linewidth=1.2, label=method)
    axis.axhline(scale * c.first.truth[i], **style.KNOWN, label="the surface's own")
    calm_limits(
        axis,
        *(scale * curve[CALM:] for curve in curves.values()),
        *(scale * curve[CALM:, i] for curve in c.curves),
    )
    axis.set(ylabel=label, xlabel="time since 5 N [s]", xlim=(0.0, t[-1]))


def _force(axis: Axes, force: ForceComparison, surface: str) -> None:
    for name, color in zip(ONE_SET, style.SERIES, strict=False):
        shown = force.shown[name, surface]
        axis.plot(shown["t"], shown["force"], color=color, linewidth=1.2, label=name)
    axis.plot(shown["t"], shown["force_desired"], **style.KNOWN, label="desired")
    axis.set(ylabel="true force [N]", xlabel="time since contact [s]", xlim=gain_sets.SHOWN)
