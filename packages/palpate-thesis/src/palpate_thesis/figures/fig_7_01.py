"""Section 7.1: his conclusions, sentence by sentence, and the force control that they leave to the reader."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from palpate.report import style
from palpate.report.page import Table
from palpate_thesis.claims import CONCLUSION, ThesisClaim, claim, often, spread
from palpate_thesis.claims import figures as texts_of_all
from palpate_thesis.drawing import Axes, Figure, panels
from palpate_thesis.force_control import gain_sets
from palpate_thesis.force_control.gain_sets import ONE_SET, ForceComparison
from palpate_thesis.force_control.tracking import FOLLOWS
from palpate_thesis.least_squares.panels import PARAMETERS as AXES
from palpate_thesis.least_squares.panels import calm_limits
from palpate_thesis.neural_identifier import network, side_by_side
from palpate_thesis.neural_identifier.network import DAMPING_FACTOR, RUBBER_BAND, SMALL, Identified
from palpate_thesis.neural_identifier.side_by_side import METHODS, MethodComparison, Pair
from palpate_thesis.runs import Runs

NUMBER = "7.1"
PRESSES = {"foam": network.FOAM, "rubber": network.RUBBER}
SQUARES, NETWORK, MATCHED = METHODS
COLORS = {NETWORK: style.SERIES[0], SQUARES: style.INK, MATCHED: style.SERIES[1]}
CALM = 60
"""Milliseconds after which curves set the scale of a panel."""
QUICK = 0.9
"""Longest settling time of a method for practical use [s]: half as much again as the thesis' 0.6 s."""
LIMITS = {"band": RUBBER_BAND, "factor": DAMPING_FACTOR, "small": SMALL, "quick": QUICK}
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
Value = tuple[str, str, str]
"""Method, attribute of `Identified`, and unit of a placeholder."""


def dominates(pair: Pair) -> bool:
    """True if one method is faster in K and nearer in both B and M."""
    return (pair.faster[0] and not any(pair.nearer)) or (not pair.faster[0] and all(pair.nearer))


def _value(method: str, name: str, unit: str) -> dict[str, Value]:
    return {"values": (method, name, unit)}


def _settled(key: str) -> dict[str, Value]:
    name = f"settled_{key}"
    return {"squares": (SQUARES, name, "s"), "network": (NETWORK, name, "s")}


RATIO, OWN = ("over", "times f/x"), ("relative_B", "times the surface's own")
ROWS: Mapping[str, tuple[Callable[[Pair], bool], Mapping[str, Value]]] = {
    "stiffness.least-squares": (lambda p: p.squares.realistic[0], _value(SQUARES, *RATIO)),
    "stiffness.network": (lambda p: p.network.realistic[0], _value(NETWORK, *RATIO)),
    "damping.least-squares": (lambda p: p.squares.realistic[1], _value(SQUARES, *OWN)),
    "damping.network": (lambda p: p.network.realistic[1], _value(NETWORK, *OWN)),
    "mass.least-squares": (lambda p: p.squares.M < 0.0, _value(SQUARES, "M", "kg")),
    "mass.network": (lambda p: p.network.realistic[2], _value(NETWORK, "M", "kg")),
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
    comparisons = data.identified
    other = {surface: c.other_inputs for surface, c in comparisons.items()}
    unscaled = {surface: c.unscaled for surface, c in comparisons.items()}
    rows = [
        claim("conclusion-two-methods", "not checkable"),
        *(_needs_nine_of_ten(comparisons, f"{CONCLUSION}-{row}", *of) for row, of in ROWS.items()),
        _inputs("similar", other, lambda ratio: abs(ratio - 1.0) > RUBBER_BAND),
        _inputs("scaled", unscaled, lambda ratio: ratio < 0.1),
        *_gains(data.force),
    ]
    return sorted(rows, key=lambda row: list(texts_of_all()[NUMBER]["claims"]).index(row.id))


def _by_surface(words: Mapping[str, str]) -> str:
    return "; ".join(f"{surface} {text}" for surface, text in words.items())


def _needs_nine_of_ten(
    comparisons: Mapping[str, MethodComparison],
    id_: str,
    holds: Callable[[Pair], bool],
    values: Mapping[str, Value],
) -> ThesisClaim:
    """A row that has to hold in 9 of 10 runs on each surface, with the values of its placeholders."""
    flags = {surface: [holds(pair) for pair in c.pairs] for surface, c in comparisons.items()}
    counts = _by_surface({surface: f"{fraction(good)} runs" for surface, good in flags.items()})
    words = {
        place: _by_surface(
            {s: spread([getattr(a, name) for a in c.answers[method]], unit) for s, c in comparisons.items()}
        )
        for place, (method, name, unit) in values.items()
    }
    return claim(id_, all(map(often, flags.values())), counts=counts, **LIMITS, **words)


def _inputs(part: str, ratios: Mapping[str, Sequence[float]], holds: Callable[[float], bool]) -> ThesisClaim:
    """Does the network fail where its inputs are not as the thesis asks?"""
    values = _by_surface({surface: spread(ratio) for surface, ratio in ratios.items()})
    good = all(often(map(holds, ratio)) for ratio in ratios.values())
    return claim(f"conclusion-inputs.{part}", good, values=values, **LIMITS)


def _gains(force: ForceComparison) -> list[ThesisClaim]:
    """Hybrid gains have to be changed with the surface, neural gains do not."""
    both, described = {}, {}
    for name in ONE_SET:
        tracked = {surface: force.runs[name, surface] for surface in gain_sets.SURFACES}
        both[name] = all(often(run.follows for run in runs) for runs in tracked.values())
        described[name] = ", ".join(
            f"{surface} RMS {spread([run.settled for run in runs], 'N')}, "
            f"{fraction([run.follows for run in runs])} follow"
            for surface, runs in tracked.items()
        )
    *hybrids, neural = ONE_SET
    words, fails = (
        "; ".join(f"{name}: {described[name]}" for name in hybrids),
        not any(map(both.get, hybrids)),
    )
    return [
        claim("conclusion-gains.hybrid", fails, described=words, follows=FOLLOWS),
        claim("conclusion-gains.neural", both[neural], described=described[neural], follows=FOLLOWS),
    ]


def fraction(flags: Sequence[bool]) -> str:
    """How many runs agree: "93 of 100"."""
    return f"{sum(map(bool, flags))} of {len(flags)}"


def tables(data: Data) -> list[Table]:
    """Methods and controllers side by side: medians and ranges over the seeds."""
    rows, force = [], []
    for surface, c in data.identified.items():
        K, B, M = c.first.truth
        rows.append([f"{surface}: its own values", f"{1e-3 * K:.3g}", "", f"{B:.3g}", f"{M:.3g}", *[""] * 4])
        for method, answers in c.answers.items():
            rows.append([f"{surface}: {method}", *(spread(list(map(f, answers))) for f in COLUMNS.values())])
    for (name, surface), runs in sorted(data.force.runs.items(), key=lambda item: item[0][1]):
        errors = zip(*((run.settled, run.rms, 100.0 * run.off) for run in runs), strict=True)
        follow = fraction([run.follows for run in runs])
        force.append([f"{surface}: {name}", data.force.gains[name, surface], *map(spread, errors), follow])
    columns = "RMS error outside the steps [N]", "with steps [N]", "interval ends off by [%]"
    return [
        Table("Identification: the same presses by each method", ("method", *COLUMNS), rows),
        Table(
            "Force control: the same steps by each controller",
            ("controller", "gains", *columns, "follow"),
            force,
        ),
    ]


def plot(data: Data) -> Figure:
    """K, B, M of each method along one press, and the force under each controller with one set of gains."""
    drawing, grid = panels([1.9, 1.9, 1.9, 2.2], 2, 11.0)
    for column, (surface, c) in enumerate(data.identified.items()):
        for row in range(3):
            _coefficient(grid[row][column], c, row)
        grid[0][column].set_title(surface)
        _force(grid[3][column], data.force, surface)
    for axis in (grid[1][0], grid[3][0]):
        style.legend(axis)
    return drawing


def _coefficient(axis: Axes, c: MethodComparison, i: int) -> None:
    """K, B or M of each method, the network from several starts."""
    label, scale = AXES["KBM"[i]]
    t = np.arange(len(c.first.matched)) * network.TICK
    by_method = {NETWORK: c.curves, SQUARES: [c.first.squares], MATCHED: [c.first.matched]}
    for method, curves in by_method.items():
        look: Any = {"linewidth": 1.0, "alpha": 0.8} if method == NETWORK else {"linewidth": 1.2}
        lines = scale * np.array([curve[:, i] for curve in curves]).T
        axis.plot(t, lines, color=COLORS[method], label=[method, *[None] * (len(curves) - 1)], **look)
    axis.axhline(scale * c.first.truth[i], **style.KNOWN, label="the surface's own")
    calm_limits(axis, *(scale * curve[CALM:, i] for curves in by_method.values() for curve in curves))
    axis.set(ylabel=label, xlabel="time since 5 N [s]", xlim=(0.0, t[-1]))


def _force(axis: Axes, force: ForceComparison, surface: str) -> None:
    for name, color in zip(ONE_SET, style.SERIES, strict=False):
        shown = force.shown[name, surface]
        axis.plot(shown["t"], shown["force"], color=color, linewidth=1.2, label=name)
    axis.plot(shown["t"], shown["force_desired"], **style.KNOWN, label="desired")
    axis.set(ylabel="true force [N]", xlabel="time since contact [s]", xlim=gain_sets.SHOWN)
