"""Slides along surfaces that nobody has measured: how well the force is held, and whether the intervals hold.

    python benchmarks/force/sliding.py [--slides 300] [--rivals 60] [--faults 60] [--arms ur5e fr3 iiwa14] [--seed 100]

The box: K 1 to 60 kN/m and speed 5 to 100 mm/s (even in the logarithm), mu 0 to 0.8, radius 60 to 500 mm, 8 to 30 N,
noise 0.05 to 0.2 N, on spheres, bowls, cylinders, saddles, waves and egg boxes, along circles, there and back, 4 s
each. The given normal is off by up to 22 degrees (`far`), or by 3 degrees (standard deviation, `near`); with
`touches` it is as far off, and three touches 10 mm apart measure it first. `obeys`: after
0.5 s the true normal force is within 3 % rms and 10 %, contact kept. `domain`: the slides that the closed form of
palpate tune admits. Rivals begin where the force is first held, with the same K_u. Steps of 1 mm up or down, with
and without `step` in the gains, and friction that is 1.5 times as high at rest (below 10 mm/s), are counted apart.
"""

from __future__ import annotations

import argparse

import numpy as np
from msgspec.structs import replace

from palpate.force.arm import load_arm
from palpate.force.gains import gains_for
from palpate.force.slide_table import Slide
from palpate.force.sliding.ground import ground_of
from palpate.force.sliding.slide_domain import obeys, slide_terms
from palpate.force.sliding.slide_world import LAWS, directions, figures_of, simulate

SECONDS = 4.0
FAR, NEAR = np.radians(22.0), np.radians(3.0)
STEPS = {"step": 0.0, "step, expected": 1e-3}
RIVALS = [name for name in LAWS if name != "sliding"]


def even(rng, low, high):
    """Even in the logarithm."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def drawn(arm, rng, start, fault=None):
    """Gains, surface, directions, direction into the surface and seed of one slide."""
    K, speed, mu, R = even(rng, 1e3, 6e4), even(rng, 5e-3, 0.1), rng.uniform(0.0, 0.8), even(rng, 0.06, 0.5)
    force, noise = rng.uniform(8.0, 30.0), rng.uniform(0.05, 0.2)
    known = replace(load_arm(arm), sensor=replace(load_arm(arm).sensor, noise=noise))
    tilt = NEAR * abs(rng.standard_normal()) if start == "near" else rng.uniform(0.0, FAR)
    gains = replace(
        gains_for(known, force, cap=2.0 * K),
        slide=Slide(
            speed=speed,
            mu_max=0.9,
            slope=0.04 if start == "near" else 0.12,
            radius=R,
            touches=0.01 if start == "touches" else 0.0,
        ),
    )  # fmt: skip
    shape, more = str(rng.choice(["sphere", "bowl", "cylinder", "saddle", "waves", "eggs"])), {}
    path, heading = str(rng.choice(["line", "back", "circle"])), rng.uniform(0.0, 2.0 * np.pi)
    extent = 0.35 * R if path == "circle" else 0.7 * R if path == "line" else 0.18 * R
    if path == "line":  # and back where a longer one would leave the surface
        path = "back"
    if fault in STEPS:
        gains = replace(gains, slide=replace(gains.slide, step=STEPS[fault]))
        more = {"height": rng.choice([-1e-3, 1e-3]), "period": 0.8 * speed}
        shape, heading, path = "step", 0.0, "line"
    if fault == "stick-slip":
        more = {"sticking": 1.5 * mu, "creep": 0.01}
    ground = ground_of(shape, R, K, friction=mu, **({"period": 2.2 * R} | more))
    ways = directions(path, SECONDS, known.rate, speed, extent, heading)
    azimuth = rng.uniform(0.0, 2.0 * np.pi)
    into = [np.sin(tilt) * np.cos(azimuth), np.sin(tilt) * np.sin(azimuth), -np.cos(tilt)]
    return gains, ground, ways, into, int(rng.integers(1 << 30)), slide_terms(gains, K, mu, R)


def told(name, found, inside=None):
    """One row of the table."""
    touched = [f for f in found if f.touched]
    of = lambda key: np.array([getattr(f, key) for f in touched], dtype=float)  # noqa: E731
    share = lambda values: f"{100 * np.mean(values):5.1f}" if len(values) else "    -"  # noqa: E731
    rows = [
        f"{name:24}{len(found):5}", share([f.obeys for f in found]), f"{100 * np.median(of('rms')):6.2f}",
        f"{of('worst').max():6.2f} ({np.percentile(of('worst'), 99):.2f})", f"{int(of('lost').sum()):4}",
        f"{np.degrees(np.median(of('normal'))):5.2f}", *(share(of(key)) for key in ("cone", "friction", "stiffness")),
    ]  # fmt: skip
    if inside is not None:
        rows += [share(inside), share([f.obeys for f, i in zip(found, inside, strict=True) if i])]
    print("  ".join(rows), flush=True)


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--slides", type=int, default=300)
    parser.add_argument("--rivals", type=int, default=60)
    parser.add_argument("--faults", type=int, default=60)
    parser.add_argument("--arms", nargs="+", default=["ur5e", "fr3", "iiwa14"])
    parser.add_argument("--seed", type=int, default=100)
    args = parser.parse_args()
    print(
        "arm, start, n, obeys %, rms %, worst (p99), lost, normal deg, cone %, mu %, K %, domain %, in it %"
    )
    for arm in args.arms:
        for start in ("touches", "far", "near"):
            rng, found, inside, others = (
                np.random.default_rng(args.seed),
                [],
                [],
                {name: [] for name in RIVALS},
            )
            for k in range(args.slides):
                gains, ground, ways, into, seed, terms = drawn(arm, rng, start)
                found.append(figures_of(simulate(gains, ground, ways, into=into, seed=seed), gains, ground))
                inside.append(obeys(terms))
                if k < args.rivals:
                    for name, list_ in others.items():
                        rows = simulate(gains, ground, ways, into=into, seed=seed, rival=name)
                        list_.append(figures_of(rows, gains, ground))
            told(f"{arm}, {start}", found, inside)
            for name, list_ in others.items():
                told(f"  {name}", list_)
                better = [
                    f.rms < other.rms or not other.touched for f, other in zip(found, list_, strict=False)
                ]
                print(f"    sliding has the lower rms in {100 * np.mean(better):.1f} %")
        for fault in (*STEPS, "stick-slip"):
            rng, found = np.random.default_rng(args.seed + 1), []
            for _ in range(args.faults):
                gains, ground, ways, into, seed, _ = drawn(arm, rng, "near", fault)
                found.append(figures_of(simulate(gains, ground, ways, into=into, seed=seed), gains, ground))
            told(f"{arm}, {fault}", found)
            off = [f.said for f in found if f.most > 0.1]
            print(f"    beyond 10 % in {len(off)}, of which said in {100 * np.mean(off or [np.nan]):.1f} %")


if __name__ == "__main__":
    main()
