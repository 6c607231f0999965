"""Slides along surfaces that nobody has measured: how well the force is held, and whether the intervals hold.

    python benchmarks/force/sliding.py PART [--slides 300] [--arms ur5e fr3 iiwa14] [--seed 100]

For `slides`, `servo-ur5e` and `servo-iiwa14` are those of benchmarks/arms/servo_world.py.

The box: K 1 to 60 kN/m and speed 5 to 100 mm/s (even in the logarithm), mu 0 to 0.8, radius 60 to 500 mm, 8 to 30 N,
noise 0.05 to 0.2 N, on spheres, bowls, cylinders, saddles, waves and egg boxes, along circles, there and back, 4 s
each. The given normal is off by up to 22 degrees (`far`), or by 3 degrees (standard deviation, `near`); with
`touches` it is as far off, and three touches 10 mm apart measure it first. `obeys`: after
0.5 s the true normal force is within 3 % rms and 10 %, contact kept. `domain`: the slides that the closed form of
palpate tune admits.
`dither`: stiffness along the path. `faults`: steps of 1 mm over 2 mm, up or down, with and without
`step` in the gains, and no faster than the speed that `palpate tune --slide` prints for a step on the cap (here for K);
friction that is 1.5 times as high at rest, and friction above mu_max, from the near start.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np
from msgspec.structs import replace

from palpate.force.arm import load_arm
from palpate.force.gains import gains_for
from palpate.force.slide_table import Slide
from palpate.force.sliding.paths import directions
from palpate.force.sliding.slide_domain import edge_speed, obeys, slide_terms
from palpate.slide.dither import dither_frequency, stiffness_along
from palpate.slide.ground import ground_of
from palpate.slide.world import figures_of, simulate

SECONDS = 4.0
FAR, NEAR = np.radians(22.0), np.radians(3.0)
SLOWLY = "the same, not expected, no faster than the speed printed for it"
STEPS = {"a step of 1 mm": 0.0, "the same, expected (`--step 1:mm`)": 1e-3, SLOWLY: 0.0}
AT_REST, ABOVE = "friction at rest 1.5 times that above 10 mm/s", "friction of 0.95 to 1.2, above mu_max"
SHIPPED = {"ur5e": "UR5e", "fr3": "FR3", "iiwa14": "iiwa 14"}
TITLES = SHIPPED | {"servo-ur5e": "UR5e, servos", "servo-iiwa14": "iiwa 14, servos"}
STARTS = {"touches": "far, three touches", "far": "far", "near": "near"}


def even(rng, low, high):
    """Even in the logarithm."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def drawn(arm, rng, start, fault=None):
    """Gains, surface, directions, direction into the surface and seed of one slide of an arm."""
    K, speed, mu, R = even(rng, 1e3, 6e4), even(rng, 5e-3, 0.1), rng.uniform(0.0, 0.8), even(rng, 0.06, 0.5)
    force, noise = rng.uniform(8.0, 30.0), rng.uniform(0.05, 0.2)
    known = replace(arm, sensor=replace(arm.sensor, noise=noise))
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
        speed = min(speed, edge_speed(gains, K)) if fault == SLOWLY else speed
        gains = replace(gains, slide=replace(gains.slide, speed=speed, step=STEPS[fault]))
        more = {"height": rng.choice([-1e-3, 1e-3]), "period": 0.8 * speed}
        shape, heading, path = "step", 0.0, "line"
    elif fault == ABOVE:
        mu = rng.uniform(0.95, 1.2)
    elif fault is not None:
        more = {"sticking": 1.5 * mu, "creep": 0.01}
    ground = ground_of(shape, R, K, friction=mu, **({"period": 2.2 * R} | more))
    ways = directions(path, SECONDS, known.rate, speed, extent, heading)
    azimuth = rng.uniform(0.0, 2.0 * np.pi)
    into = [np.sin(tilt) * np.cos(azimuth), np.sin(tilt) * np.sin(azimuth), -np.cos(tilt)]
    return gains, ground, ways, into, int(rng.integers(1 << 30)), slide_terms(gains, K, mu, R)


def in_markdown(head, rows):
    """A table."""
    lines = [head, ["---"] * len(head), *rows]
    print("\n".join(f"| {' | '.join(line)} |" for line in lines), flush=True)


def numbers_of(found, inside=None):
    """Cells of one row."""
    touched = [f for f in found if f.touched]
    of = lambda key: np.array([getattr(f, key) for f in touched], dtype=float)  # noqa: E731
    cells = [
        share([f.obeys for f in found]), f"{100 * np.median(of('rms')):.2f} %",
        f"{of('worst').max():.2f} F ({np.percentile(of('worst'), 99):.2f})", f"{int(of('lost').sum())}",
        f"{np.degrees(np.median(of('normal'))):.2f} deg",
        ", ".join(f"{100 * np.mean(of(key)):.1f}" for key in ("cone", "friction", "stiffness")) + " %",
    ]  # fmt: skip
    if inside is None:
        return cells
    return [*cells, share(inside), share([f.obeys for f, i in zip(found, inside, strict=True) if i])]


def share(values):
    """A percentage."""
    return f"{100 * np.mean(values):.3g} %" if len(values) else "-"


HEAD = [
    "", "slides", "obeys", "rms, median", "worst force (p99)", "lost", "normal, median", "cone, mu, K hold", "domain",
    "obeys in it",
]  # fmt: skip


def arm_named(name):
    """A shipped arm, or one of benchmarks/arms/servo_world.py."""
    if not name.startswith("servo-"):
        return load_arm(name)
    sys.path.append(str(Path(__file__).parents[1] / "arms"))
    from servo_world import arm_of

    return arm_of(name.removeprefix("servo-"))


def slides(args):
    """The law alone, in the simulation's own physics."""
    rows = []
    for arm in args.arms:
        for start in ("touches", "far", "near"):
            rng, found, inside = np.random.default_rng(args.seed), [], []
            for _ in range(args.slides):
                gains, ground, ways, into, seed, terms = drawn(arm_named(arm), rng, start)
                found.append(figures_of(simulate(gains, ground, ways, into=into, seed=seed), gains, ground))
                inside.append(obeys(terms))
            rows.append([f"{TITLES[arm]}, {STARTS[start]}", f"{len(found)}", *numbers_of(found, inside)])
    in_markdown(HEAD, rows)


def dither(args):
    """Stiffness along the path of slides at 5 to 15 mm/s for 10 s, the force dithered by a tenth."""
    rows = []
    for arm in args.arms:
        rng, error, half, held = np.random.default_rng(args.seed + 2), [], [], []
        for _ in range(args.slides):
            gains, ground, _, into, seed, _ = drawn(load_arm(arm), rng, "touches")
            speed, grade, frequency = even(rng, 5e-3, 15e-3), rng.uniform(-5.0, 5.0), dither_frequency(gains)
            gains, ground = (
                replace(gains, slide=replace(gains.slide, speed=speed)),
                ground._replace(grade=grade),
            )
            ways = directions("circle", 10.0, gains.arm.rate, speed, 0.02)
            out = simulate(gains, ground, ways, into=into, seed=seed, dither=(0.1, frequency))
            found = stiffness_along(out, gains.arm, frequency)
            truth = ground.stiffness * (1.0 + grade * found.places[:, 0])
            error += list(np.abs(found.stiffness / truth - 1.0))
            half += list(found.half / truth)
            held.append(figures_of(out, gains, ground).obeys)
        inside = share(np.array(error) < half)
        cells = [f"{100 * np.median(error):.2g} %", f"{100 * np.median(half):.2g} %", inside, share(held)]
        rows.append([TITLES[arm], f"{len(error)}", *cells])
    in_markdown(
        ["", "places", "error, median", "half-width, median", "interval holds", "slides that obey"], rows
    )


def faults(args):
    """Steps, friction at rest, and friction above its bound."""
    rows = []
    for fault in (*STEPS, AT_REST, ABOVE):
        for arm in args.arms:
            rng, found = np.random.default_rng(args.seed + 1), []
            for _ in range(args.slides):
                gains, ground, ways, into, seed, _ = drawn(load_arm(arm), rng, "near", fault)
                found.append(figures_of(simulate(gains, ground, ways, into=into, seed=seed), gains, ground))
            cells, off = numbers_of(found), [f.said for f in found if f.most > 0.1]
            rows.append(
                [f"{TITLES[arm]}, {fault}", f"{len(found)}", cells[0], cells[2], cells[3], share(off)]
            )
    in_markdown(["", "slides", "obeys", "worst force (p99)", "lost", "said, where beyond 10 %"], rows)


PARTS = {part.__name__: part for part in (slides, dither, faults)}


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("part", choices=PARTS)
    parser.add_argument("--slides", type=int, default=300, help="of each row")
    parser.add_argument("--arms", nargs="+", default=list(SHIPPED), choices=TITLES)
    parser.add_argument("--seed", type=int, default=100)
    args = parser.parse_args()
    PARTS[args.part](args)


if __name__ == "__main__":
    main()
