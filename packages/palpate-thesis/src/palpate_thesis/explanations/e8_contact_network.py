"""Explanation 8: networks that approach the environment and recognise the contact with it (after Fukuda et al.)."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from palpate._jit import kernel, part
from palpate.arrays import Array
from palpate.environments import KelvinVoigt
from palpate.networks import Network, NetworkState, network, random_layers
from palpate.records import Record
from palpate.references import ForceSchedule
from palpate.report import style
from palpate_thesis.claims import ThesisClaim, claim, often
from palpate_thesis.force_control.panels import panels
from palpate_thesis.look import LIMIT_LINE, Figure
from palpate_thesis.one_joint import JOINT_2, one_joint
from palpate_thesis.runs import Runs

NUMBER = "contact-network"
SURFACES = {"foam": KelvinVoigt(5200.0, 200.0, 0.10), "rubber": KelvinVoigt(34500.0, 480.0, 0.05)}
TICK, LEVER = 1e-3, JOINT_2.lever
TIP = JOINT_2.inertia / LEVER**2
"""Mass of the joint at its tip [kg]."""
GAP, STRAY, NEAR = 0.03, 0.002, 0.005
"""Way to the surface; standard deviation of where the arm takes it to be; within which it learns to be slow [m]."""
FAST, SLOW, SWITCH, MOST = 0.1, 0.005, 5.0, 6.25
"""Speeds of the networks [m/s]; the thesis' switch, and largest force of an approach that was gentle enough [N]."""
SPEEDS = tuple(float(v) for v in np.geomspace(1e-3, 0.1, 13))
"""Constant approaches beside them [m/s]; the thesis' is the first."""
SWITCHES = (0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 4.0)
"""Lower switches, tried in the same approaches [N]."""
LESSONS, EPOCHS, OFTEN = 16, 30, 300
"""Approaches that are learned from, at constant speeds; times each sample is learned; samples of each kind in each."""
HALF = 0.5
"""Largest share of the force felt with the switch, and of the time of a constant approach."""


@part
class ApproachState(NamedTuple):
    nearness: NetworkState
    contact: NetworkState
    aim: float  # of the position [m]; NaN before the first tick
    x: float  # of the tick before [m]
    short: float  # running means of the force [N]
    long: float
    felt: float  # 1.0 since the contact was recognised
    total: float  # of the force error since [N s]


@part
class ApproachByNetwork(NamedTuple):
    """Position control at a speed until contact is recognised, then force control.

    Args:
        fast, slow: speeds where the surface is taken to be far and near [m/s].
        switch: force at which contact is recognised [N]; 0: by its network.
        offset: error of the position that the arm knows [m].
        nearness: network of that position, 1 input and 1 output.
        contact: network of the force and its running means over 4 and 16 ticks, 3 inputs and 1 output.
    """

    fast: float
    slow: float
    switch: float
    offset: float
    nearness: Network
    contact: Network

    def start(self):
        return ApproachState(self.nearness.start(), self.contact.start(), np.nan, 0.0, 0.0, 0.0, 0.0, 0.0)

    def step(self, state, desired, f, x):
        """Torque [N m] from the desired and the measured force [N] and the depth [m]."""
        begun = state.aim == state.aim
        aim, rate = (state.aim, (x - state.x) / TICK) if begun else (x, 0.0)
        short, long = state.short + (f - state.short) / 4.0, state.long + (f - state.long) / 16.0
        near, touch = state.nearness, state.contact
        near.signals[0] = (x + self.offset) / NEAR
        touch.signals[0], touch.signals[1], touch.signals[2] = f / SWITCH, short / SWITCH, long / SWITCH
        self.nearness.forward(near)
        self.contact.forward(touch)
        told = f >= self.switch if self.switch > 0.0 else self.contact.output(touch, 0) > 0.0
        felt = 1.0 if told else state.felt
        speed = self.slow + 0.5 * (1.0 - self.nearness.output(near, 0)) * (self.fast - self.slow)
        total = state.total + felt * TICK * (desired - f)
        aim += TICK * speed
        free = TIP * (80.0 * (speed - rate) + 400.0 * (aim - x))
        push = desired + 3.0 * total - 300.0 * rate if felt == 1.0 else free
        return LEVER * push, ApproachState(near, touch, aim, x, short, long, felt, total)

    def gain(self, state):
        """Whether contact is recognised, for the record."""
        return state.felt


@kernel
def learn_all(net, memory, inputs, wanted):
    """Back-propagation of samples in their order, inputs (n, n_in) and desired outputs (n,)."""
    for i in range(len(wanted)):
        for j in range(inputs.shape[1]):
            memory.signals[j] = inputs[i, j]
        net.forward(memory)
        net.want(memory, 0, wanted[i] - net.output(memory, 0))
        net.learn(memory)


def fit(
    sizes: tuple[int, ...], inputs: Array, wanted: Array, random: np.random.Generator, **options: float
) -> Network:
    """A network that has learned samples, drawn in a new order each time.

    Args:
        sizes: of the layers.
        inputs: shape (n, n_in).
        wanted: output of each sample, shape (n,).
        random: of weights and order.
        options: `amplitude` of the output and learning `rate`, 1 and 0.05 unless given.
    """
    amplitude, rate = options.get("amplitude", 1.0), options.get("rate", 0.05)
    net = network(random_layers(sizes, random, 0.5), amplitude, rate)
    memory = net.start()
    for _ in range(int(options.get("epochs", EPOCHS))):
        order = random.permutation(len(wanted))
        learn_all(net, memory, inputs[order], wanted[order])
    return net._replace(weights=memory.weights)


def teach(seed: int) -> ApproachByNetwork:
    """The approach by networks that have learned from `LESSONS` others, on foam and rubber, at several speeds."""
    random = np.random.default_rng(seed)
    lessons = [
        lesson(random, list(SURFACES.values())[i % 2], 10_000 * (seed + 1) + i) for i in range(LESSONS)
    ]
    inputs, near, contact = (np.concatenate(rows) for rows in zip(*lessons, strict=True))
    nearness = fit((1, 3, 1), inputs[:, 3:], near, random)
    return ApproachByNetwork(
        FAST, SLOW, 0.0, offset(seed), nearness, fit((3, 4, 1), inputs[:, :3], contact, random)
    )


def lesson(random: np.random.Generator, surface: KelvinVoigt, seed: int) -> tuple[Array, Array, Array]:
    """Inputs of both networks, shape (n, 4), nearness and contact, -0.95 or 0.95, (n,), of one approach up to 5 N."""
    from scipy.signal import lfilter

    part = constant(float(np.exp(random.uniform(np.log(SLOW), np.log(FAST)))), seed)
    record = approach(surface, part, seed)
    end = int(np.argmax(record["gain"] > 0.0)) + 20
    x, f = record["penetration"][:end], record["force_measured"][:end] / SWITCH
    means = [lfilter([1.0 / n], [1.0, 1.0 / n - 1.0], f) for n in (4.0, 16.0)]
    inputs = np.column_stack([f, *means, (x + part.offset) / NEAR])
    kinds = [np.flatnonzero(kind) for kind in (x <= -NEAR, (x > -NEAR) & (x <= 0.0), x > 0.0)]
    rows = np.concatenate([random.choice(k, min(OFTEN, len(k)), replace=False) for k in kinds if len(k)])
    near, contact = (np.where(x > limit, 0.95, -0.95)[rows] for limit in (-NEAR, 0.0))
    return inputs[rows], near, contact


def constant(speed: float, seed: int, switch: float = SWITCH) -> ApproachByNetwork:
    """The thesis' approach: a constant speed until the force reaches a switch."""
    blank = (network([np.zeros((1, n + 1)), np.zeros((1, 2))], 1.0, 1.0) for n in (1, 3))
    return ApproachByNetwork(speed, speed, switch, offset(seed), *blank)


def offset(seed: int) -> float:
    """Error of the place at which the arm takes the surface to be [m]."""
    return float(STRAY * np.random.default_rng((seed, 7)).standard_normal())


def approach(surface: KelvinVoigt, part: ApproachByNetwork, seed: int) -> Record:
    """A run from `GAP` before the surface, and on in contact."""
    duration = 3.0 + GAP / part.fast + (0.0 if part.fast == part.slow else 4.0 * NEAR / part.slow)
    schedule = ForceSchedule(SWITCH, SWITCH, 2.5, 0.0, 0.5, 0.0)
    return one_joint(surface, part, schedule, steps=10).run(duration, seed, gap=GAP)


class Arrival(NamedTuple):
    """How an approach ended."""

    time: float  # to the first touch [s]
    early: bool  # recognised before anything was touched
    felt: float  # largest true force until it was recognised [N]
    most: float  # largest true force within half a second [N]


def arrival(record: Record) -> Arrival:
    """The first touch of a run, and what was felt."""
    touched, told = (int(np.argmax(record[c] > 0.0)) for c in ("touching", "gain"))
    force = record["force"]
    felt = float(force[touched : told + 1].max()) if told >= touched else 0.0
    return Arrival(TICK * touched, told < touched, felt, float(force[touched : touched + 500].max()))


class Data(NamedTuple):
    """Measured values for `check` and `plot`; arrivals by surface, one a seed."""

    shown: dict[str, tuple[ApproachByNetwork, Record]]  # of the first seed
    found: dict[str, list[Arrival]]
    by_switch: dict[str, list[Arrival]]  # at the same pace, with the thesis' switch
    lower: dict[float, list[Arrival]]  # likewise with lower ones, both surfaces
    constant: dict[str, dict[float, list[Arrival]]]  # by speed, with the thesis' switch


def run(runs: Runs) -> Data:
    """Networks taught anew for each seed, and the approaches that they are compared with."""
    nets = dict(zip(runs.seeds, runs.map(teach, runs.seeds), strict=True))

    def arrivals(surface: KelvinVoigt, part_of: Callable[[int], ApproachByNetwork]) -> list[Arrival]:
        return runs.map(lambda seed: arrival(approach(surface, part_of(seed), seed)), runs.seeds)

    def by_switch(surface: KelvinVoigt, switch: float) -> list[Arrival]:
        return arrivals(surface, lambda seed: nets[seed]._replace(switch=switch))

    first = runs.seeds[0]
    return Data(
        {name: (nets[first], approach(surface, nets[first], first)) for name, surface in SURFACES.items()},
        {name: by_switch(surface, 0.0) for name, surface in SURFACES.items()},
        {name: by_switch(surface, SWITCH) for name, surface in SURFACES.items()},
        {f: [a for surface in SURFACES.values() for a in by_switch(surface, f)] for f in SWITCHES},
        {
            name: {v: arrivals(surface, partial(constant, v)) for v in SPEEDS}
            for name, surface in SURFACES.items()
        },
    )


def check(data: Data) -> Sequence[ThesisClaim]:
    """Recognising, surface by surface; and the time of an approach that is gentle enough."""
    quiet = [f for f, some in data.lower.items() if often(not a.early for a in some)]
    gentle = {
        name: max((v for v, some in by.items() if often(a.most <= MOST for a in some)), default=np.nan)
        for name, by in data.constant.items()
    }
    times = {
        name: float(np.median([a.time for a in data.constant[name].get(v, [])] or [np.inf]))
        for name, v in gentle.items()
    }
    return [
        *(_recognises(data, name, min(quiet, default=SWITCH)) for name in SURFACES),
        claim(
            f"{NUMBER}.efficient",
            all(
                often(a.most <= MOST and a.time <= HALF * times[name] for a in some)
                for name, some in data.found.items()
            ),
            **data.found,
            gentle="; ".join(f"{n} {times[n]:.2g} s at {1e3 * v:.2g} mm/s" for n, v in gentle.items()),
            thesis=float(np.median([a.time for a in data.constant["foam"][SPEEDS[0]]])),
            half=HALF,
            most=MOST,
            stray=1e3 * STRAY,
            gap=1e3 * GAP,
            lessons=LESSONS,
        ),
    ]


def _recognises(data: Data, name: str, quiet: float) -> ThesisClaim:
    pairs = list(zip(data.found[name], data.by_switch[name], strict=True))
    return claim(
        f"{NUMBER}.{name}",
        often(not a.early and a.felt <= HALF * b.felt for a, b in pairs),
        surface=name,
        found=data.found[name],
        switched=data.by_switch[name],
        early=sum(a.early for a, _ in pairs),
        runs=len(pairs),
        half=HALF,
        quiet=quiet,
    )


def plot(data: Data) -> Figure:
    """Depth and force of an approach; the largest force over the time of each."""
    drawing, grid = panels([2.2, 2.6], 2, 11.0)
    for (name, (_, record)), color in zip(data.shown.items(), style.SERIES, strict=False):
        t = record["t"]
        grid[0][0].plot(t, 1e3 * record["penetration"], color=color, linewidth=1.3, label=name)
        told = int(np.argmax(record["gain"] > 0.0))
        near = slice(max(told - 60, 0), told + 90)
        since = 1e3 * (t[near] - t[told])
        grid[0][1].plot(since, record["force_measured"][near], color=color, linewidth=0.7, alpha=0.6)
        grid[0][1].plot(since, record["force"][near], color=color, linewidth=1.4, label=name)
        by = data.constant[name]
        times, most = np.median([[(a.time, a.most) for a in some] for some in by.values()], axis=1).T
        line: Any = {"linewidth": 1.0, "markersize": 3, "label": f"{name}, constant speeds"}
        grid[1][0].loglog(times, most, "o-", color=color, **line)
        own = data.found[name]
        grid[1][0].plot([a.time for a in own], [a.most for a in own], "x", color=color, markersize=6)
    grid[0][0].set(xlabel="time [s]", ylabel="depth [mm]", xlim=(0.0, 2.0))
    grid[0][1].axhline(SWITCH, **style.KNOWN)
    grid[0][1].set(xlabel="time since recognised [ms]", ylabel="force [N]", ylim=(-2.5, 8.0))
    grid[0][1].set_title("true force, and pale as measured; dashed: the switch")
    grid[1][0].axhline(MOST, **LIMIT_LINE)
    grid[1][0].set(xlabel="time to the first touch [s]", ylabel="largest force [N]")
    grid[1][0].set_title("crosses: networks; dashed: gentle enough")
    share = [100 * np.mean([a.early for a in some]) for some in data.lower.values()]
    grid[1][1].plot(SWITCHES, share, "o-", color=style.FAIL, markersize=4)
    early = [a.early for some in data.found.values() for a in some]
    grid[1][1].axhline(100 * sum(early) / len(early), **LIMIT_LINE)
    grid[1][1].set(xlabel="switch [N]", ylabel="in free motion [%]")
    grid[1][1].set_title("recognised before the touch, by a switch; dashed: by the network")
    for axis in (grid[0][0], grid[1][0]):
        axis.legend()
    return drawing
