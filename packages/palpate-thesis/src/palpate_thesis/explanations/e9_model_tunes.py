"""Explanation 9: a network is the model of a nonlinear environment, and its local slopes tune the controller."""

from collections.abc import Mapping, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from palpate._jit import law, part
from palpate._vector import ZERO3, Vec3, clip
from palpate.arrays import Array
from palpate.bench import Experiment, build, load, with_values
from palpate.bench.summary import CONTACT
from palpate.controllers.controller import controller
from palpate.controllers.decoupled_hybrid import decoupled_hybrid
from palpate.controllers.resolved_acceleration import position_command
from palpate.networks import Network, NetworkState, network
from palpate.networks.network import backward
from palpate.records import Record
from palpate.report import style
from palpate_thesis.claims import ThesisClaim, claim, often
from palpate_thesis.conditions import SHORT
from palpate_thesis.explanations.e8_contact_network import fit
from palpate_thesis.force_control.panels import across, panels
from palpate_thesis.force_control.tracking import since_contact
from palpate_thesis.look import Figure
from palpate_thesis.neural_identifier.network import STIFFENING
from palpate_thesis.runs import Runs

NUMBER = "model-tunes"
PI = {"foam": {"kf": 1.0, "ki": 3.0}, "rubber": {"kf": 0.25, "ki": 1.5}}
"""The thesis' gains, under which the surface is identified."""
_RICH = {"first": 18.0, "second": 8.0, "period": 1.0, "amplitude": 2.0, "frequency": 3.0}
PARAMETERS: Mapping[str, Experiment] = {
    name: with_values(
        with_values(load("foam-decoupled"), {**SHORT, "run.press": 10.0, "force": _RICH}),
        {"surface": surface, "controller": {"kind": "proportional-integral", **PI[name]}},
    )
    for name, surface in STIFFENING.items()
}
LEVELS = {"low": (10.0, 6.0), "high": (20.0, 16.0)}
"""Steps of the desired force [N], a second each."""
POLE = 36.0
"""Of the force loop, three times, were the model right [1/s]."""
SEEN = 0.15
"""Time after a step over which responses are compared [s]."""
SIZES, OPTIONS = (2, 6, 1), {"amplitude": 40.0, "rate": 1e-4, "epochs": 300}
"""Depth and rate in, the force out; the thesis' amplitude and learning rate."""
HALF = 0.5
MODELS = ("network", "line")
ONE = Vec3(1.0, 1.0, 1.0)


@part
class TunedState(NamedTuple):
    network: NetworkState
    stiffness: float  # [N/m]
    damping: float  # [N s/m]
    total: float  # of the force error [N s]


@controller
class ModelTuned(NamedTuple):
    """Decoupled hybrid control whose K_e and B_e are the slopes of a model of the force, where the tip is.

    The corrected law (4.19) with an integral gives the force three equal poles on a spring. A damper B of the surface
    adds kf B/K to the force-rate gain, so that much less is asked for. The model is a line plus a network.

    Args:
        pole: of the three [1/s].
        line: stiffness [N/m] and damping [N s/m].
        middle, size: mean and standard deviation of position [m] and rate [m/s] in what the network has learned; beyond
            twice the size it is asked at the edge.
        least: smallest stiffness of the model there [N/m].
        network: of both in that scale; its output is a force [N].
    """

    pole: float
    line: Vec3
    middle: Vec3
    size: Vec3
    least: float
    network: Network

    def start(self):
        return TunedState(self.network.start(), self.line.x, self.line.y, 0.0)

    def slopes(self, memory, x, v):
        """Stiffness [N/m] and damping [N s/m] of the model at a position [m] and rate [m/s]."""
        net = self.network
        memory.signals[0] = clip((x - self.middle.x) / self.size.x, 2.0)
        memory.signals[1] = clip((v - self.middle.y) / self.size.y, 2.0)
        net.forward(memory)
        stiffness = self.line.x + input_slope(net, memory, 0) / self.size.x
        return stiffness, self.line.y + input_slope(net, memory, 1) / self.size.y

    def step(self, state, sense, task, model):
        K, B = self.slopes(state.network, sense.x.x, sense.xd.x)
        K = max(K, self.least)
        error, kf = task.f - sense.f, 3.0 * self.pole**2
        total = state.total + 1e-3 * error.x
        rate = max(3.0 * self.pole - kf * B / K, 0.0)
        u_x = position_command(400.0 * ONE, 80.0 * ONE, sense.x, sense.xd, task.x, task.xd, task.xdd)
        u_f = (kf / K) * (error + Vec3(self.pole / 3.0 * total, 0.0, 0.0)) + rate * (task.xd - sense.xd)
        torque = decoupled_hybrid(model.J, model.Jdqd, model.M, model.h, task.s, u_x, u_f, sense.f)
        return torque, TunedState(state.network, K, B, total)

    def report(self, state):
        """The slopes that it uses."""
        return ZERO3, Vec3(state.stiffness, state.damping, 0.0)


@law
def input_slope(net, memory, i):
    """Derivative of the only output by input i, of a network with one hidden layer, after its `forward`."""
    n, total = net.sizes[0], 0.0
    net.want(memory, 0, 1.0)
    backward(net.sizes, memory.weights, net.amplitude, memory.signals, memory.deltas)
    for j in range(net.sizes[1]):
        total += memory.deltas[n + j] * memory.weights[j * (n + 1) + 1 + i]
    return total


class Tuned(NamedTuple):
    """One surface and seed: both models, and the responses under each."""

    forces: Array  # at which the slopes are looked at [N]
    slopes: dict[str, Array]  # true, of the network and of the line, over `forces` [N/m]
    responses: dict[str, dict[str, Array]]  # by model and level: mean step response, a sample a tick
    lost: bool

    def apart(self, model: str) -> float:
        """RMS difference of the responses at both levels."""
        low, high = self.responses[model].values()
        return float(np.sqrt(np.mean((low - high) ** 2)))

    def wrong(self, model: str) -> float:
        """RMS error of a model's stiffness, as a share."""
        return float(np.sqrt(np.mean((self.slopes[model] / self.slopes["true"] - 1.0) ** 2)))


def models(experiment: Experiment, record: Record, seed: int) -> dict[str, ModelTuned]:
    """The controllers tuned by a network and by a line, from one record of depth, rate and measured force."""
    pressing = record["phase"] == CONTACT
    x, v, f = (record[name][pressing][::3] for name in ("x_measured", "vx_measured", "force_measured"))
    line = np.linalg.lstsq(np.column_stack([x, v, np.ones_like(x)]), f)[0]
    inputs = np.column_stack([x, v])
    middle, size = inputs.mean(axis=0), inputs.std(axis=0)
    scaled = np.clip((inputs - middle) / size, -2.0, 2.0)
    net = fit(SIZES, scaled, f - f.mean(), np.random.default_rng(seed), **OPTIONS)
    blank = network([np.zeros((6, 3)), np.zeros((1, 7))], 1.0, 1.0)
    at, by = (Vec3(float(row[0]), float(row[1]), 0.0) for row in (middle, size))
    made = ModelTuned(POLE, ZERO3, at, by, 0.0, net)
    memory = made.start().network
    least = min(float(made.slopes(memory, *row)[0]) for row in inputs[::50])
    return {
        "network": made._replace(least=max(least, float(line[0]) / 10.0)),
        "line": made._replace(line=Vec3(float(line[0]), float(line[1]), 0.0), network=blank),
    }


def tune(experiment: Experiment, seed: int) -> Tuned:
    """Identification, then steps at both levels under each model."""
    found = models(experiment, build(experiment).run(60.0, seed, press=experiment.run.press), seed)
    law, wall = experiment.surface, experiment.wall.x
    forces = np.linspace(6.0, 20.0, 15)
    depth = np.sqrt(forces / law.stiffness)
    slopes = {"true": 2.0 * law.stiffness * depth}
    for name, one in found.items():
        memory = one.start().network
        slopes[name] = np.array([one.slopes(memory, wall + d, 0.0)[0] for d in depth])
    benches = {
        level: build(with_values(experiment, {"force": {"first": high, "second": low, "period": 1.0}}))
        for level, (high, low) in LEVELS.items()
    }
    records = {
        name: {n: bench.with_controller(one).run(60.0, seed, press=10.0) for n, bench in benches.items()}
        for name, one in found.items()
    }
    responses = {name: {n: response(r) for n, r in by.items()} for name, by in records.items()}
    ends = [record.meta["end"] for by in records.values() for record in by.values()]
    return Tuned(forces, slopes, responses, any(end != "done" for end in ends))


def response(record: Record) -> Array:
    """Mean response to the steps but the first, over their size, for `SEEN`, a sample a tick."""
    t, force, desired = since_contact(record), record["force"], record["force_desired"]
    n = round(1e3 * SEEN)
    steps = np.flatnonzero((np.diff(desired) != 0.0) & (t[1:] > 1.5) & (t[1:] < t[-1] - SEEN)) + 1
    if not len(steps):
        return np.full(n, np.nan)
    rows = [(force[i : i + n] - force[i - 100 : i].mean()) / (desired[i] - desired[i - 1]) for i in steps]
    return np.asarray(np.mean(rows, axis=0))


def run(runs: Runs) -> dict[str, list[Tuned]]:
    """Each stiffening surface, identified and pressed on with every seed."""
    return {name: runs.map(partial(tune, e), runs.seeds) for name, e in PARAMETERS.items()}


def check(data: Mapping[str, Sequence[Tuned]]) -> Sequence[ThesisClaim]:
    """The slopes of both models; and whether the controller answers alike at both levels."""
    wrong = {
        f"{name}_{model}": [100 * one.wrong(model) for one in found]
        for name, found in data.items()
        for model in MODELS
    }
    slopes = all(
        often(o.wrong("network") <= HALF * o.wrong("line") for o in found) for found in data.values()
    )
    return [claim(f"{NUMBER}.slopes", slopes, half=HALF, **wrong), *map(_alike, data, data.values())]


def _alike(name: str, found: Sequence[Tuned]) -> ThesisClaim:
    return claim(
        f"{NUMBER}.{name}",
        often(not one.lost and one.apart("network") <= HALF * one.apart("line") for one in found),
        surface=name,
        **{model: [100 * one.apart(model) for one in found] for model in MODELS},
        furthest=", ".join(f"{model} {_furthest(found, model)}" for model in MODELS),
        half=HALF,
        seen=1e3 * SEEN,
    )


def _furthest(found: Sequence[Tuned], model: str) -> str:
    """The middle of the furthest points of the responses at the low and the high level."""
    return " and ".join(
        f"{np.median([one.responses[model][level].max() for one in found]):.2f}" for level in LEVELS
    )


def plot(data: Mapping[str, Sequence[Tuned]]) -> Figure:
    """Stiffness over the force; responses at both levels; how far apart they are."""
    drawing, grid = panels([2.4, 2.4, 1.5], 2, 11.0)
    colors = dict(zip(MODELS, style.SERIES, strict=False))
    apart = across(grid[2])
    for (slopes, answers), (name, found) in zip(grid, data.items(), strict=False):
        one = found[0]
        slopes.plot(one.forces, 1e-3 * one.slopes["true"], **style.KNOWN, label="true")
        for model, color in colors.items():
            every = 1e-3 * np.array([other.slopes[model] for other in found]).T
            slopes.plot(one.forces, every, color=color, linewidth=0.5, alpha=0.5)
            slopes.plot(one.forces, 1e-3 * one.slopes[model], color=color, linewidth=1.2, label=model)
            for (level, y), line in zip(one.responses[model].items(), ("-", ":"), strict=True):
                label = f"{model}, {level}"
                answers.plot(np.arange(len(y)), y, line, color=color, linewidth=1.3, label=label)
            row = [f"{name}, {model}"] * len(found)
            apart.plot([100 * o.apart(model) for o in found], row, "o", color=color, markersize=4, alpha=0.7)
        slopes.set(xlabel="force [N]", ylabel=f"{name}: stiffness [kN/m]")
        answers.set(xlabel="time since a step [ms]", ylabel="share of the step", xlim=(0.0, 1e3 * SEEN))
        answers.axhline(1.0, color=style.INK, linewidth=0.7)
        slopes.legend()
        answers.legend(fontsize=7)
    apart.set(xlabel="response at the low against that at the high level [% of a step]", xlim=(0.0, None))
    apart.margins(y=0.2)
    return drawing
