"""How far a step of force moves the pose, and a jump of the pose the force, under two laws of hybrid control."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from palpate._vector import Vec3
from palpate.arrays import Array
from palpate.bench import Experiment, changed
from palpate.bench.metrics.summary import losses
from palpate.records import Record
from palpate.thesis.force_control.disturbances import Disturbance, desired_pose, run_with
from palpate.thesis.force_control.tracking import since_contact

COUPLED = {"controller": {"kind": "proportional-integral", "kf": 1.0, "ki": 3.0}}
"""(4.13) with the thesis' gains on foam: 0.003 per sample is 3 per second."""
STEPS, JUMPS = (2.5, 5.0), (1.2, 6.2)
"""When the force steps, and when y jumps, after contact [s]; y at 10 N, where motor 2 has torque to spare."""
JUMP = 0.005
"""Of the desired y, there and back [m]."""
PRINTED = {"controller.form": "printed", "controller.kf": 1.0}


@dataclass(frozen=True)
class Stray:
    """How far one loop's steps carry the other; means over the steps of the largest within a second."""

    y: float  # after a step of force [mm]
    phi: float  # likewise [deg]
    force: float  # after a jump of y, as a share of the desired force
    lost: int  # losses of contact


@dataclass(frozen=True)
class Pair:
    """The coupled law and the decoupled one, in the same world."""

    coupled: Stray
    decoupled: Stray
    stiffness: float  # as identified, which the decoupled law uses [N/m]

    @property
    def angle(self) -> float:
        """How far the tip turns under the decoupled law, over that under the coupled one."""
        return self.decoupled.phi / self.coupled.phi

    @property
    def side(self) -> float:
        """Likewise for y."""
        return self.decoupled.y / self.coupled.y


def pair_of(case: tuple[Experiment, int, Mapping[str, Any]]) -> Pair:
    """Both laws in a world, with a seed, after K_e was identified there; changes of the decoupled law, if any."""
    world, seed, law = case
    stiffness = identified(world, seed)
    used = stiffness * law.get("wrong", 1.0)
    changes = {"controller.stiffness": used, **{k: v for k, v in law.items() if k != "wrong"}}
    coupled, decoupled = changed(world, COUPLED), changed(world, changes)
    return Pair(stray(pressed(coupled, seed)), stray(pressed(decoupled, seed)), stiffness)


def as_printed(case: tuple[Pair, Experiment, int]) -> Pair:
    """A pair with the law as printed in place of the corrected one."""
    pair, world, seed = case
    law = {"controller.stiffness": pair.stiffness, **PRINTED}
    return replace(pair, decoupled=stray(pressed(changed(world, law), seed)))


def identified(world: Experiment, seed: int) -> float:
    """K_e [N/m] by the matched estimator, after two seconds under the coupled law."""
    record = run_with(changed(world, {**COUPLED, "run.press": 2.0}), seed, [])
    return float(record["K_matched"][-1])


def pressed(experiment: Experiment, seed: int) -> Record:
    """A press in whose course the desired y jumps."""
    jumps = [
        Disturbance(at, desired_pose(Vec3(0.0, sign * JUMP, 0.0)))
        for at, sign in zip(JUMPS, (1, -1), strict=True)
    ]
    return run_with(experiment, seed, jumps)


def stray(record: Record) -> Stray:
    """How far the record's steps of force and jumps of y carry the other loop."""
    t, force = since_contact(record), record["force"]
    begun = record["t"][0] - t[0]
    y = [furthest(t, record["y"], at) for at in STEPS]
    phi = [furthest(t, record["phi"], at) for at in STEPS]
    pushed = [furthest(t, force, at - begun) / 10.0 for at in record.meta["disturbances"]]
    return Stray(
        1e3 * float(np.mean(y)), float(np.degrees(np.mean(phi))), float(np.mean(pushed)), losses(record)
    )


def furthest(t: Array, signal: Array, at: float) -> float:
    """How far the signal strays within a second, from its mean over the tenth of a second before."""
    before = signal[(t >= at - 0.1) & (t < at - 5e-7)].mean()
    return float(np.abs(signal[(t >= at - 5e-7) & (t < at + 1.0)] - before).max())
