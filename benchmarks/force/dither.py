"""A small dither with lock-in detection beside the cautious law: does it see what changes while nothing moves?

    python benchmarks/force/dither.py [--arms ur5e fr3] [--seeds 10] [--share 0.01]

The command is swung by `share` of F_d/K_u at a quarter of 1/theta; force and position, as the sensor sees it, are
demodulated over four periods, and K_u rises to 1.03 times what they say with 1.5 standard deviations of room. First
touch with 20 N, a change of stiffness after 3 s, 25 N asked from 8 s on; then a surface that sways by 1 mm at 0.5 Hz.
Medians over the seeds, each with and without.
"""

from __future__ import annotations

import argparse
from math import pi
from typing import Any, NamedTuple

import numpy as np
from rich.progress import track
from touches import Draw, Rig

from palpate._jit import part
from palpate._vector import cos, sin, sqrt
from palpate.force.law import Cautious, CautiousState
from palpate.force.stage import LOCKED
from palpate.force.stiffness_bound import Bound

CHANGES = ((7e3, 62e3), (1e3, 1e6), (7e3, 7e3))
SWAYING = (7e3, 62e3)
FORCE, LATER, NOISE = 20.0, 25.0, 0.1


@part
class Dithered(NamedTuple):
    """The cautious law on top of a dither.

    Args:
        law: below.
        rate: of the dither [rad/s].
        share: its amplitude over F_d/K_u.
        memory: of the demodulation [s].
    """

    law: Cautious
    rate: float
    share: float
    memory: float

    def start(self):
        return self.law.start(), 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0

    def step(self, state, desired, force, position):
        inner, ticks, fc, fs, xc, xs, f0, x0, age = state
        law = self.law
        speed, inner = law.step(inner, desired, force, position)
        x = inner.follow.y
        keep = law.tick / self.memory
        f0, x0 = f0 + keep * (force - f0), x0 + keep * (x - x0)
        c, s = cos(self.rate * law.tick * ticks), sin(self.rate * law.tick * ticks)
        fc, fs = fc + keep * (2.0 * c * (force - f0) - fc), fs + keep * (2.0 * s * (force - f0) - fs)
        xc, xs = xc + keep * (2.0 * c * (x - x0) - xc), xs + keep * (2.0 * s * (x - x0) - xs)
        age = age + 1.0 if inner.stage.phase == LOCKED else 0.0
        if age == 0.0:
            return speed, (inner, ticks + 1.0, 0.0, 0.0, 0.0, 0.0, force, x, 0.0)
        moved = sqrt(xc * xc + xs * xs)
        if age * law.tick > 3.0 * self.memory and moved > 0.0:
            spread = sqrt(inner.watch.variance * law.period / self.memory)
            seen = (sqrt(fc * fc + fs * fs) + law.z * spread) / moved
            if seen - 2.0 * law.z * spread / moved > inner.bound.used:
                bound = min((1.0 + law.eps) * seen, law.cap)
                inner = CautiousState(
                    inner.ticks, inner.desired, inner.watch, inner.follow, inner.stage, inner.known,
                    inner.starts, Bound(bound, bound, 0.0), inner.backstop,
                )  # fmt: skip
        speed += self.share * desired / inner.bound.used * self.rate * c
        return speed, (inner, ticks + 1.0, fc, fs, xc, xs, f0, x0, age)

    def stiffness_bound(self, state):
        return state[0].bound.used


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--arms", nargs="+", default=["ur5e", "fr3"])
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--share", type=float, default=0.01)
    told = parser.parse_args()
    for name in told.arms:
        rig = Rig(name)
        gains = rig.gains(FORCE, NOISE)
        law: Any = gains.cautious()
        rate = 0.5 * pi / gains.theta
        laws = {"without": law, "with dither": Dithered(law, rate, told.share, 8.0 * pi / rate)}
        print(
            f"\n{rig.arm.title}: dither of {rate / 2.0 / pi:.1f} Hz, {100.0 * told.share:g} % of {FORCE:g} N"
        )
        for what, control in track(laws.items(), name, transient=True):
            for K, later in CHANGES:
                found = [
                    stepped(rig, gains, control, K, later, seed)
                    for seed in track(range(told.seeds), what, transient=True)
                ]
                rest, peak = np.median(found, axis=0)
                change = f"{K / 1e3:g} -> {later / 1e3:g} kN/m"
                print(
                    f"  {what:<12}{change:<20} rms at rest {rest:.3f} N, the step to 25 N peaks at {peak:.1f} N"
                )
            for K in SWAYING:
                found = [swayed(rig, gains, control, K, seed) for seed in range(told.seeds)]
                rms, lost = np.median(found, axis=0)
                print(
                    f"  {what:<12}{f'sways, {K / 1e3:g} kN/m':<20} rms {rms:.3f} N, {lost:.0f} ticks without contact"
                )


def stepped(rig: Rig, gains: Any, control: Any, K: float, later: float, seed: int) -> tuple[float, float]:
    """rms error in the second before the step, largest force after it [N]."""
    wanted = np.full(round(11.0 * rig.arm.rate), FORCE)
    step = round(8.0 * rig.arm.rate)
    wanted[step:] = LATER
    draw = Draw(K, 0.1 * np.sqrt(K), FORCE, NOISE, 0.0, 0.05)
    force = rig.run(
        draw,
        control,
        [seed, 2],
        desired=wanted,
        approach=gains.approach,
        later=later,
        change=3.0,
        depth=FORCE / K,
    )[:, 0]
    rest = force[step - round(rig.arm.rate) : step] - FORCE
    return float(np.sqrt(np.mean(rest**2))), float(force[step:].max())


def swayed(rig: Rig, gains: Any, control: Any, K: float, seed: int) -> tuple[float, float]:
    """rms error from 5 s on [N], ticks without contact."""
    draw = Draw(K, 0.2 * np.sqrt(K), FORCE, NOISE, 0.0, 0.1)
    rows = rig.run(draw, control, [seed, 3], 20.0, approach=gains.approach, sway=1e-3, frequency=pi)
    force = rows[len(rows) // 4 :, 0]
    return float(np.sqrt(np.mean((force - FORCE) ** 2))), float((force <= 0.0).sum())


if __name__ == "__main__":
    main()
