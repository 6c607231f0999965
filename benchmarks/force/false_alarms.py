"""How often the law takes noise in free motion for a contact, and what it makes of it.

    python benchmarks/force/false_alarms.py [--hours 100] [--arms ur5e fr3] [--seed 0]

The tip moves evenly at the speed of the approach and meets nothing; readings are white noise of 0.1 N. Counted are the
contacts that the law begins, by the kind of evidence, and those in which it believes in a surface: K_u falls below half
of the cap, and the tip would leave the speed of the approach.
"""

from __future__ import annotations

import argparse

import numpy as np
from rich.progress import track
from touches import Rig

from palpate._jit import kernel, law
from palpate.force.contact_evidence import FREE_MOTION

PART = 10
"""Length of an approach [s]."""
FORCE, NOISE = 20.0, 0.1


@law
def alarms(control, noise, every, counts):
    """Contacts begun by an edge, by a line, and those with K_u below half of the cap."""
    state, due, reading, k, before, believed = control.start(), 0.0, 0.0, 0, FREE_MOTION, 0.0
    for tick in range(int(len(noise) * every) - 1):
        if tick >= due:
            reading, due, k = noise[k], due + every, k + 1
        _, state = control.step(state, FORCE, reading, control.approach * control.tick * tick)
        phase = state.stage.phase
        if before == FREE_MOTION and phase != FREE_MOTION:
            counts[int(state.estimate.shown)] += 1.0
            believed = 0.0
        if phase != FREE_MOTION and believed == 0.0 and state.bound.used < 0.5 * control.cap:
            counts[2] += 1.0
            believed = 1.0
        before = phase
    return counts


count = kernel(alarms)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--hours", type=int, default=100)
    parser.add_argument("--arms", nargs="+", default=["ur5e", "fr3"])
    parser.add_argument("--seed", type=int, default=0)
    told = parser.parse_args()
    for name in told.arms:
        rig, counts = Rig(name), np.zeros(3)
        sensor, control = rig.arm.sensor, rig.gains(FORCE, NOISE).cautious()
        rng, every = np.random.default_rng(told.seed), max(rig.arm.rate / sensor.sampling, 1.0)
        for _ in track(range(told.hours * 3600 // PART), name, transient=True):
            readings = NOISE * rng.standard_normal(round(PART * rig.arm.rate / every))
            count(control, readings, every, counts)
        edge, line, believed = (int(n) for n in counts)
        print(
            f"{rig.arm.title}: in {told.hours} h of air {edge} contacts by an edge, {line} by a line; "
            f"in {believed} of them K_u fell below half of the cap"
        )


if __name__ == "__main__":
    main()
