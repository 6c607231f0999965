"""Runs with a change in the middle: of the surface, its position, or the desired pose."""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from palpate._vector import Vec3
from palpate.bench import Experiment, build
from palpate.bench.force_input import COLUMNS
from palpate.bench.plant import Loop, LoopState
from palpate.bench.summary import DIVERGED, DONE
from palpate.environments import KelvinVoigt, join
from palpate.records import Record

LOOK = 100
"""Ticks between two looks for the first contact."""

Change = Callable[[Loop, LoopState], tuple[Loop, LoopState]]


class Disturbance(NamedTuple):
    """Something that changes between two ticks.

    Args:
        at: when, since the first contact [s]; a tenth of a second at least.
        change: the loop and its state as they go on; types stay as they are, so that nothing is compiled anew.
    """

    at: float
    change: Change


def run_with(experiment: Experiment, seed: int, disturbances: Sequence[Disturbance]) -> Record:
    """Runs like `Bench.run`, from the same random numbers, for `press` seconds of contact, through the disturbances.

    Args:
        experiment: any; it runs on after losses of contact.
        seed: of the noise.
        disturbances: in the order of their times.

    Returns:
        All rows up to the end, or up to the first number that is none; ``meta["disturbances"]`` holds the times [s].
    """
    bench = build(experiment)
    tick, march = bench.loop.tick, bench.simulation(seed)
    rows = [march.advance(LOOK)]
    while march.ticks < round(experiment.run.duration / tick) and _finite(rows) and march.contact is None:
        rows.append(march.advance(LOOK))
    begun = march.ticks if march.contact is None else march.contact
    for at, change in [(t.at, t.change) for t in disturbances] + [(experiment.run.press, None)]:
        left = begun + round(at / tick) - march.ticks
        if left > 0 and _finite(rows):
            rows.append(march.advance(left))
        if change is not None:
            march.loop, march.state = change(march.loop, march.state)
    all_rows = np.concatenate(rows)
    finite = np.isfinite(all_rows).all(axis=1)
    kept = all_rows if finite.all() else all_rows[: int(np.argmin(finite))]
    columns = {name: kept[:, i].copy() for i, name in enumerate(COLUMNS)}
    times = [(begun * tick) + one.at for one in disturbances]
    end = DONE if finite.all() else DIVERGED
    return Record(columns, COLUMNS, {**bench.meta, "seed": seed, "end": end, "disturbances": times})


def _finite(rows: Sequence[np.ndarray]) -> bool:
    return bool(np.isfinite(rows[-1]).all())


def other_surface(surface: KelvinVoigt) -> Change:
    """The surface becomes another one under the tip, at the depth at which its spring carries the force of before."""

    def change(loop: Loop, state: LoopState) -> tuple[Loop, LoopState]:
        arm: Any = loop.plant.arm
        tip = arm.pose(state.plant.q).x
        deep = state.felt.normal / surface.stiffness
        plant = loop.plant._replace(surface=join(surface), wall=tip - deep)
        touched = state.plant.surface._replace(deflection=deep, internal=0.0)
        return loop._replace(plant=plant), state._replace(plant=state.plant._replace(surface=touched))

    return change


def surface_back(by: float) -> Change:
    """The surface is drawn back by so much [m], out of reach of the tip if that is more than the tip's depth."""

    def change(loop: Loop, state: LoopState) -> tuple[Loop, LoopState]:
        return loop._replace(plant=loop.plant._replace(wall=loop.plant.wall + by)), state

    return change


def desired_pose(by: Vec3) -> Change:
    """The desired pose jumps by so much [m, m, rad], seen from the arm.

    A task has one pose, so the arm is put down that much on the other side of it, at the rate it had, and so is what
    the controller remembers of the tick before: from there on, the error goes as after a jump of the desired pose.
    """

    def change(loop: Loop, state: LoopState) -> tuple[Loop, LoopState]:
        arm: Any = loop.plant.arm
        motion: Any = loop.conditioning.motion
        q = state.plant.q
        there = arm.inverse(arm.pose(q) - by, 1.0 if q.y >= 0.0 else -1.0)
        past, by_q = state.conditioning, there - q
        settled = motion.start_at(by_q.z)
        past = past._replace(
            q=past.q + by_q,
            x=past.x - by,
            angle=type(past.angle)(past.angle.s1 + settled.s1, past.angle.s2 + settled.s2),
        )
        return loop, state._replace(plant=state.plant._replace(q=there), conditioning=past)

    return change
