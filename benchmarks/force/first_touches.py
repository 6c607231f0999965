"""First touches from the air on unknown surfaces, no retuning: how many settle, how fast, how far over.

    python benchmarks/force/first_touches.py [--touches 10000] [--arms ur5e fr3] [--noise 0.05 0.2] [--seed 0]

Stiffness 1e2 ... 1e6 N/m and damping ratio 0.01 ... 1 (of 1 kg, or of the torque arm's tip) even in their logarithms,
force 10 ... 40 N, the sensor's clock at any phase. Settled: the true force within 5 % of F_d for good, within 4 s of
the start of the run; timed from the first touch.
"""

from __future__ import annotations

import argparse

import numpy as np
from rich.progress import track
from touches import Rig, share

from palpate.force.expected import OVERSHOOT, RISES, rise, settling_bound, softest

KNOWN = 3.5
"""Rises before which no law tells a touch from noise.

The ramp's energy is then 3.5^3/3 = 14 variances, 2 ln 1000: one false alarm in a thousand looks.
"""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--touches", type=int, default=10_000)
    parser.add_argument("--arms", nargs="+", default=["ur5e", "fr3"])
    parser.add_argument("--noise", nargs=2, type=float, default=(0.05, 0.2))
    parser.add_argument("--seed", type=int, default=0)
    told = parser.parse_args()
    for name in told.arms:
        report(name, told.touches, tuple(told.noise), told.seed)


def report(name: str, touches: int, noise: tuple[float, float], seed: int) -> None:
    rig, rows, draws = Rig(name), [], []
    for i in track(range(touches), name, transient=True):
        draw = rig.draw(np.random.default_rng([seed, i]), noise=noise)
        gains = rig.gains(draw.F, draw.noise)
        control = gains.cautious()
        judged = rig.judge(draw, rig.run(draw, control, [seed, i, 1], approach=gains.approach))
        rows.append((judged.settling, judged.overshoot, judged.lost, judged.least))
        told = settling_bound(gains, draw.K, draw.B)
        draws.append((rig.travel(draw), draw.B / draw.K, told, softest(gains) <= draw.K, rise(gains, draw.K)))
    (settling, over, lost, least), (travel, damping, told, inside, rises) = (
        np.array(rows).T,
        np.array(draws).T,
    )
    quick = travel + damping < 0.1
    bound = 4.0 * rig.added + travel + 4.0 * damping
    p = np.nanpercentile
    print(
        f"\n{rig.arm.title}: theta {1e3 * rig.theta:.1f} ms, lags added {1e3 * rig.added:.1f} ms, seed {seed}"
    )
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
    print(f"  smallest K_eff(K_u)/K_eff             {np.nanmin(least):.3f}; below 0.5 in {low} of {touches}")


if __name__ == "__main__":
    main()
