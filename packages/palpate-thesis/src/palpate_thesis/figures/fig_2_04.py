"""Figures 2.3 and 2.4: one joint under a neural network alone, the direct scheme."""

from collections.abc import Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from palpate.arrays import Array
from palpate.environments import KelvinVoigt, StandardLinearSolid
from palpate.friction import LuGre
from palpate.records import Record
from palpate.references import ForceSchedule
from palpate.report import style
from palpate.studies.metrics.following import LIMIT, SHARE
from palpate.studies.metrics.window import SETTLE, rms
from palpate_thesis.claims import ThesisClaim, claim, often, spread
from palpate_thesis.drawing import LIMIT_LINE, Axes, Figure, panels
from palpate_thesis.one_joint import (
    JOINT_FRICTION,
    DirectIntegral,
    Link,
    direct_neural,
    one_joint,
)
from palpate_thesis.runs import VARIED_SEEDS, Runs, by_condition, stops_holding

NUMBER = "2.4"


class JointWorld(NamedTuple):
    """The joint's surface and friction."""

    surface: KelvinVoigt | StandardLinearSolid
    friction: LuGre = JOINT_FRICTION
    noise: float = 0.6
    force: float = 20.0
    """Scale of the forces at the network's inputs [N]."""


FOAM, RUBBER = JointWorld(KelvinVoigt(5200.0, 200.0, 0.10)), JointWorld(KelvinVoigt(34500.0, 480.0, 0.05))
RATE = 5e-5
_RUBS: Any = JOINT_FRICTION
SCHEDULE = ForceSchedule(20.0, 10.0, 2.5, 0.0, 0.5, 0.0)
WORLDS = {
    "foam": FOAM,
    "rubber": RUBBER,
    "relaxing\nfoam": JointWorld(StandardLinearSolid(5600.0, 13.0, 0.02, 6900.0, 0.23)),
    "friction\nhalf": JointWorld(FOAM.surface, _RUBS.scaled_by(0.5)),
    "friction\ndouble": JointWorld(FOAM.surface, _RUBS.scaled_by(2.0)),
    "noise\ndouble": JointWorld(FOAM.surface, noise=1.2),
    "inputs\nin N": JointWorld(FOAM.surface, force=1.0),
}
"""Each run has other noise and weights; lever, inertia and motor are those of joint 2, see `one_joint`."""
RATES = (5e-6, 1e-5, 2e-5, 5e-5, 1e-4, 2e-4, 5e-4, 1e-3)
DURATION, FROM = 15.0, 10.0
SAME = 0.10
"""Maximum relative difference of the errors of integral and network."""
FOLLOWS = (
    f"in 9 of 10 runs on each surface, from {FROM:g} to {DURATION:g} s: RMS of the true force's error at "
    f"most {LIMIT:g} N outside the first {SETTLE:g} s after each step, mean error in the last second of each "
    f"interval at most {SHARE:.0%}"
)


class RunAfterStart(NamedTuple):
    """Tracking errors of a run from `FROM` on."""

    settled: float  # RMS error outside the steps [N]
    rms: float  # steps included [N]
    off: float  # largest mean error at an interval's end, as a fraction of the desired force
    gain: float  # integral gain on the force: torque per newton and second, over the lever [1/s]

    @property
    def follows(self) -> bool:
        """True if the force follows the desired one."""
        return self.settled <= LIMIT and self.off <= SHARE


class Data(NamedTuple):
    """Measured values for `check` and `plot`."""

    record: dict[str, Array]
    worlds: dict[str, list[RunAfterStart]]
    integral: dict[str, list[RunAfterStart]]  # with the gain that the network had, run by run
    rates: dict[str, list[list[RunAfterStart]]]  # by surface, then by rate


def run(runs: Runs) -> Data:
    """All worlds at one rate, all rates on two surfaces, and the plain integral of the same gain."""
    two = {"foam": FOAM, "rubber": RUBBER}
    pressed = by_condition(runs, WORLDS, lambda world, seed: by_network(world, RATE, seed), two)
    integral = {
        name: runs.map(partial(_integral, world), list(zip(pressed[name], runs.seeds, strict=True)))
        for name, world in two.items()
    }
    rates = {
        name: [runs.map(partial(by_network, world, rate), runs.seeds[:VARIED_SEEDS]) for rate in RATES]
        for name, world in two.items()
    }
    record = one_joint(FOAM.surface, direct_neural(RATE, seed=runs.seeds[0]), SCHEDULE).run(
        DURATION, runs.seeds[0]
    )
    return Data(dict(record.columns), pressed, integral, rates)


def check(data: Data) -> Sequence[ThesisClaim]:
    """The network alone follows, and it acts as an integral."""
    both = {n: data.worlds[n] for n in ("foam", "rubber")}
    errors = "; ".join(
        f"{n}: RMS {spread([p.settled for p in v], 'N')}, interval ends off by "
        f"{spread([100 * p.off for p in v], '%', 2)}"
        for n, v in both.items()
    )
    slow = _span(data)
    shares = {
        n: [b.rms / a.rms for a, b in zip(data.worlds[n], data.integral[n], strict=True)]
        for n in data.integral
    }
    gains = [p.gain for n in data.integral for p in data.worlds[n]]
    return [
        claim(
            "network-alone",
            all(often(p.follows for p in v) for v in both.values()),
            surfaces=errors,
            follows=FOLLOWS,
            foam_slow=slow[0],
            rubber_slow=slow[1],
            where=stops_holding(data.worlds, lambda p: p.follows),
        ),
        claim(
            "network-alone.integrator",
            all(often(abs(s - 1) <= SAME for s in v) for v in shares.values()),
            surfaces="; ".join(
                (
                    f"{n}: {spread([100 * s for s in v], '%', 3)} of the network's RMS"
                    for n, v in shares.items()
                )
            ),
            gains=gains,
            start=FROM,
            same=SAME,
        ),
    ]


def plot(data: Data) -> Figure:
    """The force and the gain over time; the error over rates."""
    drawing, ((force,), (rates,)) = panels([2.6, 2.6])
    c = data.record
    force.plot(c["t"], c["force"], color=style.F, linewidth=1.1, label="true force")
    force.plot(c["t"], c["force_desired"], **style.KNOWN, label="desired")
    force.plot(
        c["t"], 1e4 * c["gain"], color=style.MEASURED, linewidth=0.9, label="gain [0.1 mN m per N and ms]"
    )
    force.set(xlabel="time [s]", ylabel="force [N]", xlim=(0.0, DURATION), ylim=(0.0, 27.0))
    style.legend(force)
    _rate_panel(rates, data)
    return drawing


def _rate_panel(axis: Axes, data: Data) -> None:
    for (name, by_rate), color in zip(data.rates.items(), style.SERIES, strict=False):
        settled = np.array([[p.settled for p in v] for v in by_rate])
        axis.loglog(RATES, np.median(settled, axis=1), color=color, linewidth=1.2, label=name)
        axis.plot(np.repeat(RATES, VARIED_SEEDS), settled.ravel(), "o", color=color, markersize=3)
    axis.axhline(LIMIT, **LIMIT_LINE)
    axis.axvline(RATE, color=style.MEASURED, linewidth=1, linestyle=":")
    axis.set(xlabel="learning rate", ylabel="RMS error [N]")
    axis.legend()
    axis.set_title("outside the steps; dashed: the limit, dotted: the chosen rate")


def _span(data: Data) -> tuple[float, float]:
    """Lowest and highest rate that follows on both surfaces; NaN if none does."""
    good = [
        rate
        for i, rate in enumerate(RATES)
        if all(p.follows for by_rate in data.rates.values() for p in by_rate[i])
    ]
    return (min(good), max(good)) if good else (float("nan"), float("nan"))


def by_network(world: JointWorld, rate: float, seed: int) -> RunAfterStart:
    """The network alone on one joint, at a learning rate."""
    link = Link(world.friction)
    bench = one_joint(
        world.surface,
        direct_neural(rate, force=world.force, seed=seed),
        SCHEDULE,
        link=link,
        noise=world.noise,
    )
    return _measure(bench.run(DURATION, seed), bench.loop.joint.lever)


def _integral(world: JointWorld, case: tuple[RunAfterStart, int]) -> RunAfterStart:
    (network, seed), link = case, Link(world.friction)
    controller = DirectIntegral(network.gain * 1e-3 * link.lever)
    bench = one_joint(world.surface, controller, SCHEDULE, link=link, noise=world.noise)
    return _measure(bench.run(DURATION, seed), link.lever)


def _measure(record: Record, lever: float) -> RunAfterStart:
    if record.meta["end"] != "done":
        return RunAfterStart(np.nan, np.nan, np.inf, np.nan)
    t, desired = record["t"], record["force_desired"]
    late = t >= FROM - 5e-7
    error = record["force"] - desired
    since = np.mod(t + 5e-7, SCHEDULE.period)
    interval = np.floor((t + 5e-7) / SCHEDULE.period)
    ends = [late & (interval == i) & (since >= SCHEDULE.period - 1.0) for i in np.unique(interval[late])]
    off = max(abs(float(error[e].mean())) / float(desired[e].mean()) for e in ends)
    gain = float(record["gain"][late].mean()) / 1e-3 / lever
    return RunAfterStart(rms(error[late & (since >= SETTLE)]), rms(error[late]), off, gain)
