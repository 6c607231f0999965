"""Explanation 3: the neural controller's delayed divergence."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from palpate.arrays import Array
from palpate.bench import Experiment, with_values
from palpate.controllers.neural import NeuralState
from palpate.records import Record
from palpate.report import style
from palpate_thesis.claims import ThesisClaim, claim
from palpate_thesis.drawing import LIMIT_LINE, Figure, panels
from palpate_thesis.explanations.e2_integrator import PI
from palpate_thesis.force_control.interventions import HOLD_INTERVAL, layers, watch, without_torques
from palpate_thesis.force_control.tracking import FOAM, RUBBER, slot
from palpate_thesis.runs import RELAXING_FOAM, Runs, rougher

NUMBER = "delayed-divergence"
DURATION = 240.0
"""Seconds of contact that count as steady [s]."""
PARTS = ("hidden, from torques", "hidden, from poses", "hidden thresholds", "output of the force")
RELAXING = with_values(FOAM, RELAXING_FOAM)
PARAMETERS: Mapping[str, Experiment] = {"foam that relaxes": RELAXING, "foam": FOAM, "rubber": RUBBER}
RATES, FEW_RATES = (1e-4, 5e-5, 2e-5, 1e-5, 5e-6), (1e-4, 5e-5, 1e-5)
"""Learning rates on the foam that relaxes, and on the surfaces where runs are long; the second is the text's."""
WITHOUT_TORQUES = "weights from all torques held at zero"
CAUSES: Mapping[str, Mapping[str, Any]] = {
    "as chosen": {},
    "constant force": {"force.second": None},
    "no noise": {"force_sensor.noise": 0.0},
    "foam damped by 200 N s/m": {"surface.damping": 200.0},
    "K_pv halved": {"controller.kv": 40.0},
    "friction double": rougher(FOAM, 2.0),
}


class LongRun(NamedTuple):
    """A long run, with the norms of the weights and the gain from the torques to the force once a second."""

    t: Array  # (n,) [s]
    sizes: Array  # (n, 4), in the order of `PARTS`
    gain: Array  # (n,) [N per N m]
    lost: float | None  # time of the loss of contact [s]


class Data(NamedTuple):
    """Measured values for `check` and `plot`."""

    courses: dict[str, dict[float, list[LongRun]]]  # by surface and learning rate
    pi: dict[str, list[float | None]]  # times of loss under the PI, by surface
    causes: dict[str, list[float | None]]  # times of loss
    loss: Record | None  # the last 0.4 s before the loss of the first seed, at the text's learning rate


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
    held = watch(RELAXING, runs.seeds[0], DURATION, without_torques, runs.waiting, HOLD_INTERVAL)
    loss, lost = None, courses["foam that relaxes"][5e-5][0].lost
    if lost is not None:
        record = runs.record(with_values(RELAXING, {"run.press": lost, "run.duration": DURATION + 60.0}))
        loss = slot(record, lost - 0.4, lost)
    return Data(courses, plain, {**causes, WITHOUT_TORQUES: [held]}, loss)


def check(data: Data) -> Sequence[ThesisClaim]:
    """Loss of contact at every rate, where the PI is steady; and on every surface."""
    times = {
        name: {rate: [run.lost for run in runs] for rate, runs in by_rate.items()}
        for name, by_rate in data.courses.items()
    }
    relaxing = times.pop("foam that relaxes")
    others = [lost for by_rate in times.values() for each in by_rate.values() for lost in each]
    gone = sum(lost is not None for lost in others)
    steady = all(lost is None for losses in data.pi.values() for lost in losses)
    held = _range(data.causes[WITHOUT_TORQUES])
    return [
        claim(
            "neural-diverges.loss",
            all(lost is not None for each in relaxing.values() for lost in each) and steady,
            cases=", ".join(f"{rate:g} after {_range(each)}" for rate, each in relaxing.items()),
            steady="steady" if steady else "lost",
            duration=DURATION,
            kept=f"kept for {DURATION:g} s" if held == "never" else f"not kept beyond {held}",
            negative_damping=_negative_damping(data.loss),
        ),
        claim(
            "neural-diverges.everywhere",
            gone == len(others),
            gone=gone,
            others=len(others),
            duration=DURATION,
            causes=", ".join(f"{name} {_range(each)}" for name, each in data.causes.items()),
        ),
    ]


def plot(data: Data) -> Figure:
    """Weights and gains over a run; the last moments before the loss; times of loss over the rate."""
    drawing, ((weights, gains), (last, times)) = panels([2.4, 2.4], columns=2, width=11.0)
    course = data.courses["foam that relaxes"][5e-5][0]
    for sizes, part in zip(course.sizes.T, PARTS, strict=True):
        weights.plot(course.t, sizes, linewidth=1.2, label=part)
    weights.set(xlabel="time since contact [s]", ylabel="size of the weights", ylim=(0.0, None))
    for (name, by_rate), color in zip(data.courses.items(), style.SERIES, strict=False):
        course = by_rate[5e-5][0]
        gains.plot(course.t, course.gain, color=color, linewidth=1.2, label=name)
        lost = [(rate, run.lost or DURATION) for rate, runs in by_rate.items() for run in runs]
        look: Any = {"fillstyle": "none", "markersize": 9} if name == "foam" else {"markersize": 4}
        times.plot(*zip(*lost, strict=True), "o", color=color, label=name, **look)
    gains.set(xlabel="time since contact [s]", ylabel="gain [N per N m]", ylim=(0.0, None))
    if data.loss is not None:
        signals = {"network's force": data.loss["memory_fx"], "contact force": data.loss["force"]}
        signals["velocity along x [5 mm/s]"] = 200.0 * data.loss["vx_measured"]
        for label, values in signals.items():
            last.plot(data.loss["t"] - data.loss["t"][-1], values, linewidth=1.2, label=label)
    last.set(xlabel="time before the loss [s]", ylabel="force [N]")
    times.set(xscale="log", xlabel="learning rate eta", ylabel="contact lost after [s]")
    times.axhline(DURATION, **LIMIT_LINE, label=f"kept for {DURATION:g} s, as with PI")
    for axis in (weights, gains, last, times):
        style.legend(axis, ncols=2)
    return drawing


def _course(runs: Runs, experiment: Experiment, seed: int) -> LongRun:
    rows: list[tuple[Any, ...]] = []

    def look(t: float, state: NeuralState | None) -> None:
        assert state is not None
        rows.append((t, weight_norms(state), np.linalg.norm(torque_gains(state))))

    lost = watch(experiment, seed, DURATION, look, runs.waiting)
    t, sizes, gain = map(np.array, zip(*rows, strict=True))
    return LongRun(t, sizes, gain, lost)


def weight_norms(state: NeuralState) -> Array:
    """Root of the sum of squares of each of `PARTS`, shape (4,)."""
    hidden, output = layers(state)
    parts = (hidden[:, 7:], hidden[:, 1:7], hidden[:, 0], output[0, 1:])
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


def _range(times: Sequence[float | None]) -> str:
    lost = [time for time in times if time is not None]
    if not lost:
        return "never"
    ends = dict.fromkeys((f"{min(lost):.0f}", f"{max(lost):.0f}"))
    text = f"{' to '.join(ends)} s"
    return text if len(lost) == len(times) else f"{text} (in {len(lost)} of {len(times)} runs)"


def _negative_damping(loss: Record | None) -> str:
    """Sentence on the damping by the network's force before the loss."""
    if loss is None:
        return ""
    slope = float(np.polyfit(loss["vx_measured"], loss["memory_fx"], 1)[0])
    return (
        f"Before the loss the network's force is in phase with the velocity, by {slope:.0f} N s/m over the last 0.4 "
        "s: a negative damper."
    )
