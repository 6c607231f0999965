"""The same first touches under every law: share unsettled, p99 of settling, overshoot, contacts lost, an hour's error.

    python benchmarks/force/leaderboard.py [--touches 300] [--arms ur5e fr3] [--seed 0]
        [--minutes 3.5] [--runs runs/leaderboard.jsonl]

Every run is kept as it ends: the same command goes on where it stopped, and shows the laws that have all of theirs.
Noise up to 0.6 N. All with the same lag, limits, noise and approach; by tails, not by medians. An hour is 3600 s of a
press with 20 N on 7 kN/m; its error counts from the tenth second on.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np
from touches import Draw, Key, Rig, resumed

from palpate_benchmark.rivals import rivals

SECONDS = 6.0
OVER = 0.1
HEAD = "| law | failed | unsettled | settling p99 [s] | overshoot p99 | most | contacts lost | error in {seconds:g} s |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--touches", type=int, default=300)
    parser.add_argument("--arms", nargs="+", default=["ur5e", "fr3"])
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--seconds", type=float, default=3600.0)
    parser.add_argument("--minutes", type=float, default=float("inf"))
    parser.add_argument("--runs", type=Path, default=Path("runs/leaderboard.jsonl"))
    told = parser.parse_args()
    until = time.monotonic() + 60.0 * told.minutes
    told.left = lambda: (until - time.monotonic()) / 60.0
    for name in told.arms:
        print("", f"## {Rig(name).arm.title}", "", *table(name, told), sep="\n", flush=True)


def table(name: str, told: argparse.Namespace) -> list[str]:
    """Rows of an arm, the law that fails least first."""
    rig = Rig(name)
    laws = list(rivals(rig.gains(20.0, 0.2), np.random.default_rng(told.seed)))
    hours = resumed(
        told.runs, [(f"{name}, {law}, {told.seconds:g} s", told.seed, 9) for law in laws],
        lambda key: hour(rig, key[0].split(", ", 1)[1].rsplit(", ", 1)[0], told), told.left(),
    )  # fmt: skip
    rows = []
    for law in laws:
        keys = [(f"{name}, {law}", told.seed, i) for i in range(told.touches)]
        found = resumed(told.runs, keys, lambda key: touched(rig, key[0].split(", ", 1)[1], key), told.left())
        error = [row["error"] for key, row in hours.items() if key[0].startswith(f"{name}, {law}, ")]
        if len(found) < told.touches or not error:
            continue
        settling, over, lost = (
            np.array([row[key] for row in found.values()]) for key in ("settling", "overshoot", "lost")
        )
        unsettled = np.isnan(settling).mean()
        late = np.quantile(np.nan_to_num(settling, nan=np.inf), 0.99, method="higher")
        failed = (np.isnan(settling) | (over > OVER) | (lost > 0)).mean()
        shares = (float(np.quantile(over, 0.99)), over.max(), (lost > 0).mean())
        rows.append((failed, unsettled, shares, law, late, error[0]))
    rows.sort()
    return [HEAD.format(seconds=told.seconds), "|---|---|---|---|---|---|---|---|", *map(row_of, rows)]


def row_of(row: tuple) -> str:
    failed, unsettled, shares, law, late, error = row
    told_late = f"{late:.2f}" if np.isfinite(late) else "never"
    first = f"| {law} | {100 * failed:.1f} % | {100 * unsettled:.1f} % | {told_late} |"
    return f"{first} {' | '.join(f'{100.0 * v:.1f} %' for v in shares)} | {error:.2f} N |"


def touched(rig: Rig, law: str, key: Key) -> dict[str, float]:
    """A first touch under one law."""
    _, seed, i = key
    draw = rig.draw(np.random.default_rng([seed, i]), noise=(0.05, 0.6))
    draw = Draw(draw.K, draw.B, max(draw.F, 9.0 * draw.noise), draw.noise, draw.phase, draw.zeta)
    gains = rig.gains(draw.F, draw.noise)
    control = rivals(gains, np.random.default_rng(seed))[law]
    judged = rig.judge(draw, rig.run(draw, control, [seed, i, 1], SECONDS, approach=gains.approach))
    return {"settling": judged.settling, "overshoot": judged.overshoot, "lost": judged.lost}


def hour(rig: Rig, law: str, told: argparse.Namespace) -> dict[str, float]:
    """Largest error, the mean of a tick, from the tenth second on [N]."""
    gains = rig.gains(20.0, 0.2)
    draw = Draw(7e3, 2.0 * 0.1 * np.sqrt(7e3), 20.0, 0.2, 0.0, 0.1)
    control = rivals(gains, np.random.default_rng(told.seed))[law]
    rows = rig.run(draw, control, [told.seed, 9], told.seconds, approach=gains.approach)
    return {"error": float(np.abs(rows[round(10.0 * rig.arm.rate) :, 0] - 20.0).max())}


if __name__ == "__main__":
    main()
