"""Figure 2.2: impedance control; the arm's estimated mass, damper and spring against the target."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate._vector import Vec3
from palpate.bench import Experiment, changed, load
from palpate.bench.metrics.summary import losses
from palpate.bench.tick import Loop, LoopState
from palpate.controllers import Impedance
from palpate.controllers.any_controller import AnyController
from palpate.records import Record
from palpate.report import style
from palpate.thesis.claims import Claim, decided, often, spread
from palpate.thesis.conditions import (
    RELAXING_FOAM,
    RUBBER_SURFACE,
    SHORT,
    by_condition,
    friction_and_pose,
    rougher,
    stops_holding,
)
from palpate.thesis.force_control.disturbances import Change, Disturbance, run_with
from palpate.thesis.force_control.panels import dots_panel, panels
from palpate.thesis.force_control.tracking import since_contact, slot
from palpate.thesis.runs import Runs

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

NUMBER = "2.2"
TITLE = "Impedance control: target and estimated mass, damper and spring"
CAPTION = (
    "The thesis' figure is a drawing of a mass, a damper and a spring. Here the target impedance is 5 kg, 600 N s/m "
    "and 2000 N/m (2.3), and the desired depth in the foam jumps each second. Above: the true force, and that of the "
    "target impedance itself on the same foam, with friction as chosen and with hardly any. Below: spring, damper and "
    "mass estimated from true position and force, over the target's."
)
DEPTHS = (0.0090, 0.0050, 0.0080, 0.0040, 0.0095, 0.0060, 0.0085, 0.0045)
"""Of the desired x beyond the wall [m], a second each; within what motor 2 can press on rubber."""
PARAMETERS = changed(
    load("foam-impedance"), {**SHORT, "run.press": float(len(DEPTHS)), "controller.beyond": DEPTHS[0]}
)
FREE = {**rougher(PARAMETERS, 0.02), "wall.side_friction": 0.0}
TOLERANCES = {"K": 0.10, "B": 0.25, "M": 0.25}
TARGET = {"K": 2000.0, "B": 600.0, "M": 5.0}
"""In x; the same numbers as in PARAMETERS [N/m, N s/m, kg]."""


@dataclass(frozen=True)
class Found:
    """Estimated impedance of the arm over its target."""

    K: float  # slope of force over displacement at the ends of the intervals
    B: float  # least squares on the motion
    M: float
    lost: int

    def within(self, name: str) -> bool:
        """Whether one of them is as asked for."""
        return self.lost == 0 and abs(getattr(self, name) - 1.0) <= TOLERANCES[name]


@dataclass(frozen=True)
class Data:
    """Measured values for `check` and `plot`."""

    traces: dict[str, Record]
    varied: dict[str, list[Found]]


def run(runs: Runs) -> Data:
    """Jumps of the desired depth on foam and rubber, and under varied conditions."""
    worlds = _worlds()
    varied = by_condition(runs, worlds, lambda e, s: found_in(recorded(e, s)), _ALL)
    rough, free = (recorded(worlds[name], runs.seeds[0]) for name in ("foam", "hardly any\nfriction"))
    traces = {
        "with friction": slot(rough),
        "hardly any friction": slot(free),
        "target impedance": ideal_trace(),
    }
    return Data(traces, varied)


def check(data: Data) -> Sequence[Claim]:
    """Spring, damper and mass, each by itself, on foam and rubber."""
    return [_claim(data, name) for name in TARGET]


_WORDS = {"K": "spring", "B": "damper", "M": "mass"}
_WHY = {
    "K": (
        "In steady state the force is K times the displacement minus the friction: some 2 N along x, equal to a "
        "millimetre of this spring. The tip stops anywhere within that band, so the slope over the ends of the "
        "intervals is too small. Impedance control measures the force, but (2.3) has no integral that would "
        "compensate friction."
    ),
    "B": (
        "Before the joints slide, their friction acts as a damper; afterwards it reduces the force of each motion. "
        "Both appear as more damping. Without friction, the damper is near its target."
    ),
    "M": (
        "The velocity is filtered at 35 Hz and lags by 7 ms, and a delayed damper acts as a damper and a negative "
        "mass: M minus B times the lag, 5 - 600 x 0.007 = 0.8 kg. That holds without friction; with friction, the fit "
        "finds no mass. A target with less damping would keep more of its mass."
    ),
}


def _claim(data: Data, name: str) -> Claim:
    foam, rubber = (data.varied[surface] for surface in _ALL)
    free = [100 * getattr(f, name) for f in data.varied["hardly any\nfriction"]]
    return Claim(
        id=f"impedance-holds.{name}",
        source="eq. 2.1-2.3, fig. 2.2 (after Hogan)",
        claim=f"Impedance control holds the {_WORDS[name]} of the target impedance.",
        thesis="force and displacement are made to obey (2.2)",
        measured=(
            f"of the target: foam {spread([100 * getattr(f, name) for f in foam], '%', 3)}, rubber "
            f"{spread([100 * getattr(f, name) for f in rubber], '%', 3)}; with hardly any friction "
            f"{spread(free, '%', 3)}"
        ),
        tolerance=(
            f"in 9 of 10 runs on each surface: contact kept, and within {TOLERANCES[name]:.0%} of the target"
        ),
        verdict=decided(all(often(f.within(name) for f in found) for found in (foam, rubber))),
        note=(
            "The thesis only cites impedance control; it reports no experiment with it, and the target's "
            f"numbers are ours. {_WHY[name]} {stops_holding(data.varied, lambda f: f.within(name))}"
        ),
    )


def plot(data: Data) -> Figure:
    """The force over time, and the estimates under each condition."""
    drawing, grid = panels([2.6, 1.8, 1.8, 1.8])
    colors = style.SERIES[:3]
    for (name, one), color in zip(data.traces.items(), colors, strict=True):
        grid[0][0].plot(one["t"], one["force"], color=color, linewidth=1.2, label=name)
    grid[0][0].set(xlabel="time since contact [s]", ylabel="force [N]", xlim=(0.0, len(DEPTHS)))
    style.legend(grid[0][0])
    for name, (axis,) in zip(("K", "B", "M"), grid[1:], strict=True):
        _share_panel(axis, data, name)
    return drawing


def _share_panel(axis: Axes, data: Data, name: str) -> None:
    dots_panel(
        axis,
        data.varied,
        lambda f: 100 * getattr(f, name),
        lambda f: f.within(name),
        limit=100.0,
        label=f"{name} [%]",
        title=(
            f"{_WORDS[name]} found, over the target's; a dot: within {TOLERANCES[name]:.0%}; dashed: the "
            "target"
        ),
    )
    values = [100 * getattr(f, name) for runs in data.varied.values() for f in runs]
    axis.set_ylim(min(0.0, 1.1 * min(values)), 1.1 * max(120.0, *values))


_ALL = ("foam", "rubber")


def _worlds() -> dict[str, Experiment]:
    return {
        "foam": PARAMETERS,
        "rubber": changed(PARAMETERS, RUBBER_SURFACE),
        "hardly any\nfriction": changed(PARAMETERS, FREE),
        **{name: changed(PARAMETERS, by) for name, by in friction_and_pose(PARAMETERS).items()},
        "relaxing\nfoam": changed(PARAMETERS, RELAXING_FOAM),
    }


def drawn_to(x: float) -> Change:
    """The impedance's desired x becomes another one [m]."""

    def change(loop: Loop, state: LoopState) -> tuple[Loop, LoopState]:
        return loop._replace(controller=_aimed(loop.controller, x)), state

    return change


def _aimed(controller: Any, x: float) -> Any:
    if isinstance(controller, Impedance):
        return controller._replace(target=Vec3(x, 0.0, 0.0))
    if not isinstance(controller, AnyController):
        return controller
    return controller._replace(first=_aimed(controller.first, x), second=_aimed(controller.second, x))


def recorded(experiment: Experiment, seed: int) -> Record:
    """A run whose desired depth jumps each second to the next of `DEPTHS`."""
    disturbances = [Disturbance(float(i), drawn_to(experiment.wall.x + d)) for i, d in enumerate(DEPTHS) if i]
    return run_with(experiment, seed, disturbances)


def found_in(record: Record) -> Found:
    """Spring from the ends of the intervals; damper and mass by least squares on the true motion between the jumps."""
    t, f, x = since_contact(record), record["force"], record["x"]
    interval = np.clip(np.floor(t + 5e-7).astype(int), 0, len(DEPTHS) - 1)
    away = record.meta["experiment"]["wall"]["x"] + np.array(DEPTHS)[interval] - x
    ends = [(t >= i + 0.8) & (t < i + 1.0) for i in range(len(DEPTHS))]
    if losses(record) or not all(e.any() for e in ends):
        return Found(np.nan, np.nan, np.nan, losses(record))
    K = np.polyfit([away[e].mean() for e in ends], [f[e].mean() for e in ends], 1)[0]
    v = np.gradient(x, record["t"])
    a = np.gradient(v, record["t"])
    used = (t >= 0.5) & (np.mod(t, 1.0) >= 0.004) & (np.mod(t, 1.0) < 0.996)
    _, B, M = np.linalg.lstsq(np.column_stack([away, -v, -a])[used], f[used])[0]
    return Found(K / TARGET["K"], B / TARGET["B"], M / TARGET["M"], 0)


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
