"""Explanation 3: the neural controller's delayed divergence."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.arrays import Array
from palpate.bench import Experiment, changed
from palpate.thesis.claims import Claim, decided
from palpate.thesis.conditions import RELAXING_FOAM, moved, rougher
from palpate.thesis.explanations.e2_integrator import PI
from palpate.thesis.force_control.divergence_panels import (
    DURATION,
    Course,
    Loss,
    causes_panel,
    gains_panel,
    loss_panel,
    steps_panel,
    times_panel,
    weights_panel,
)
from palpate.thesis.force_control.panels import across, legend_inside, panels
from palpate.thesis.force_control.tracking import FOAM, RUBBER, SINE, since_contact
from palpate.thesis.force_control.weights import HOLD, POSES, TORQUE1, TORQUES, Look, hold, layers, watch
from palpate.thesis.runs import Runs

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from palpate.controllers.neural import NeuralState

NUMBER = "delayed-divergence"
TITLE = "Why it fails later: the network learns a response to its own torques"
CAPTION = (
    "Learning never stops. First row: size of the weights over the time in contact at the text's learning rate, on "
    "the foam that relaxes until contact is lost (dashed), and on the plain foam. Second row: the gain from the "
    "hybrid controller's torques to the network's force; and the last moments before the loss, where that force is in "
    "phase with the velocity and drives the motion. Third row: time to the loss against the learning rate, with the "
    "plain PI beside; and the growth of the force's output weights against the number of steps of the desired force. "
    "Last row: conditions that advance the loss, and conditions that prevent it."
)
RELAXING = changed(FOAM, RELAXING_FOAM)
PARAMETERS: Mapping[str, Experiment] = {"foam that relaxes": RELAXING, "foam": FOAM, "rubber": RUBBER}
RATES = (1e-4, 5e-5, 2e-5, 1e-5, 5e-6)
FEW_RATES = (1e-4, 5e-5, 1e-5)
"""For the surfaces where runs are long."""
CAUSES: Mapping[str, Mapping[str, Any]] = {
    "as chosen": {},
    "constant force": {"force.second": None},
    "no noise": {"force_sensor.noise": 0.0},
    "steps and sine": SINE,
    "foam damped by 60 N s/m": {"surface.damping": 60.0},
    "foam damped by 200 N s/m": {"surface.damping": 200.0},
    "K_fp = 0": {"controller.kf": 0.0},
    "K_pv halved": {"controller.kv": 40.0},
    "random weights": {"controller.weights": "random", "controller.weights_seed": 1},
    "8 hidden neurons": {
        "controller.weights": "random",
        "controller.weights_seed": 1,
        "controller.layers": (8,),
    },
    "friction half": rougher(FOAM, 0.5),
    "friction double": rougher(FOAM, 2.0),
    "wall at 0.40 m": moved(FOAM, 0.40),
    "wall at 0.49 m": moved(FOAM, 0.49),
    "PI, K_i = 5 per second": PI,
}
HELD: Mapping[str, slice] = {
    "weights from poses held at zero": POSES,
    "weights from motor 1's torque held at zero": TORQUE1,
    "weights from all torques held at zero": TORQUES,
}
"""Hidden weights that are not allowed to grow."""


@dataclass(frozen=True)
class Data:
    """Measured values for `check` and `plot`."""

    courses: dict[str, dict[float, list[Course]]]  # by surface and learning rate
    pi: dict[str, list[float | None]]  # times of loss under the PI, by surface
    causes: dict[str, list[float | None]]  # times of loss
    loss: Loss | None


def run(runs: Runs) -> Data:
    """All the long runs."""
    courses: dict[str, dict[float, list[Course]]] = {}
    for name, e in PARAMETERS.items():
        rates, seeds = (RATES, runs.seeds[:5]) if e is RELAXING else (FEW_RATES, runs.seeds[:1])
        cases = [(changed(e, {"controller.learning_rate": r}), s) for r in rates for s in seeds]
        found = runs.map(lambda case: _course(runs, *case), cases)
        courses[name] = {r: found[i * len(seeds) : (i + 1) * len(seeds)] for i, r in enumerate(rates)}
    plain = {name: _losses(runs, changed(e, PI), 1) for name, e in PARAMETERS.items()}
    causes = {name: _losses(runs, changed(RELAXING, change), 1) for name, change in CAUSES.items()}
    held = runs.map(
        lambda columns: watch(RELAXING, runs.seeds[0], DURATION, hold(columns), runs.waiting, HOLD),
        list(HELD.values()),
    )
    causes.update((name, [lost]) for name, lost in zip(HELD, held, strict=True))
    return Data(courses, plain, causes, _loss(runs, courses["foam that relaxes"][5e-5][0].lost))


def check(data: Data) -> Sequence[Claim]:
    """A loss at every rate where the PI is steady; and, apart from that, on every surface."""
    relaxing = data.courses["foam that relaxes"]
    times = [c.lost for found in relaxing.values() for c in found]
    steady = all(lost is None for found in data.pi.values() for lost in found)
    others = [c.lost for name in ("foam", "rubber") for found in data.courses[name].values() for c in found]
    gone = sum(lost is not None for lost in others)
    return [
        Claim(
            id="neural-diverges.loss",
            source="explanation of sec. 6.3; stability is left open in sec. 7.2",
            claim="Going on, the neural controller loses the foam at every learning rate, where a PI is steady.",
            thesis="not in the thesis, which shows ten seconds, and a few minutes at 1e-5",
            measured=f"foam that relaxes: {_table(relaxing)}; PI {'steady' if steady else 'lost'} for {DURATION:g} s",
            tolerance=f"contact lost within {DURATION:g} s in every run from 5e-6 to 1e-4, and in none with the PI",
            verdict=decided(all(lost is not None for lost in times) and steady),
            note=(
                "Two layers grow together: the hidden weights from the torques and the output weights of the force. "
                "Thresholds only carry the integral, and weights from the poses stay small. The two layers amplify "
                "each other: after each step of the desired force the error and the hybrid controller's torques both "
                "deviate from their means, so their product has the same sign at every step, and the network learns "
                "to respond to torque with force. A smaller rate leaves a longer error after each step, which "
                "compensates for much of it: a twentieth of the rate takes only five times as long. With a constant "
                "force there is no growth; without noise the growth is the same. With the weights from the torques "
                "held at zero, and all others learning, contact is "
                f"{_kept(data.causes, 'weights from all torques held at zero')}. {_negative_damping(data.loss)} The "
                "torques contain velocities through K_pv, so the response to them is in phase with the motion and "
                "drives it; with half the K_pv it takes longer."
            ),
        ),
        Claim(
            id="neural-diverges.everywhere",
            source="explanation of sec. 6.3; stability is left open in sec. 7.2",
            claim="It does so on every surface.",
            thesis="not in the thesis",
            measured=f"foam and rubber: {gone} of {len(others)} runs lose contact within {DURATION:g} s",
            tolerance=f"contact lost within {DURATION:g} s in every run on foam and on rubber",
            verdict=decided(gone == len(others)),
            note=(
                "The weights grow there too, to about the same size. But foam with a damper of 200 N s/m and rubber "
                "with 480 N s/m dissipate the power of the network's response. The relaxing foam, with 13 N s/m and "
                "little more from its slow branch, does not; with 200 N s/m it keeps contact. The damping of real "
                "styrofoam decides whether the thesis' controller would have lost contact later. Times of loss on the "
                f"relaxing foam: {_times_by_cause(data.causes)}."
            ),
        ),
    ]


def plot(data: Data) -> Figure:
    """Weights, gains, the loss, times, growth by steps, causes."""
    drawing, grid = panels([2.2, 2.2, 2.2, 3.5], columns=2, width=11.0)
    for axis, name in zip(grid[0], ("foam that relaxes", "foam"), strict=True):
        weights_panel(axis, data.courses[name][5e-5][0], name)
    legend_inside(grid[0][1], loc="upper right", ncols=2)
    gains_panel(grid[1][0], data.courses)
    loss_panel(grid[1][1], data.loss)
    times_panel(grid[2][0], data.courses)
    steps_panel(grid[2][1], data.courses["foam that relaxes"])
    causes_panel(across(grid[3]), data.causes)
    return drawing


def _course(runs: Runs, experiment: Experiment, seed: int) -> Course:
    t: list[float] = []
    sizes: list[Array] = []
    gains: list[Array] = []

    def look(one: Look) -> None:
        assert one.neural is not None
        t.append(one.t)
        sizes.append(sizes_of(one.neural))
        gains.append(torque_gains_of(one.neural))

    lost = watch(experiment, seed, DURATION, look, runs.waiting)
    return Course(np.array(t), np.array(sizes), np.array(gains), lost)


def sizes_of(state: NeuralState) -> Array:
    """Root of the sum of squares of each of `PARTS`, shape (5,)."""
    hidden, output = layers(state)
    parts = (hidden[:, 7:], hidden[:, 1:7], hidden[:, 0], output[0, 1:], output[:, 0])
    return np.array([np.sqrt(np.sum(part**2)) for part in parts])


def torque_gains_of(state: NeuralState) -> Array:
    """Change of the network's force for a change of each torque among its inputs [N per N m], shape (3,)."""
    hidden, output = layers(state)
    inside, out = state.network.signals[9:21], state.network.signals[21]
    through = output[0, 1:] * 0.5 * (1.0 - inside**2)
    return np.array(20.0 * 0.5 * (1.0 - out**2) * through @ hidden[:, 7:])


def _losses(runs: Runs, experiment: Experiment, seeds: int) -> list[float | None]:
    return runs.map(
        lambda seed: watch(experiment, seed, DURATION, lambda _: None, runs.waiting), list(runs.seeds[:seeds])
    )


def _loss(runs: Runs, lost: float | None) -> Loss | None:
    """The last 0.4 s before the loss of the first seed, at the text's learning rate."""
    if lost is None:
        return None
    record = runs.one(changed(RELAXING, {"run.press": lost, "run.duration": DURATION + 60.0}))
    t = since_contact(record) - lost
    last = (t >= -0.4) & (t < 0.0)
    columns = (record[name][last] for name in ("memory_fx", "vx_measured", "force"))
    return Loss(t[last], *columns)


def _table(found: Mapping[float, Sequence[Course]]) -> str:
    """Times of loss by learning rate."""
    return ", ".join(f"{rate:g} after {_range([c.lost for c in courses])}" for rate, courses in found.items())


def _kept(causes: Mapping[str, Sequence[float | None]], name: str) -> str:
    lost = _range(causes[name])
    return f"not kept beyond {lost}" if lost != "never" else f"kept for {DURATION:g} s"


def _range(times: Sequence[float | None]) -> str:
    lost = [one for one in times if one is not None]
    if not lost:
        return "never"
    text = (
        f"{min(lost):.0f} s"
        if round(min(lost)) == round(max(lost))
        else f"{min(lost):.0f} to {max(lost):.0f} s"
    )
    return text if len(lost) == len(times) else f"{text} (in {len(lost)} of {len(times)} runs)"


def _times_by_cause(causes: Mapping[str, Sequence[float | None]]) -> str:
    return ", ".join(f"{name} {_range(times)}" for name, times in causes.items())


def _negative_damping(loss: Loss | None) -> str:
    """A sentence on what the network's force does to the motion before the loss."""
    if loss is None:
        return ""
    slope = float(np.polyfit(loss.velocity, loss.force, 1)[0])
    return (
        f"Before the loss the network's force is in phase with the velocity, by {slope:.0f} N s/m over the last 0.4 "
        "s: a negative damper."
    )
