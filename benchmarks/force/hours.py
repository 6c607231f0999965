"""Presses of one hour on unknown surfaces: does anything grow? Every run is kept as it ends, and none is run twice.

    python benchmarks/force/hours.py [--runs 50] [--arms ur5e fr3] [--minutes 3.5] [--out runs/hours.jsonl]

Growing: the rms error of the last ten minutes above 1.2 times that of ten minutes from the tenth second on. The same
command goes on where it stopped, and prints what there is of all runs so far.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from touches import Rig, resumed, share

GROWING = 1.2
HOUR, TEN = 3600.0, 600.0
FROM = 10.0
"""Seconds into the run from which it is judged [s]."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=50)
    parser.add_argument("--arms", nargs="+", default=["ur5e", "fr3"])
    parser.add_argument("--minutes", type=float, default=float("inf"))
    parser.add_argument("--out", type=Path, default=Path("runs/hours.jsonl"))
    told = parser.parse_args()
    rigs = {name: Rig(name) for name in told.arms}
    keys = [(name, 0, i) for i in range(told.runs) for name in told.arms]
    known = resumed(told.out, keys, lambda key: one_hour(rigs[key[0]], key[2]), told.minutes)
    for name in told.arms:
        tell(name, [row for (arm, _, _), row in known.items() if arm == name])


def one_hour(rig: Rig, i: int) -> dict[str, float]:
    """rms at the end over that at the beginning, largest error over F_d, ticks without contact, K_u/K at the end."""
    draw = rig.draw(np.random.default_rng([0, 5, i]))
    gains = rig.gains(draw.F, draw.noise)
    rows = rig.run(draw, gains.cautious(), [0, 6, i], HOUR, approach=gains.approach)
    error, first, ten = rows[:, 0] - draw.F, round(FROM * rig.arm.rate), round(TEN * rig.arm.rate)
    before, after = error[first : first + ten], error[-ten:]
    felt = draw.K if rig.arm.kind == "torque" else rig.arm.seen(draw.K)
    return {
        "K": draw.K,
        "ratio": float(np.sqrt(np.mean(after**2) / np.mean(before**2))),
        "largest": float(np.abs(error[first:]).max() / draw.F),
        "lost": int((rows[first:, 0] <= 0.0).sum()),
        "bound": float(rows[-1, 1] / felt),
    }


def tell(name: str, rows: list[dict[str, float]]) -> None:
    if not rows:
        return
    growing = sum(row["ratio"] > GROWING for row in rows)
    worst, largest, bound = (max(row[key] for row in rows) for key in ("ratio", "largest", "bound"))
    lost = sum(row["lost"] > 0 for row in rows)
    print(
        f"{name}: {growing} of {len(rows)} hours grow; largest ratio {worst:.3f}, largest error {share(largest)}, "
        f"largest K_u/K at the end {bound:.1f}, contact lost in {lost}"
    )


if __name__ == "__main__":
    main()
