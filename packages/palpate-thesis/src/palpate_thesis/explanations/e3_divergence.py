"""Explanation 3: the neural controller's delayed divergence."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from palpate.arrays import Array
from palpate.bench import Experiment, with_values
from palpate.controllers.neural import NeuralState
from palpate.report import style
from palpate_thesis.claims import ThesisClaim, claim
from palpate_thesis.drawing import LIMIT_LINE, Axes, Figure, legend_inside, panels
from palpate_thesis.explanations.e2_integrator import PI
from palpate_thesis.force_control.interventions import (
    HOLD_INTERVAL,
    layers,
    watch,
    without_torques,
)
from palpate_thesis.force_control.tracking import FOAM, RUBBER, since_contact
from palpate_thesis.runs import RELAXING_FOAM, Runs, rougher

DURATION = 240.0
"""Seconds of contact that count as steady [s]."""
PARTS = (
    "hidden, from torques",
    "hidden, from poses",
    "hidden thresholds",
    "output of the force",
    "output thresholds",
)


class LongRun(NamedTuple):
    """A long run, with the norms of the weights and the gains from the torques to the force once a second."""

    t: Array  # (n,) [s]
    sizes: Array  # (n, 5), in the order of `PARTS`
    gains: Array  # (n, 3) [N per N m]
    lost: float | None  # time of the loss of contact [s]


class Loss(NamedTuple):
    """Signals in the last moments before the loss of contact."""

    t: Array  # before the loss [s]
    force: Array  # the network's [N]
    velocity: Array  # of the tip along x [m/s]
    true: Array  # contact force [N]


def weights_panel(axis: Axes, course: LongRun, name: str) -> None:
    """Sizes of the weights over a run."""
    for sizes, part in zip(course.sizes.T, PARTS, strict=True):
        axis.plot(course.t, sizes, linewidth=1.2, label=part)
    if course.lost is not None:
        axis.axvline(course.lost, **LIMIT_LINE)
    axis.set(xlabel="time since contact [s]", ylabel="size of the weights", ylim=(0.0, 1.05))
    axis.set_title(f"{name}, eta 5e-5")


def gains_panel(axis: Axes, courses: Mapping[str, Mapping[float, Sequence[LongRun]]]) -> None:
    """Gain from the torques to the force, on each surface."""
    for (name, by_rate), color in zip(courses.items(), style.SERIES[:3], strict=True):
        course = by_rate[5e-5][0]
        gain = np.linalg.norm(course.gains, axis=1)
        axis.plot(course.t, gain, color=color, linewidth=1.2, label=name)
        if course.lost is not None:
            axis.plot(course.t[-1], gain[-1], "x", color=color, markersize=9, markeredgewidth=2)
    axis.set(xlabel="time since contact [s]", ylabel="gain [N per N m]", ylim=(0.0, 2.9))
    axis.set_title("from the torques to the network's force, eta 5e-5")
    legend_inside(axis, loc="upper right", ncols=3)


def loss_panel(axis: Axes, loss: Loss | None) -> None:
    """The last moments before a loss."""
    if loss is None:
        axis.set_axis_off()
        return
    axis.plot(loss.t, loss.force, color=style.SERIES[0], linewidth=1.4, label="network's force")
    axis.plot(loss.t, loss.true, color=style.F, linewidth=1.4, label="contact force")
    axis.plot(loss.t, 200 * loss.velocity, color=style.INK, linewidth=1.1, label="velocity along x")
    axis.set(xlabel="time before the loss [s]", ylabel="[N], [5 mm/s]", xlim=(loss.t[0], 0.0))
    axis.set_title("the loss: foam that relaxes, eta 5e-5")
    legend_inside(axis, loc="upper left")


def times_panel(axis: Axes, courses: Mapping[str, Mapping[float, Sequence[LongRun]]]) -> None:
    """Times of loss over the learning rate, on each surface."""
    shifts = (1.0, 0.94, 1.06)
    for (name, by_rate), color, shift in zip(courses.items(), style.SERIES, shifts, strict=False):
        for rate, runs in by_rate.items():
            for lost in (run.lost for run in runs):
                at, mark = (DURATION, "^") if lost is None else (lost, "o")
                axis.plot(rate * shift, at, mark, color=color, markersize=5)
        axis.plot([], [], "o", color=color, markersize=4, label=name)
    axis.plot([], [], "^", color=style.MEASURED, markersize=5, label=f"kept for {DURATION:g} s, as with PI")
    axis.set(
        xscale="log", xlabel="learning rate eta", ylabel="contact lost after [s]", ylim=(0.0, DURATION * 1.08)
    )
    legend_inside(axis, loc="center right", bbox_to_anchor=(1.0, 0.62))


def steps_panel(axis: Axes, by_rate: Mapping[float, Sequence[LongRun]]) -> None:
    """Growth of the output weights of the force over the steps asked for, at each learning rate."""
    for rate, (run, *_) in by_rate.items():
        axis.plot(run.t / 2.5, run.sizes[:, 3], linewidth=1.5, label=f"{rate:g}")
    axis.set(xlabel="steps of the desired force", ylabel="force's output weights", yscale="log")
    axis.set_title("growth by steps, foam that relaxes")
    legend_inside(axis, loc="lower right", title="eta")


NUMBER = "delayed-divergence"
WITHOUT_TORQUES = "weights from all torques held at zero"
RELAXING = with_values(FOAM, RELAXING_FOAM)
PARAMETERS: Mapping[str, Experiment] = {"foam that relaxes": RELAXING, "foam": FOAM, "rubber": RUBBER}
RATES = (1e-4, 5e-5, 2e-5, 1e-5, 5e-6)
FEW_RATES = (1e-4, 5e-5, 1e-5)
"""For the surfaces where runs are long."""
CAUSES: Mapping[str, Mapping[str, Any]] = {
    "as chosen": {},
    "constant force": {"force.second": None},
    "no noise": {"force_sensor.noise": 0.0},
    "foam damped by 200 N s/m": {"surface.damping": 200.0},
    "K_pv halved": {"controller.kv": 40.0},
    "friction double": rougher(FOAM, 2.0),
}


class Data(NamedTuple):
    """Measured values for `check` and `plot`."""

    courses: dict[str, dict[float, list[LongRun]]]  # by surface and learning rate
    pi: dict[str, list[float | None]]  # times of loss under the PI, by surface
    causes: dict[str, list[float | None]]  # times of loss
    loss: Loss | None


def run(runs: Runs) -> Data:
    """All long runs: rates, the plain PI, and causes changed one at a time."""
    courses: dict[str, dict[float, list[LongRun]]] = {}
    for name, e in PARAMETERS.items():
        rates, seeds = (RATES, runs.seeds[:5]) if e is RELAXING else (FEW_RATES, runs.seeds[:1])
        at_rate = {r: with_values(e, {"controller.learning_rate": r}) for r in rates}
        cases = {r: [(changed, seed) for seed in seeds] for r, changed in at_rate.items()}
        courses[name] = runs.map_each(lambda case: _course(runs, *case), cases)
    plain = _losses(runs, {name: with_values(e, PI) for name, e in PARAMETERS.items()})
    causes = _losses(runs, {name: with_values(RELAXING, change) for name, change in CAUSES.items()})
    causes[WITHOUT_TORQUES] = [
        watch(RELAXING, runs.seeds[0], DURATION, without_torques, runs.waiting, HOLD_INTERVAL)
    ]
    return Data(courses, plain, causes, _loss(runs, courses["foam that relaxes"][5e-5][0].lost))


def check(data: Data) -> Sequence[ThesisClaim]:
    """Loss of contact at every rate, where the PI is steady; and on every surface."""
    relaxing = data.courses["foam that relaxes"]
    times = [run.lost for runs in relaxing.values() for run in runs]
    steady = all(lost is None for losses in data.pi.values() for lost in losses)
    damped = [runs for name in ("foam", "rubber") for runs in data.courses[name].values()]
    others = [run.lost for runs in damped for run in runs]
    lost_others = sum(lost is not None for lost in others)
    without_torques = _range(data.causes[WITHOUT_TORQUES])
    return [
        claim(
            "neural-diverges.loss",
            all(lost is not None for lost in times) and steady,
            cases=", ".join(
                f"{rate:g} after {_range([run.lost for run in runs])}" for rate, runs in relaxing.items()
            ),
            steady="steady" if steady else "lost",
            duration=DURATION,
            kept=f"kept for {DURATION:g} s"
            if without_torques == "never"
            else f"not kept beyond {without_torques}",
            negative_damping=_negative_damping(data.loss),
        ),
        claim(
            "neural-diverges.everywhere",
            lost_others == len(others),
            gone=lost_others,
            others=len(others),
            duration=DURATION,
            causes=", ".join(f"{name} {_range(times)}" for name, times in data.causes.items()),
        ),
    ]


def plot(data: Data) -> Figure:
    """Weights, gains, the loss, times, growth by steps."""
    drawing, grid = panels([2.2, 2.2, 2.2], columns=2, width=11.0)
    for axis, name in zip(grid[0], ("foam that relaxes", "foam"), strict=True):
        weights_panel(axis, data.courses[name][5e-5][0], name)
    legend_inside(grid[0][1], loc="upper right", ncols=2)
    gains_panel(grid[1][0], data.courses)
    loss_panel(grid[1][1], data.loss)
    times_panel(grid[2][0], data.courses)
    steps_panel(grid[2][1], data.courses["foam that relaxes"])
    return drawing


def _course(runs: Runs, experiment: Experiment, seed: int) -> LongRun:
    rows: list[tuple[Any, ...]] = []

    def look(t: float, state: NeuralState | None) -> None:
        assert state is not None
        rows.append((t, weight_norms(state), torque_gains(state)))

    lost = watch(experiment, seed, DURATION, look, runs.waiting)
    t, sizes, gains = map(np.array, zip(*rows, strict=True))
    return LongRun(t, sizes, gains, lost)


def weight_norms(state: NeuralState) -> Array:
    """Root of the sum of squares of each of `PARTS`, shape (5,)."""
    hidden, output = layers(state)
    parts = (hidden[:, 7:], hidden[:, 1:7], hidden[:, 0], output[0, 1:], output[:, 0])
    return np.array([np.sqrt(np.sum(part**2)) for part in parts])


def torque_gains(state: NeuralState) -> Array:
    """Change of the network's force for a change of each torque among its inputs [N per N m], shape (3,)."""
    hidden, output = layers(state)
    inside, out = state.network.signals[9:21], state.network.signals[21]
    through = output[0, 1:] * 0.5 * (1.0 - inside**2)
    return np.array(20.0 * 0.5 * (1.0 - out**2) * through @ hidden[:, 7:])


def _losses(runs: Runs, experiments: Mapping[str, Experiment]) -> dict[str, list[float | None]]:
    """Time at which each loses contact with the first seed [s]."""
    return runs.map_each(
        lambda e: watch(e, runs.seeds[0], DURATION, lambda _, __: None, runs.waiting),
        {name: [e] for name, e in experiments.items()},
    )


def _loss(runs: Runs, lost: float | None) -> Loss | None:
    """The last 0.4 s before the loss of the first seed, at the text's learning rate."""
    if lost is None:
        return None
    record = runs.record(with_values(RELAXING, {"run.press": lost, "run.duration": DURATION + 60.0}))
    t = since_contact(record) - lost
    last = (t >= -0.4) & (t < 0.0)
    columns = (record[name][last] for name in ("memory_fx", "vx_measured", "force"))
    return Loss(t[last], *columns)


def _range(times: Sequence[float | None]) -> str:
    lost = [time for time in times if time is not None]
    if not lost:
        return "never"
    ends = dict.fromkeys((f"{min(lost):.0f}", f"{max(lost):.0f}"))
    text = f"{' to '.join(ends)} s"
    return text if len(lost) == len(times) else f"{text} (in {len(lost)} of {len(times)} runs)"


def _negative_damping(loss: Loss | None) -> str:
    """Sentence on the damping by the network's force before the loss."""
    if loss is None:
        return ""
    slope = float(np.polyfit(loss.velocity, loss.force, 1)[0])
    return (
        f"Before the loss the network's force is in phase with the velocity, by {slope:.0f} N s/m over the last 0.4 "
        "s: a negative damper."
    )
