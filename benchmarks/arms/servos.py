"""First touches of servos that yield, in MuJoCo with all joints, by gains from one log; beside two fixed laws.

    python benchmarks/arms/servos.py [--touches 60] [--seed 0] [--arms ur5e iiwa14]

Each arm is MuJoCo menagerie's (servo_world.py), commanded 8 ms late at 500 Hz. palpate knows of it one log alone: steps
in free motion and a push (servo_logs.py), by `tune --loop-from`. Surfaces without damping, 300 N/m to 200 kN/m, even in
the logarithm; 15 N; noise of 0.1 N. FZI's law for velocities, v = g e, and the admittance of ros2_controllers without
its spring, M vdot + D v = e with M/D = theta, have the gain that is stable on the stiffest surface, and the same
approach.

"No law is faster" is a bound for all that obey the theorem of free motion: the approach until the force is twice the
level, without noise, and the arm's limit of speed from then on until the force is within the band for the first time.
"""

from __future__ import annotations

import argparse

import numpy as np
from msgspec.structs import replace
from scipy.linalg import expm
from servo_logs import PLAIN, log
from servo_world import RATE, SERVOS, ServoWorld

from palpate.arrays import Array
from palpate.force import ForceLoop
from palpate.force.gains import Gains, gains_for
from palpate.force.inner_loop import identify_inner_loop

DELAY, FORCE, STIFFEST, SOFTEST, SECONDS, BAND, NOISE, GAP = 0.008, 15.0, 2e5, 300.0, 4.0, 0.05, 0.1, 0.003


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--touches", type=int, default=60)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--arms", nargs="+", default=list(SERVOS), choices=SERVOS)
    told = parser.parse_args()
    print("| arm | law | settled | p50 [s] | p95 [s] | most over |", "|---" * 6 + "|", sep="\n")
    for name in told.arms:
        gains = gains_from_log(name, told.seed)
        for law in LAWS:
            found = [touch(name, gains, law, [told.seed, i]) for i in range(told.touches)]
            print(f"| {name} | {law} | {row(found)} |", flush=True)
        bound = [fastest(gains, surface_of([told.seed, i])[0]) for i in range(told.touches)]
        p50, p95 = np.quantile(bound, (0.5, 0.95), method="higher")
        print(f"| {name} | no law is faster | | {p50:.2f} | {p95:.2f} | |", flush=True)


def gains_from_log(name: str, seed: int) -> Gains:
    """The law's gains for an arm of which one log is known."""
    rng = np.random.default_rng([seed, 1000])
    columns = log(rng, name, np.zeros(len(SERVOS[name][0])), SERVOS[name], DELAY)
    found = identify_inner_loop(*columns[:3], force=columns[3])
    arm = found.of(replace(PLAIN, title=name), "log")
    return gains_for(arm, FORCE, theta=found.theta(arm).high)


def cautious(gains: Gains):
    """palpate's own law with its guard, as a user runs it."""
    return ForceLoop(gains).update


def integral(gains: Gains):
    """v = g e after a reading of four standard deviations."""
    gain = fixed_gain(gains)
    return after_touch(gains, lambda error, _: gain * error)


def admittance(gains: Gains):
    """M vdot + D v = e after the same."""
    gain, share = fixed_gain(gains), gains.arm.tick / gains.theta
    return after_touch(gains, lambda error, speed: speed + share * (gain * error - speed))


def fixed_gain(gains: Gains) -> float:
    """alpha/theta on the stiffest surface [m/(s N)]."""
    return gains.alpha / gains.theta / gains.arm.seen(gains.cap)


def after_touch(gains: Gains, law):
    """A law of the error and the last speed, after an approach."""
    touched, speed = False, 0.0

    def update(force: float, position: float) -> float:
        nonlocal touched, speed
        touched = touched or force > 4.0 * NOISE
        if not touched:
            return gains.approach
        limit = gains.arm.limits.speed
        speed = float(np.clip(law(FORCE - force, speed), -limit, limit))
        return speed

    return update


LAWS = {"palpate": cautious, "FZI": integral, "ros2 admittance": admittance}


def surface_of(seed: list[int]) -> tuple[float, float]:
    """Stiffness [N/m], and the phase of the sensor's clock [s]."""
    rng = np.random.default_rng(seed)
    return float(np.exp(rng.uniform(*np.log([SOFTEST, STIFFEST])))), float(rng.uniform(0.0, 1.0 / 480.0))


def touch(name: str, gains: Gains, law: str, seed: list[int]) -> tuple[float, float]:
    """Settling [s] and overshoot of one touch."""
    stiffness, phase = surface_of(seed)
    world = ServoWorld(name, np.zeros(len(SERVOS[name][0])), SERVOS[name], DELAY, stiffness, GAP, phase)
    control, true = LAWS[law](gains), np.empty(round(SECONDS * RATE))
    noise = NOISE * np.random.default_rng([*seed, 1]).standard_normal(len(true))
    shown, samples = 0.0, 0
    for k in range(len(true)):
        if world.samples > samples:
            samples, shown = world.samples, world.reading + noise[k]
        true[k] = world.tick(gains.arm.tick * control(shown, world.position))
    return judge(true)


def judge(force: Array) -> tuple[float, float]:
    """Settling from the touch on [s], infinite if it does not, and overshoot."""
    if not (force > 0.0).any():
        return np.inf, 0.0
    start, outside = int(np.argmax(force > 0.0)), np.flatnonzero(np.abs(force - FORCE) > BAND * FORCE)
    late = (outside[-1] + 1 - start) / RATE if outside[-1] < len(force) - round(0.3 * RATE) else np.inf
    return late, float(force.max() / FORCE - 1.0)


def row(found: list[tuple[float, float]]) -> str:
    """Settled, p50 and p95 of settling and the largest overshoot of some touches."""
    late, over = np.array(found).T
    p50, p95 = np.quantile(late, (0.5, 0.95), method="higher")
    return f"{np.isfinite(late).sum()} of {len(late)} | {p50:.2f} | {p95:.2f} | {100.0 * over.max():.1f} %"


def fastest(gains: Gains, stiffness: float) -> float:
    """Least time from the touch until the force is within the band [s]."""
    servo, h = gains.arm.inner, 1e-4
    rates = np.zeros((4, 4))  # of x, xdot, x_c and the speed of the command
    rates[0, 1] = rates[2, 3] = 1.0
    own = servo.stiffness / servo.mass
    rates[1, :3] = -own - stiffness / servo.mass, -servo.damping / servo.mass, own
    step, speed = expm(h * rates), gains.approach
    state, ticks = np.array([0.0, speed, servo.lag * speed, speed]), 0
    while stiffness * state[0] < (1.0 - BAND) * FORCE:
        if stiffness * state[0] > 2.0 * gains.level:
            state[3] = gains.arm.limits.speed
        state, ticks = step @ state, ticks + 1
    return h * ticks


if __name__ == "__main__":
    main()
