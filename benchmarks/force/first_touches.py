"""First touches from the air on unknown surfaces, no retuning: how many settle, how fast, how far over.

    python benchmarks/force/first_touches.py [--touches 10000] [--arms ur5e fr3] [--noise 0.05 0.2] [--seed 0]
        [--minutes 3.5] [--out FOLDER]

Stiffness 1e2 ... 1e6 N/m and damping ratio 0.01 ... 1 (of 1 kg, or of the torque arm's tip) even in their logarithms,
force 10 ... 40 N, the sensor's clock at any phase. Settled: the true force within 5 % of F_d for good, within 4 s of
the start of the run; timed from the first touch. Every touch is kept as it ends: the same command goes on where it
stopped.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import asdict
from functools import partial
from pathlib import Path

import numpy as np
from touches import Key, Rig, resumed, share

from palpate.force.expected import OVERSHOOT, RISES, rise, settling_bound, softest

KNOWN = 3.5
"""Rises before which no law tells a touch from noise."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--touches", type=int, default=10_000)
    parser.add_argument("--arms", nargs="+", default=["ur5e", "fr3"])
    parser.add_argument("--noise", nargs=2, type=float, default=(0.05, 0.2))
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--minutes", type=float, default=float("inf"))
    parser.add_argument("--out", type=Path, default=Path("runs/first_touches"))
    told = parser.parse_args()
    until = time.monotonic() + 60.0 * told.minutes
    for name in told.arms:
        rig = Rig(name)
        keys = [(name, told.seed, i) for i in range(told.touches)]
        noise = "-".join(f"{value:g}" for value in told.noise)
        one = partial(touched, rig, tuple(told.noise))
        left = (until - time.monotonic()) / 60.0
        known = resumed(told.out / f"cautious-{name}-{noise}.jsonl", keys, one, left)
        print(f"\n{rig.arm.title}, the cautious law")
        report(rig, list(known.values()), told.seed)
        report_promises(rig, list(known.values()))


def touched(rig: Rig, noise: tuple[float, float], key: Key) -> dict[str, float]:
    """What a first touch came to, and what is expected of it."""
    _, seed, i = key
    draw = rig.draw(np.random.default_rng([seed, i]), noise=noise)
    gains = rig.gains(draw.F, draw.noise)
    judged = rig.judge(draw, rig.run(draw, gains.cautious(), [seed, i, 1], approach=gains.approach))
    return {
        **asdict(judged),
        "travel": rig.travel(draw),
        "damping": draw.B / draw.K,
        "told": settling_bound(gains, draw.K, draw.B),
        "inside": float(softest(gains) <= draw.K),
        "rises": rise(gains, draw.K),
    }


def columns(rows: list[dict[str, float]], *keys: str) -> list[np.ndarray]:
    """Values of all touches for each key."""
    return [np.array([row[key] for row in rows], dtype=float) for key in keys]


def report(rig: Rig, rows: list[dict[str, float]], seed: int) -> None:
    """Print how many touches settle, and how fast."""
    touches = len(rows)
    settling, travel, damping, rises = columns(rows, "settling", "travel", "damping", "rises")
    quick = travel + damping < 0.1
    bound = 4.0 * rig.added + travel + 4.0 * damping
    p = np.nanpercentile
    print(f"  theta {1e3 * rig.theta:.1f} ms, lags added {1e3 * rig.added:.1f} ms, seed {seed}")
    print(f"  settled                              {np.isfinite(settling).sum()} of {touches}")
    print(
        f"  settling p50, p95, p99               {p(settling, 50):.3f}, {p(settling, 95):.3f}, {p(settling, 99):.3f} s"
    )
    print(f"  where travel + B/K < 0.1 s, p99      {p(settling[quick], 99):.3f} s ({quick.sum()} touches)")
    within = settling <= bound
    print(
        f"  within 4 lags + travel + 4 B/K       {share(within.mean())}; elsewhere {share(within[~quick].mean())}"
    )
    print(
        f"    and the {KNOWN:g} rises in which it is known  {share((settling <= bound + KNOWN * rises)[~quick].mean())}"
    )


def report_promises(rig: Rig, rows: list[dict[str, float]]) -> None:
    """Print whether the times, overshoots and gains keep to what tune and the proof say."""
    touches, p = len(rows), np.nanpercentile
    settling, over, lost, least, damping, told, inside, rises = columns(
        rows, "settling", "overshoot", "lost", "least", "damping", "told", "inside", "rises"
    )
    inside = inside > 0.0
    early, late = settling <= told - RISES * rises, settling <= told
    print(
        f"  within what tune says                {share(late.mean())} of all, {share(early[inside].mean())} of"
    )
    print(f"    {inside.sum()} in its domain; those over 10 % over: {(over[inside] > OVERSHOOT).sum()}")
    print(
        f"  overshoot p50, p99, most             {share(p(over, 50))}, {share(p(over, 99))}, {share(over.max())}"
    )
    print(f"  overshoot above 10 %                 {(over > 0.1).sum()} of {touches}")
    print(f"  contact lost                         {(lost > 0).sum()} of {touches}")
    low = (least < 0.5).sum()
    print(
        f"  smallest K_eff(K_u)/K_eff(K + B/theta) {np.nanmin(least):.3f}; below 0.5 in {low} of {touches},"
    )
    print(f"    {(least[damping <= rig.theta] < 0.5).sum()} of them where B/K is at most theta")


if __name__ == "__main__":
    main()
