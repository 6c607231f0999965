"""Sensors that are wrong in free motion: is the tip ever faster than its approach, and how hard does it touch.

    python benchmarks/force/free_motion.py [--touches 1000] [--arms ur5e fr3 iiwa14] [--seed 0] [--faults NAME ...]
        [--cap 1e5] [--minutes 60] [--out runs/free_motion]

Each press: 10 mm of free motion with the fault, then a surface of 300 N/m to the cap (even in its logarithm) with a
damping ratio of 0.01 to 0.3, 20 N desired. The gains know 0.1 N of noise, and nothing of the fault. `too fast`: ticks
whose commanded speed into the surface is above the approach while the true force is zero. `over`:
largest true force over F_d. `settled`: the true force is within 5 % of F_d, and of the fault's last value, for good.
Every press is kept as it ends: the same command resumes. `servo-ur5e` and `servo-iiwa14` are those of
benchmarks/arms/servo_world.py.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import msgspec
import numpy as np
from touches import Key, resumed

from palpate.force.arm import Arm, load_arm
from palpate.force.gains import gains_for
from palpate.force.guard import Guarded
from palpate.force.simulated_press import pressed, surface, world_of

NOISE, FORCE, GAP, LEFT = 0.1, 20.0, 0.01, 3.0
"""Of a reading [N], F_d [N], free motion [m], time for the press [s]."""


def bias(rng, t):
    return rng.choice([-1.0, 1.0]) * rng.uniform(0.2, 0.6) + 0.0 * t


def drift(rng, t):
    return rng.choice([-1.0, 1.0]) * rng.uniform(0.05, 0.3) * np.maximum(t - rng.uniform(0.0, 0.5), 0.0)


def hum(rng, t):
    return rng.uniform(0.1, 0.3) * np.sin(2.0 * np.pi * rng.uniform(5.0, 60.0) * t + rng.uniform(0.0, 6.3))


def slow_hum(rng, t):
    return rng.uniform(0.1, 0.3) * np.sin(2.0 * np.pi * rng.uniform(0.3, 5.0) * t + rng.uniform(0.0, 6.3))


def cable(rng, t):
    steps = np.sort(rng.uniform(0.0, t[-1], rng.integers(1, 6)))
    sizes = rng.choice([-1.0, 1.0], len(steps)) * rng.uniform(0.1, 1.0, len(steps))
    return (sizes[:, None] * (t >= steps[:, None])).sum(axis=0)


def coloured(rng, t):
    tick, tau = t[1] - t[0], rng.uniform(0.02, 0.5)
    walk = np.zeros(len(t))
    for k in range(1, len(t)):
        walk[k] = walk[k - 1] * (1.0 - tick / tau) + 0.2 * np.sqrt(2.0 * tick / tau) * rng.standard_normal()
    return walk


def spikes(rng, t):
    return np.where(rng.random(len(t)) < 0.002, rng.uniform(-50.0, 50.0, len(t)), 0.0)


def none(rng, t):
    return 0.0 * t


FAULTS: dict[str, tuple[Callable, float]] = {
    "clean": (none, NOISE),
    "bias to 3 % of the force": (bias, NOISE),
    "drift to 0.3 N/s": (drift, NOISE),
    "hum of 0.3 N, 5 to 60 Hz": (hum, NOISE),
    "hum of 0.3 N, 0.3 to 5 Hz": (slow_hum, NOISE),
    "steps of a cable, to 1 N": (cable, NOISE),
    "noise 5 times what was given": (none, 5.0 * NOISE),
    "coloured noise of 0.2 N": (coloured, NOISE),
    "spikes to 50 N": (spikes, NOISE),
}


def servo(name: str) -> Arm:
    """An arm of benchmarks/arms/servo_world.py."""
    sys.path.append(str(Path(__file__).parents[1] / "arms"))
    from servo_world import arm_of

    return arm_of(name)


class Rig:
    """An arm with its gains and what the sensor shows of a press."""

    def __init__(self, name: str, cap: float):
        arm = servo(name.removeprefix("servo-")) if name.startswith("servo-") else load_arm(name)
        self.arm = msgspec.structs.replace(arm, sensor=msgspec.structs.replace(arm.sensor, noise=NOISE))
        self.gains = gains_for(self.arm, FORCE, cap=cap)
        self.control = Guarded(self.gains.cautious())

    def press(self, fault: str, key: Key) -> dict[str, float]:
        """A press with a fault."""
        _, seed, i = key
        rng = np.random.default_rng([seed, i])
        K = float(np.exp(rng.uniform(np.log(300.0), np.log(self.gains.cap))))
        mass = self.arm.inner.mass if self.arm.kind == "torque" else 1.0
        B = 2.0 * np.exp(rng.uniform(np.log(0.01), np.log(0.3))) * np.sqrt(K * mass)
        shape, noise = FAULTS[fault]
        n = round((GAP / self.gains.approach + LEFT) * self.arm.rate)
        error = shape(rng, np.arange(n) * self.arm.tick)
        world = world_of(self.arm, noise=noise, phase=float(rng.uniform(0.0, 1.0 / self.arm.sensor.sampling)))
        rows = pressed(world, surface(K, B), self.control, GAP, np.full(n, FORCE), [seed, i, 1], error=error)
        return self.judge(rows, error)

    def judge(self, rows, error) -> dict[str, float]:
        """Settling [s] (NaN for none), overshoot, ticks too fast, losses of contact."""
        force, speed, rate = rows[:, 0], rows[:, 3], self.arm.rate
        fast = int(((force <= 0.0) & (speed > 1.0001 * self.gains.approach)).sum())
        if not (force > 0.0).any():
            return {"settling": np.nan, "over": 0.0, "fast": fast, "lost": 0, "touched": 0}
        start = int(np.argmax(force > 0.0))
        outside = np.flatnonzero(np.abs(force - FORCE) > 0.05 * FORCE + np.abs(np.median(error[-50:])))
        last = outside[-1] + 1 if len(outside) else start
        firm = int(np.argmax(force > 0.5 * FORCE)) if (force > 0.5 * FORCE).any() else len(force)
        return {
            "settling": (last - start) / rate if last < len(force) - round(0.3 * rate) else np.nan,
            "over": float(force.max() / FORCE - 1.0),
            "fast": fast,
            "lost": int(((force[firm:-1] > 0.0) & (force[firm + 1 :] <= 0.0)).sum()),
            "touched": 1,
        }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--touches", type=int, default=1000)
    parser.add_argument("--arms", nargs="+", default=["ur5e", "fr3", "iiwa14"])
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--cap", type=float, default=1e5)
    parser.add_argument("--faults", nargs="+", default=list(FAULTS), choices=FAULTS)
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--out", type=Path, default=Path("runs/free_motion"))
    options = parser.parse_args()
    until = time.monotonic() + 60.0 * options.minutes
    for name in options.arms:
        rig = Rig(name, options.cap)
        print(f"\n{rig.arm.title}: approach {1e3 * rig.gains.approach:.3g} mm/s, seed {options.seed}")
        print(f"{'':30}presses  too fast  over: most   p99     settled   p50    p95    lost")
        for fault in options.faults:
            keys = [(name, options.seed, i) for i in range(options.touches)]
            path = options.out / f"{name}-{options.cap:g}-{fault}.jsonl"
            left = (until - time.monotonic()) / 60.0
            show(fault, list(resumed(path, keys, partial(rig.press, fault), left).values()))


def show(fault: str, rows: list[dict[str, float]]) -> None:
    """A line of the table."""
    settling, over, fast, lost = (
        np.array([row[key] for row in rows], dtype=float) for key in ("settling", "over", "fast", "lost")
    )
    print(
        f"{fault:30}{len(rows):7}  {(fast > 0).sum():8}  {100 * over.max():7.1f} %"
        f"  {100 * np.percentile(over, 99):6.1f} %  {np.isfinite(settling).sum():6}"
        f"  {np.nanpercentile(settling, 50):6.3f} {np.nanpercentile(settling, 95):6.3f}  {(lost > 0).sum():5}",
        flush=True,
    )


if __name__ == "__main__":
    main()
