"""How far a command goes without the force coming nearer, on first touches where nothing is wrong.

    python benchmarks/force/in_vain.py [--touches 300] [--arms ur5e fr3] [--seed 0]

`ForceLoop` calls it trouble where that is `FARTHEST` times the way to F_d on the surface as it is known. Readings and
positions of first touches are given to it tick by tick; printed are the largest of them, and how many were troubled.
"""

from __future__ import annotations

import argparse

import numpy as np
from rich.progress import track
from touches import Rig

from palpate.force import ForceLoop
from palpate.force.guard import FARTHEST, STATE
from palpate.force.simulated_press import ENCODER

SECONDS = 2.0
_VAIN = STATE + 3


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--touches", type=int, default=300)
    parser.add_argument("--arms", nargs="+", default=["ur5e", "fr3"])
    parser.add_argument("--seed", type=int, default=0)
    told = parser.parse_args()
    for name in told.arms:
        rig, found, troubled = Rig(name), [], 0
        for i in track(range(told.touches), name, transient=True):
            draw = rig.draw(np.random.default_rng([told.seed, i]))
            gains = rig.gains(draw.F, draw.noise)
            rows = rig.run(draw, gains.cautious(), [told.seed, i, 1], SECONDS, approach=gains.approach)
            loop, most, trouble = ForceLoop(gains), 0.0, False
            for position, force in zip(ENCODER * np.round(rows[:, 2] / ENCODER), rows[:, 4], strict=True):
                loop.update(float(force), float(position))
                most = max(most, loop.state[_VAIN] / draw.F)
                trouble = trouble or "cannot be reached" in loop.trouble
            found.append(most)
            troubled += trouble
        p99, top = np.percentile(found, 99), max(found)
        print(
            f"{rig.arm.title}: p99 {p99:.2f}, most {top:.2f} of {FARTHEST:g} ways; "
            f"troubled {troubled} of {told.touches}"
        )


if __name__ == "__main__":
    main()
