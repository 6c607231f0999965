"""The thesis' kind of network beside the cautious law, bounded and only while that is locked: where does it help?

    python benchmarks/force/learning.py [--arms ur5e fr3] [--seeds 10] [--rate 0.003] [--bound 0.3]

Three sigmoid neurons of force error and force add a speed of at most `bound` times g F_d; they learn by
back-propagation of the error while the law is locked and the error is above two standard deviations of the noise.
20 N on surfaces that stand still, sway, and are asked for steps. Medians over the seeds from 5 s on, with and without.
"""

from __future__ import annotations

import argparse
from typing import Any, NamedTuple

import numpy as np
from rich.progress import track
from rivals import Network
from touches import Draw, Rig

from palpate._jit import part
from palpate._vector import Vec3
from palpate.force.law import Cautious, gain
from palpate.force.stage import LOCKED

FORCE, NOISE, SECONDS = 20.0, 0.1, 40.0
CASES = {
    "still, 7 kN/m": (7e3, 0.0, 0.5, 0.0),
    "sways 1 mm, 0.5 Hz, 7 kN/m": (7e3, 1e-3, 0.5, 0.0),
    "sways 0.1 mm, 2 Hz, 7 kN/m": (7e3, 1e-4, 2.0, 0.0),
    "sways 0.1 mm, 0.5 Hz, 62 kN/m": (62e3, 1e-4, 0.5, 0.0),
    "steps of 2 N, 7 kN/m": (7e3, 0.0, 0.5, 2.0),
}


@part
class Taught(NamedTuple):
    """The cautious law and a network beside it.

    Args:
        law: the cautious law.
        network: in units of g F_d.
        bound: of what it adds, over g F_d.
        dead: error below which it does not learn [N].
    """

    law: Cautious
    network: Network
    bound: float
    dead: float

    def start(self):
        return self.law.start(), self.network.start()

    def step(self, state, desired, force, position):
        inner, net = state
        speed, inner = self.law.step(inner, desired, force, position)
        if inner.stage.phase != LOCKED:
            return speed, (inner, net)
        error = desired - inner.watch.mean
        taught = desired if abs(error) > self.dead else inner.watch.mean
        push, net = self.network.step(net, taught, inner.watch.mean, position)
        unit = gain(self.law, inner.bound.used) * desired
        return speed + unit * max(min(push, self.bound), -self.bound), (inner, net)

    def stiffness_bound(self, state):
        return state[0].bound.used


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--arms", nargs="+", default=["ur5e", "fr3"])
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--rate", type=float, default=0.003)
    parser.add_argument("--bound", type=float, default=0.3)
    told = parser.parse_args()
    for name in told.arms:
        rig = Rig(name)
        gains = rig.gains(FORCE, NOISE)
        law: Any = gains.cautious()
        print(
            f"\n{rig.arm.title}: learning rate {told.rate:g}, at most {told.bound:g} g F_d; rms error, largest [N]"
        )
        for what, (K, sway, hertz, step) in track(CASES.items(), name, transient=True):
            found = []
            for seed in range(told.seeds):
                rng = np.random.default_rng([seed, 4])
                weights = [Vec3(*(0.3 * rng.standard_normal(3)).tolist()) for _ in range(3)]
                network = Network(1.0 / FORCE, 0.0, told.rate, FORCE, *weights)
                both = (law, Taught(law, network, told.bound, 2.0 * NOISE))
                found.append([one(rig, gains, control, K, sway, hertz, step, seed) for control in both])
            (alone, most), (beside, beyond) = np.median(found, axis=0)
            print(f"  {what:<32} without {alone:.3f}, {most:.2f}; with {beside:.3f}, {beyond:.2f}")


# More than seven arguments: each is a number of the case.
def one(rig, gains, control, K, sway, hertz, step, seed) -> tuple[float, float]:
    n, half = round(SECONDS * rig.arm.rate), round(2.0 * rig.arm.rate)
    wanted = FORCE + step * ((np.arange(n) // half) % 2)
    draw = Draw(K, 0.2 * np.sqrt(K), FORCE, NOISE, 0.0, 0.1)
    rows = rig.run(
        draw,
        control,
        [seed, 3],
        desired=wanted,
        approach=gains.approach,
        sway=sway,
        frequency=2.0 * np.pi * hertz,
    )
    error = (rows[:, 0] - wanted)[round(5.0 * rig.arm.rate) :]
    return float(np.sqrt(np.mean(error**2))), float(np.abs(error).max())


if __name__ == "__main__":
    main()
