"""The bound of the first peak at a touch, and the worst of what a wandering gain came to, by superposition.

    python benchmarks/force/peak.py [--runs 3000] [--arm ur5e] [--seed 0]

The share of the gain switches at random times between nothing and all, and the approach has any speed that it may.
"""

from __future__ import annotations

import argparse

import numpy as np
from rich.progress import track
from touches import Rig, share

from palpate.force.peak import answers, peak_bound
from palpate.force.sampled_loop import SampledLoop

SHARES = (1.0, 1.5, 2.0)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=3000)
    parser.add_argument("--arm", default="ur5e")
    parser.add_argument("--seed", type=int, default=0)
    told = parser.parse_args()
    gains = Rig(told.arm).gains(20.0, 0.1)
    for most in SHARES:
        bound = peak_bound(gains, most)
        if bound is None:
            print(f"{gains.arm.title}: no bound for a torque arm")
            return
        worst = simulated(gains, most, told)
        print(
            f"K_u at least K/{most:g}: bound {share(bound / gains.force - 1.0)}, simulated worst {share(worst - 1.0)}"
        )


def simulated(gains, most: float, told: argparse.Namespace) -> float:
    """Largest force over F_d, of the first peak: the gain is nothing once the reading has reached F_d."""
    loop, n = SampledLoop(gains.arm, 0, gains.seen_cap), round(6.0 * gains.theta * gains.arm.rate)
    answer, arriving, lead = answers(loop, gains.seen_cap, n)
    step, rng, worst = (
        most * gains.alpha * gains.arm.tick / gains.theta,
        np.random.default_rng(told.seed),
        1.0,
    )
    for _ in track(range(told.runs), f"K_u at least K/{most:g}", transient=True):
        at, speed = np.sort(rng.integers(0, n, 4)), rng.uniform(0.0, step)
        of = ((np.searchsorted(at, np.arange(n), side="right") + rng.integers(2)) % 2).astype(float)
        moved = np.zeros(n)
        for k in range(n):
            read = answer[: k + 1][::-1] @ moved[: k + 1] + speed * arriving[k]
            moved[k] = max(of[k] * step * (1.0 - read), 0.0)
        worst = max(worst, float(moved.sum() + speed * lead))
    return worst


if __name__ == "__main__":
    main()
