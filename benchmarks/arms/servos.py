"""First touches of servos that yield, beside a fixed integral and an admittance on the same touches.

    python benchmarks/arms/servos.py [--touches 60] [--seed 0]

Tips of a UR5e and an iiwa14 at home under the joint gains of MuJoCo menagerie (universal_robots_ur5e, BSD-3-Clause;
kuka_iiwa_14, BSD-3-Clause): K_s and D of all joints in series along the normal, m of the arm's model. Commands are
8 ms late at 500 Hz. Surfaces without damping, 300 N/m to 200 kN/m, even in the logarithm; 15 N; noise of 0.1 N.
The model is that of one direction, and the numbers are known exactly.
"""

from __future__ import annotations

import argparse

import numpy as np

from palpate.force.arm import Arm, Limits, Sensor, ServoLoop
from palpate.force.gains import Gains, gains_for
from palpate.force.simulated_press import pressed, surface, world_of
from palpate.robots import SerialArm

SERVOS = {
    "ur5e": ((2000, 2000, 2000, 500, 500, 500), (400, 400, 400, 100, 100, 100)),
    "iiwa14": ((2000,) * 7, (200,) * 7),
}
"""kp [N m/rad] and kd [N m s/rad] of the joints."""
RATE, DELAY, FORCE, STIFFEST, SOFTEST, SECONDS, BAND = 500.0, 0.008, 15.0, 2e5, 300.0, 4.0, 0.05


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--touches", type=int, default=60)
    parser.add_argument("--seed", type=int, default=0)
    told = parser.parse_args()
    print("| arm | law | settled | p50 [s] | p95 [s] | most over |")
    print("|---|---|---|---|---|---|")
    for name in SERVOS:
        gains = gains_for(arm_of(name), FORCE)
        for law, control in laws(gains).items():
            print(f"| {name} | {law} | {row(gains, control, told.touches, told.seed)} |")


def arm_of(name: str) -> Arm:
    """The tip of an arm at home, along its own z."""
    robot, (kp, kd) = SerialArm.named(name), SERVOS[name]
    q = np.array(robot.home)
    along = robot.forward_kinematics(q)[:3, 2] @ robot.jacobian(q)[:3]
    stiffness, damping = (1.0 / float(along**2 @ (1.0 / np.array(gain))) for gain in (kp, kd))
    mass = 1.0 / float(along @ np.linalg.solve(robot.mass_matrix(q), along))
    return Arm(
        title=f"{name}, servos of MuJoCo menagerie", rate=RATE,
        inner=ServoLoop(mass=mass, stiffness=stiffness, damping=damping, delay=DELAY),
        sensor=Sensor(low_pass="butterworth3:120", sampling=480.0, noise=0.1, full_scale=100.0),  # noqa: S106
        limits=Limits(speed=0.25, stiffness=STIFFEST),
    )  # fmt: skip


def laws(gains: Gains) -> dict:
    """The law as it is tuned, the same without the servo's lead, and two fixed laws for the stiffest surface."""
    import sys
    from pathlib import Path

    sys.path.append(str(Path(__file__).parents[1] / "force"))
    from palpate_benchmark.rivals import AfterTouch, FixedAdmittance, Integral

    law, g, tick = gains.cautious(), gains.gain, gains.arm.tick
    fixed = {"fixed integral": Integral(g), "admittance": FixedAdmittance(gains.theta / g, 1.0 / g, tick)}
    after = {name: AfterTouch(one, gains.approach, gains.arm.sensor.noise) for name, one in fixed.items()}
    return {"cautious": law, "cautious, no lead": law._replace(lead=0.0)} | after


def row(gains: Gains, control, touches: int, seed: int) -> str:
    """Settled, p50 and p95 of settling and the largest overshoot of some touches."""
    world, found = world_of(gains.arm, noise=gains.arm.sensor.noise), []
    for i in range(touches):
        rng = np.random.default_rng([seed, i])
        K = float(np.exp(rng.uniform(*np.log([SOFTEST, STIFFEST]))))
        here = world._replace(phase=float(rng.uniform(0.0, 1.0 / gains.arm.sensor.sampling)))
        desired = np.full(round(SECONDS * RATE), FORCE)
        found.append(judged(pressed(here, surface(K), control, 0.003, desired, [seed, i, 1])[:, 0]))
    late, over = np.array(found).T
    p50, p95 = np.quantile(late, (0.5, 0.95), method="higher")
    return f"{np.isfinite(late).sum()} of {touches} | {p50:.2f} | {p95:.2f} | {100.0 * over.max():.1f} %"


def judged(force) -> tuple[float, float]:
    """Settling from the touch on [s], infinite if it does not, and overshoot."""
    if not (force > 0.0).any():
        return np.inf, 0.0
    start, outside = int(np.argmax(force > 0.0)), np.flatnonzero(np.abs(force - FORCE) > BAND * FORCE)
    late = (outside[-1] + 1 - start) / RATE if outside[-1] < len(force) - round(0.3 * RATE) else np.inf
    return late, float(force.max() / FORCE - 1.0)


if __name__ == "__main__":
    main()
