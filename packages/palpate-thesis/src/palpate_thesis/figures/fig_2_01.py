"""Figure 2.1: Raibert and Craig's hybrid controller, without dynamics, beside the one with dynamics."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from palpate._vector import Vec3
from palpate.arrays import Array, Mask
from palpate.bench import Experiment, load, with_values
from palpate.bench.summary import losses
from palpate.controllers import RaibertCraig
from palpate.controllers.raibert_craig import growth_rate
from palpate.records import Record
from palpate.report import style
from palpate.robots.arm3 import Arm3
from palpate_thesis.claims import ThesisClaim, claim, often, on_one_line
from palpate_thesis.drawing import Axes, Figure, panels
from palpate_thesis.force_control.tracking import since_contact, slot
from palpate_thesis.runs import SHORT, SURFACES, Runs, by_condition, friction_and_pose, stops_holding

NUMBER = "2.1"
PARAMETERS = with_values(load("foam-raibert-craig"), {**SHORT, "run.press": 10.0})
DYNAMIC = {"controller": {"kind": "proportional-integral", "kp": 400.0, "kv": 80.0, "kf": 1.0, "ki": 3.0}}
"""(4.13) with the thesis' gains on foam; the original: the same for the force, 400 and 80 inertias for its joints."""
STEPS = (2.5, 5.0, 7.5)
WORSE = 1.5
"""Least ratio of the original's overshoot, and of its angle's stray, to those with dynamics."""
GROWS = 1.0
"""Growth that counts as unstable [1/s]."""
XS, YS = np.linspace(0.10, 0.53, 65), np.linspace(-0.35, 0.35, 51)
LAWS = ("without dynamics", "with dynamics")


class StepResponse(NamedTuple):
    """Response of a run to steps of force."""

    overshoot: float  # over the size of the step, mean over the steps
    phi: float  # largest stray within a second of a step, mean over the steps [deg]
    lost: int


class BothLaws(NamedTuple):
    """Both laws in the same world."""

    original: StepResponse
    dynamic: StepResponse

    @property
    def phi(self) -> float:
        """Stray of the angle under the original, over that under (4.13)."""
        return self.original.phi / self.dynamic.phi

    @property
    def worse(self) -> bool:
        """True if the original is worse in overshoot and stray by the factor `WORSE`, or lost contact."""
        more = self.original.overshoot > 0.0 and self.original.overshoot >= WORSE * self.dynamic.overshoot
        return self.original.lost > 0 or (more and self.phi >= WORSE)


class Data(NamedTuple):
    """Measured values for `check` and `plot`."""

    traces: dict[str, Record]
    varied: dict[str, list[BothLaws]]
    growth: Array  # of the original over the workspace, shape (y, x) [1/s]; NaN out of reach
    any_gain: Array  # the same with a tenth and ten times the gains: the least of the three


def run(runs: Runs) -> Data:
    """Both laws in each world; the original's growth at each posture."""
    surfaces = SURFACES
    worlds = {n: with_values(PARAMETERS, c) for n, c in {**surfaces, **friction_and_pose(PARAMETERS)}.items()}

    def both(e: Experiment, seed: int) -> BothLaws:
        return BothLaws(*(_measure(runs.record(law, seed)) for law in (e, with_values(e, DYNAMIC))))

    varied = by_condition(runs, worlds, both, {"foam"})
    traces = {
        LAWS[0]: slot(runs.record(PARAMETERS)),
        LAWS[1]: slot(runs.record(with_values(PARAMETERS, DYNAMIC))),
    }
    growth = growth_over(1.0, np.ones((len(YS), len(XS)), dtype=bool))
    others = [growth_over(gain, growth > GROWS) for gain in (0.1, 10.0)]
    return Data(traces, varied, growth, np.fmin.reduce([growth, *others]))


def check(data: Data) -> Sequence[ThesisClaim]:
    """Problems of the original, and the effect of leaving out the dynamics."""
    reach = np.isfinite(data.growth)
    share = float((data.growth[reach] > GROWS).mean())
    always = float((data.any_gain[reach] > GROWS).mean())
    line = data.growth[np.argmin(np.abs(YS))]
    foam = data.varied["foam"]
    return [
        claim(
            "original-hybrid.problems",
            always > 0.0,
            share=share,
            postures=reach.sum(),
            always=always,
            fastest=np.nanmax(data.growth),
            grows=GROWS,
            occurs="it does not occur" if not (line[np.isfinite(line)] > GROWS).any() else "it occurs, too",
        ),
        claim(
            "original-hybrid.dynamics",
            often(p.worse for p in foam),
            foam=foam,
            worse=WORSE,
            lost=_losses_in_words(data),
            where=stops_holding(data.varied, lambda p: p.worse),
        ),
    ]


def _losses_in_words(data: Data) -> str:
    """Sentence with the variations in which contact was lost."""
    lost = [
        f"{on_one_line(name)} ({sum(p.original.lost > 0 for p in v)} of {len(v)} runs of the original, "
        f"{sum(p.dynamic.lost > 0 for p in v)} of (4.13))"
        for name, v in data.varied.items()
        if any(p.original.lost or p.dynamic.lost for p in v)
    ]
    return f"Contact was lost with {', '.join(lost)}." if lost else "Contact was never lost."


def plot(data: Data) -> Figure:
    """Force and angle over time, and the map."""
    drawing, ((force,), (angle,), (growth,)) = panels([2.5, 1.7, 3.0])
    _over_time(force, data, "force")
    _over_time(angle, data, "phi")
    _map_panel(drawing, growth, data)
    return drawing


def _over_time(axis: Axes, data: Data, name: str) -> None:
    for law, trace in data.traces.items():
        values = np.degrees(trace["phi"]) if name == "phi" else trace[name]
        axis.plot(trace["t"], values, linewidth=1.1, label=law)
    axis.set_xlim(0.0, PARAMETERS.run.press)
    if name == "force":
        first = next(iter(data.traces.values()))
        axis.plot(first["t"], first["force_desired"], **style.KNOWN, label="desired")
        axis.set_ylabel("true force [N]")
        style.legend(axis)
    else:
        axis.set(ylabel="angle [°]", xlabel="time since contact [s]")


def _map_panel(drawing: Figure, axis: Axes, data: Data) -> None:
    shown = np.where(np.isfinite(data.growth), np.clip(data.growth, 0.0, 20.0), np.nan)
    mesh = axis.pcolormesh(XS, YS, shown, cmap="OrRd", vmin=0.0, vmax=20.0, shading="nearest")
    drawing.colorbar(mesh, ax=axis, pad=0.02, label="[1/s], up to 20 and more")
    axis.plot([0.40, 0.49], [0.0, 0.0], color=style.SERIES[0], linewidth=2.5)
    words: dict[str, Any] = {"textcoords": "offset points", "fontsize": 8.5, "color": style.SERIES[0]}
    axis.annotate("experiments", (0.40, 0.0), (-22, -14), **words)
    axis.set(xlabel="x [m]", ylabel="y [m]", aspect="equal", title="growth of the original")


def growth_over(gain: float, where: Mask) -> Array:
    """Growth rate of the original's position loop with `gain` times its stiffness, over YS and XS [1/s]; else NaN."""
    arm: Any = Arm3()
    into = Vec3(1.0, 0.0, 0.0)
    table: Any = PARAMETERS.controller
    stiffness, damping = gain * Vec3(*table.stiffness), np.sqrt(gain) * Vec3(*table.damping)
    law = RaibertCraig(stiffness, damping, 0.0 * damping, table.kf, table.ki, table.feed_forward, 1e-3)
    growth = np.full((len(YS), len(XS)), np.nan)
    for i, y in enumerate(YS):
        for j, x in enumerate(XS):
            pose = Vec3(float(x), float(y), 0.0)
            q = arm.inverse(pose, 1.0)
            if where[i, j] and arm.beyond_reach(pose) <= 0.0 and abs(np.sin(q.y)) > 0.02:
                growth[i, j] = growth_rate(law, arm.model(q, 0.0 * q), into)
    return growth


def _measure(record: Record) -> StepResponse:
    t, force, phi = since_contact(record), record["force"], record["phi"]
    over, strays = [], []
    for at in STEPS:
        after = (t >= at) & (t < at + 1.0)
        before = (t >= at - 0.1) & (t < at - 5e-7)
        if not after.any():
            return StepResponse(np.nan, np.nan, losses(record))
        desired, was = record["force_desired"][after][0], record["force_desired"][before][0]
        beyond = (force[after] - desired) * np.sign(desired - was)
        over.append(max(0.0, float(beyond.max())) / abs(desired - was))
        strays.append(float(np.abs(phi[after] - phi[before].mean()).max()))
    return StepResponse(float(np.mean(over)), float(np.degrees(np.mean(strays))), losses(record))
