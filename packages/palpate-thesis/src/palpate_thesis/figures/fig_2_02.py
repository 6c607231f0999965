"""Figure 2.2: impedance control; the arm's estimated mass, damper and spring against the target."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from palpate._vector import Vec3
from palpate.bench import Experiment, load, with_values
from palpate.bench.plant import Loop, LoopState
from palpate.bench.summary import losses
from palpate.controllers import Impedance
from palpate.controllers.controller import AnyController
from palpate.records import Record
from palpate.report import style
from palpate_thesis.claims import ThesisClaim, claim, often
from palpate_thesis.drawing import LIMIT_LINE, Axes, Figure, panels
from palpate_thesis.force_control.interventions import Change, Disturbance, run_with
from palpate_thesis.force_control.tracking import since_contact, slot
from palpate_thesis.runs import SHORT, SURFACES, Runs, by_condition, friction_and_pose, rougher, stops_holding

NUMBER = "2.2"
DEPTHS = (0.0090, 0.0050, 0.0080, 0.0040, 0.0095, 0.0060, 0.0085, 0.0045)
"""Desired x beyond the wall, each for a second; motor 2 can press them on rubber [m]."""
PARAMETERS = with_values(
    load("foam-impedance"), {**SHORT, "run.press": float(len(DEPTHS)), "controller.beyond": DEPTHS[0]}
)
FREE = {**rougher(PARAMETERS, 0.02), "wall.side_friction": 0.0}
TOLERANCES = {"K": 0.10, "B": 0.25, "M": 0.25}
WORDS = {"K": "spring", "B": "damper", "M": "mass"}
TARGET = {"K": 2000.0, "B": 600.0, "M": 5.0}
"""In x; the same numbers as in PARAMETERS [N/m, N s/m, kg]."""


class ArmImpedance(NamedTuple):
    """Estimated impedance of the arm, relative to its target."""

    K: float  # slope of force over displacement at the ends of the intervals
    B: float  # least squares on the motion
    M: float
    lost: int

    def within(self, name: str) -> bool:
        """True if contact was kept and this estimate is within its tolerance of the target."""
        return self.lost == 0 and abs(getattr(self, name) - 1.0) <= TOLERANCES[name]


class Data(NamedTuple):
    """Measured values for `check` and `plot`."""

    traces: dict[str, Record]
    varied: dict[str, list[ArmImpedance]]


def run(runs: Runs) -> Data:
    """Jumps of the desired depth on foam and rubber, and under varied conditions."""
    worlds = _worlds()
    varied = by_condition(runs, worlds, lambda e, s: estimate_impedance(record_jumps(e, s)), _ALL)
    rough, free = (record_jumps(worlds[name], runs.seeds[0]) for name in ("foam", _FREE))
    traces = {
        "with friction": slot(rough),
        "hardly any friction": slot(free),
        "target impedance": ideal_trace(),
    }
    return Data(traces, varied)


def check(data: Data) -> Sequence[ThesisClaim]:
    """Spring, damper and mass, each by itself, on foam and rubber."""
    return [_claim(data, name) for name in TARGET]


def _claim(data: Data, name: str) -> ThesisClaim:
    estimates = {surface: [getattr(f, name) for f in data.varied[surface]] for surface in (*_ALL, _FREE)}
    return claim(
        f"impedance-holds.{name}",
        all(often(f.within(name) for f in data.varied[surface]) for surface in _ALL),
        **{surface.split(" ")[0]: [100 * value for value in values] for surface, values in estimates.items()},
        tolerance=TOLERANCES[name],
        where=stops_holding(data.varied, lambda f: f.within(name)),
    )


def plot(data: Data) -> Figure:
    """The force over time, and the estimates under each condition."""
    drawing, grid = panels([2.6, 1.8, 1.8, 1.8])
    for name, trace in data.traces.items():
        grid[0][0].plot(trace["t"], trace["force"], linewidth=1.2, label=name)
    grid[0][0].set(xlabel="time since contact [s]", ylabel="force [N]", xlim=(0.0, len(DEPTHS)))
    style.legend(grid[0][0])
    for name, (axis,) in zip(("K", "B", "M"), grid[1:], strict=True):
        _fraction_panel(axis, data, name)
    return drawing


def _fraction_panel(axis: Axes, data: Data, name: str) -> None:
    for place, estimates in enumerate(data.varied.values()):
        values = [100 * getattr(estimate, name) for estimate in estimates]
        axis.plot([place] * len(values), values, "o", color=style.SERIES[0], markersize=4)
    axis.axhline(100.0, **LIMIT_LINE)
    axis.set_xticks(range(len(data.varied)), list(data.varied))
    axis.set(
        ylabel=f"{name} [%]", title=f"{WORDS[name]} estimated, over the target's (dashed); each dot a run"
    )


_ALL = ("foam", "rubber")
_FREE = "hardly any\nfriction"


def _worlds() -> dict[str, Experiment]:
    return {
        "foam": PARAMETERS,
        "rubber": with_values(PARAMETERS, SURFACES["rubber"]),
        _FREE: with_values(PARAMETERS, FREE),
        **{name: with_values(PARAMETERS, by) for name, by in friction_and_pose(PARAMETERS).items()},
        "relaxing\nfoam": with_values(PARAMETERS, SURFACES["relaxing\nfoam"]),
    }


def drawn_to(x: float) -> Change:
    """The impedance's desired x becomes another one [m]."""

    def change(loop: Loop, state: LoopState) -> tuple[Loop, LoopState]:
        return loop._replace(controller=_aim_at(loop.controller, x)), state

    return change


def _aim_at(controller: Any, x: float) -> Any:
    if isinstance(controller, Impedance):
        return controller._replace(target=Vec3(x, 0.0, 0.0))
    if not isinstance(controller, AnyController):
        return controller
    return controller._replace(first=_aim_at(controller.first, x), second=_aim_at(controller.second, x))


def record_jumps(experiment: Experiment, seed: int) -> Record:
    """A run whose desired depth jumps each second to the next of `DEPTHS`."""
    disturbances = [Disturbance(float(i), drawn_to(experiment.wall.x + d)) for i, d in enumerate(DEPTHS) if i]
    return run_with(experiment, seed, disturbances)


def estimate_impedance(record: Record) -> ArmImpedance:
    """Spring from the ends of the intervals; damper and mass by least squares on the true motion between the jumps."""
    t, f, x = since_contact(record), record["force"], record["x"]
    interval = np.clip(np.floor(t + 5e-7).astype(int), 0, len(DEPTHS) - 1)
    away = record.meta["experiment"]["wall"]["x"] + np.array(DEPTHS)[interval] - x
    ends = [(t >= i + 0.8) & (t < i + 1.0) for i in range(len(DEPTHS))]
    if losses(record) or not all(e.any() for e in ends):
        return ArmImpedance(np.nan, np.nan, np.nan, losses(record))
    K = np.polyfit([away[e].mean() for e in ends], [f[e].mean() for e in ends], 1)[0]
    v = np.gradient(x, record["t"])
    a = np.gradient(v, record["t"])
    used = (t >= 0.5) & (np.mod(t, 1.0) >= 0.004) & (np.mod(t, 1.0) < 0.996)
    _, B, M = np.linalg.lstsq(np.column_stack([away, -v, -a])[used], f[used])[0]
    return ArmImpedance(K / TARGET["K"], B / TARGET["B"], M / TARGET["M"], 0)


def ideal_trace() -> Record:
    """The target impedance itself on the foam, from rest at the first depth."""
    from scipy.signal import StateSpace, lsim

    s = PARAMETERS.surface
    m, b, k = TARGET["M"] + s.mass, TARGET["B"] + s.damping, TARGET["K"] + s.stiffness
    A, G = [[0.0, 1.0], [-k / m, -b / m]], [[0.0], [TARGET["K"] / m]]
    force = [s.stiffness - s.mass * k / m, s.damping - s.mass * b / m]  # of the surface, its mass included
    system = StateSpace(A, G, [force], [[s.mass * TARGET["K"] / m]])
    t = 1e-3 * np.arange(len(DEPTHS) * 1000, dtype=np.float64)
    depth = np.repeat(DEPTHS, 1000)
    _, out, _ = lsim(system, depth, t, X0=[TARGET["K"] * DEPTHS[0] / k, 0.0], interp=False)
    return Record({"t": t, "force": np.asarray(out)}, {"t": "s", "force": "N"})
