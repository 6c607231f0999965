"""Beyond what the gains were told: does a press settle, or stop and say why, within three bounces and a second.

    python benchmarks/force/beyond.py [--touches 50] [--arms ur5e fr3] [--seed 0]

A cap too low by 2 to 50, an arm whose lag is twice or half that of its file, a surface that stiffens tenfold under the
tip, a quiet sensor (0.01 N) that reads in steps which its file states, a surface with a mass. The surface has 300
N/m to 100 kN/m (even in its logarithm), 20 N are desired, noise is 0.1 N. `hammers`: contact is lost more than three
times, or later than a second after the first touch, and the press does not stop; a mass swings off the tip by itself.
`silently`: such a press, or one that neither settles nor stops, of which the loop says nothing. `faster again`: an
approach after a lost contact faster than the first.
"""

from __future__ import annotations

import argparse

import msgspec
import numpy as np

from palpate.force.arm import load_arm
from palpate.force.force_loop import ForceLoop
from palpate.force.gains import gains_for
from palpate.force.guard import BEYOND, BOUNCED, SWINGS, TROUBLES, UNREACHED, Guarded
from palpate.force.simulated_press import pressed, surface, world_of

FORCE, SECONDS, NOISE = 20.0, 4.0, 0.1
CASES = {
    "as told": {},
    "cap 2 times too low": {"cap": 2.0},
    "cap 5 times too low": {"cap": 5.0},
    "cap 20 times too low": {"cap": 20.0},
    "cap 50 times too low": {"cap": 50.0},
    "lag twice the arm's": {"theta": 2.0},
    "lag half the arm's": {"theta": 0.5},
    "cap 10 times too low, lag half": {"cap": 10.0, "theta": 0.5},
    "stiffens tenfold": {"stiffens": 10.0},
    "reads in steps of 0.1 N": {"resolution": 0.1},
    "reads in steps of 0.5 N": {"resolution": 0.5},
    "reads in steps of 1 N": {"resolution": 1.0},
    "reads in steps of 2 N": {"resolution": 2.0},
    **{f"a mass of {mass:g} kg": {"mass": mass} for mass in (0.03, 0.1, 0.3, 1.0, 3.0)},
}


def press(arm, case, rng):
    """Rows of a press, its arm's approach and rate."""
    K = float(np.exp(rng.uniform(np.log(300.0), np.log(1e5))))
    mass = arm.inner.mass if arm.kind == "torque" else 1.0
    B = 2.0 * np.exp(rng.uniform(np.log(0.01), np.log(0.3))) * np.sqrt(K * mass)
    step = case.get("resolution", 0.0)
    if step:
        noise = max(0.3 * step, 0.01)  # a step has a standard deviation of 0.29 of itself
        arm = msgspec.structs.replace(
            arm, sensor=msgspec.structs.replace(arm.sensor, noise=noise, resolution=step)
        )
    told = gains_for(arm, FORCE, cap=1e5)
    cap = K / case["cap"] if "cap" in case else 1e5
    gains = gains_for(arm, FORCE, cap=cap, theta=told.theta * case.get("theta", 1.0))
    world = world_of(
        arm,
        noise=0.01 if step else NOISE,
        resolution=step,
        phase=float(rng.uniform(0.0, 1.0 / arm.sensor.sampling)),
    )
    n = round(SECONDS * arm.rate)
    later = K * case.get("stiffens", 1.0)
    change = (
        {"later": later, "change": float(rng.uniform(0.5, 2.0)), "depth": FORCE / K} if later != K else {}
    )
    touched = surface(K, B, mass=case.get("mass", 0.0), **change)
    rows = pressed(
        world,
        touched,
        Guarded(gains.cautious()),
        0.05 * gains.approach,
        np.full(n, FORCE),
        int(rng.integers(1 << 30)),
    )
    return rows, gains


def judge(rows, gains):
    """Settled, overshoot, losses of contact, hammers, and whether an approach was faster than the first."""
    force, speed, rate = rows[:, 0], rows[:, 3], gains.arm.rate
    start = int(np.argmax(force > 0.0))
    lost = np.flatnonzero((force[start:-1] > 0.0) & (force[start + 1 :] <= 0.0)) + start
    ends = np.abs(force[-round(0.3 * rate) :] - FORCE).max() < 0.05 * FORCE
    stopped = (np.abs(speed[-round(0.2 * rate) :]) < 1e-9).all()
    late = bool(len(lost)) and (lost[-1] - start) / rate > 1.0
    again = force[lost[0] :] <= 0.0 if len(lost) else np.zeros(0, bool)
    faster = bool(len(lost)) and (speed[lost[0] :][again] > 1.0001 * gains.approach).any()
    hammers = (len(lost) > 3 or late) and not stopped
    silently = (hammers or not (ends or stopped)) and not said(rows, gains)
    return ends, force.max() / FORCE - 1.0, len(lost), hammers, silently, faster, stopped


def said(rows, gains):
    """Whether the loop names a trouble with the surface or with the contact."""
    loop = ForceLoop(gains)
    troubles = {TROUBLES[code] for code in (BOUNCED, BEYOND, SWINGS, UNREACHED)}
    places = np.concatenate([rows[:1, 2], rows[:-1, 2]])
    for force, place in zip(rows[:, 4].tolist(), places.tolist(), strict=True):
        loop.update(force, place)
        if loop.trouble in troubles:
            return True
    return False


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--touches", type=int, default=50)
    parser.add_argument("--arms", nargs="+", default=["ur5e", "fr3"])
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    for name in options.arms:
        arm = load_arm(name)
        arm = msgspec.structs.replace(arm, sensor=msgspec.structs.replace(arm.sensor, noise=NOISE))
        print(f"\n{arm.title}, seed {options.seed}")
        print(
            f"{'':32}settled  stopped  neither  hammers  silently  faster again  lost: most  over: p50    most"
        )
        for title, case in CASES.items():
            rows = [
                judge(*press(arm, case, np.random.default_rng([options.seed, i])))
                for i in range(options.touches)
            ]
            ends, over, lost, hammers, silently, faster, stopped = map(np.array, zip(*rows, strict=True))
            print(
                f"{title:32}{ends.sum():7}  {(stopped & ~ends).sum():7}  {(~ends & ~stopped).sum():7}"
                f"  {hammers.sum():7}  {silently.sum():8}  {faster.sum():12}  {lost.max():10}"
                f"  {100 * np.median(over):8.0f} %  {100 * over.max():6.0f} %",
                flush=True,
            )


if __name__ == "__main__":
    main()
