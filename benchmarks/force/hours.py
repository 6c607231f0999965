"""Presses of one hour on unknown surfaces: does anything grow? Every run is kept as it ends, and none is run twice.

    python benchmarks/force/hours.py [--runs 50] [--arms ur5e fr3] [--minutes 3.5] [--out runs/hours.jsonl]

Growing: the rms error of the last ten minutes above 1.2 times that of ten minutes from the tenth second on. The same
command goes on where it stopped, and prints what there is of all runs so far.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path

import numpy as np
from rich.progress import track
from touches import Rig, share

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
    told.out.parent.mkdir(parents=True, exist_ok=True)
    known = read(told.out)
    waiting = [(name, i) for i in range(told.runs) for name in told.arms if (name, i) not in known]
    started = time.monotonic()
    for name, i in track(waiting, "hours", transient=True):
        if time.monotonic() - started > 60.0 * told.minutes:
            break
        found = one_hour(Rig(name), i)
        with told.out.open("a", encoding="utf-8") as file:
            file.write(json.dumps({"arm": name, "run": i, **found}) + "\n")
    tell(read(told.out), told.arms)


def read(path: Path) -> dict[tuple[str, int], dict[str, float]]:
    """Runs that are done, by arm and number."""
    lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
    rows = [json.loads(line) for line in lines if line.endswith("}")]
    return {(row["arm"], row["run"]): row for row in rows}


def one_hour(rig: Rig, i: int) -> dict[str, float]:
    """rms at the end over that at the beginning, the largest error over F_d, ticks without contact."""
    draw = rig.draw(np.random.default_rng([0, 5, i]))
    gains = rig.gains(draw.F, draw.noise)
    force = rig.run(draw, gains.cautious(), [0, 6, i], HOUR, approach=gains.approach)[:, 0]
    error, first, ten = force - draw.F, round(FROM * rig.arm.rate), round(TEN * rig.arm.rate)
    before, after = error[first : first + ten], error[-ten:]
    return {
        "K": draw.K,
        "ratio": float(np.sqrt(np.mean(after**2) / np.mean(before**2))),
        "largest": float(np.abs(error[first:]).max() / draw.F),
        "lost": int((force[first:] <= 0.0).sum()),
    }


def tell(known: dict[tuple[str, int], dict[str, float]], arms: list[str]) -> None:
    for name in arms:
        rows = [row for (arm, _), row in known.items() if arm == name]
        if not rows:
            continue
        growing = sum(row["ratio"] > GROWING for row in rows)
        worst, largest = max(row["ratio"] for row in rows), max(row["largest"] for row in rows)
        lost = sum(row["lost"] > 0 for row in rows)
        print(
            f"{name}: {growing} of {len(rows)} hours grow; largest ratio {worst:.3f}, largest error {share(largest)}, "
            f"contact lost in {lost}"
        )


if __name__ == "__main__":
    main()
