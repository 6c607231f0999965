"""How often the intervals of a servo hold the truth: logs of MuJoCo's UR5e and iiwa14 under position actuators.

    python benchmarks/arms/servo_logs.py [--logs 200] [--seed 0] [--arms ur5e iiwa14]

One log each: steps, or a sweep, in free motion, and one push by hand. kp and kd of MuJoCo menagerie's models, each
times 0.5 to 2; delay of 2 to 20 ms; 500 Hz; noise of 10 um of the position, white or coloured (0.95), and of 0.1 N. The
truth is of the linear arm with all its joints, whose loop is written here again.
"""

from __future__ import annotations

import argparse
from typing import NamedTuple

import numpy as np
from numpy.linalg import solve
from rich.progress import track
from scipy.linalg import expm
from scipy.signal import lfilter
from servo_world import RATE, SERVOS, STEPS, ServoWorld

from palpate.arrays import Array
from palpate.errors import InputError
from palpate.force.arm import Arm, Limits, Sensor, TorqueLoop
from palpate.force.inner_loop import identify_inner_loop
from palpate.robots import SerialArm

SECONDS, REACH, PUSH, AWAY = 16.0, 0.005, 20.0, 0.3
"""Of a log; largest motion of the command [m], force of the hand [N] and way of a joint from home [rad]."""
NAMES = ("lag", "stiffness", "delay", "theta")
PLAIN = Arm(
    title="an arm", rate=RATE, inner=TorqueLoop(mass=1.0, stiffness=1.0, damping=1.0, delay=0.0),
    sensor=Sensor(low_pass="butterworth3:120", sampling=480.0, noise=0.1, full_scale=100.0),  # noqa: S106
    limits=Limits(speed=0.25, stiffness=2e5),
)  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--logs", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--arms", nargs="+", default=list(SERVOS), choices=SERVOS)
    told = parser.parse_args()
    print("| arm | " + " | ".join(NAMES) + " | refused |", "|---" * 6 + "|", sep="\n")
    for name in told.arms:
        rows = [row(name, [told.seed, i]) for i in track(range(told.logs), name, transient=True)]
        done = [r for r in rows if r is not None]
        inside, halves = np.mean([r[0] for r in done], axis=0), np.median([r[1] for r in done], axis=0)
        cells = [f"{100.0 * a:.1f} %, +- {100.0 * b:.2g} %" for a, b in zip(inside, halves, strict=True)]
        print(f"| {name} | " + " | ".join(cells) + f" | {len(rows) - len(done)} of {len(rows)} |", flush=True)


def row(name: str, seed: list[int]):
    """Whether each interval holds the truth, and its half-width over that; None for a log that is refused."""
    rng = np.random.default_rng(seed)
    kp, kd = (np.array(g, dtype=float) * 2.0 ** rng.uniform(-1.0, 1.0) for g in SERVOS[name])
    delay = rng.integers(0.002 * RATE * STEPS, 0.02 * RATE * STEPS + 1) / RATE / STEPS
    offset = rng.uniform(-AWAY, AWAY, len(kp))
    columns = log(rng, name, offset, (kp, kd), delay)
    try:
        found = identify_inner_loop(*columns[:3], force=columns[3])
        arm = found.of(PLAIN, "log")
        intervals = [found.lag, found.stiffness, found.delay, found.theta(arm)]
    except InputError:
        return None
    truth = true_numbers(name, offset, kp, kd, delay, arm)
    inside = [p.low <= t <= p.high for p, t in zip(intervals, truth, strict=True)]
    return inside, [p.half / t for p, t in zip(intervals, truth, strict=True)]


def log(rng, name: str, offset, gains, delay: float):
    """Time [s], command [m], position [m] and force [N]: free motion for three quarters of the log, then a push."""
    n = round(SECONDS * RATE)
    free, t = 3 * n // 4, np.arange(n) / RATE
    if rng.random() < 0.5:
        command = np.repeat(rng.uniform(-REACH, REACH, n // 250 + 1), 250)[:n]
    else:
        rate = np.log(100.0) / t[free]
        command = REACH * np.sin(2.0 * np.pi * 0.1 / rate * np.expm1(rate * t))
    command[free:] = command[free - 1]
    since, rest = (
        t - t[free] - 1.0,
        (n - free) / RATE - 1.0,
    )  # still for a second, half a second up, likewise down
    push = PUSH * rng.uniform(0.5, 1.0) * np.clip(np.minimum(since, rest - since) / 0.5, 0.0, 1.0)
    world = ServoWorld(name, offset, gains, delay, phase=rng.uniform(0.0, 1.0 / 480.0))
    position, force = np.empty((2, n))
    for k, way in enumerate(np.diff(command, prepend=0.0)):
        position[k], force[k] = world.position, world.reading
        world.tick(way, push[k])
    colour = 0.95 * (rng.random() < 0.5)
    noise = lfilter([np.sqrt(1.0 - colour**2)], [1.0, -colour], 1e-5 * rng.standard_normal(n))
    return t, command, position + noise, force + 0.1 * rng.standard_normal(n)


def true_numbers(name: str, offset, kp, kd, delay: float, arm: Arm):
    """Lag [s], stiffness [N/m] and delay [s] of the tip, and theta [s] of the loop with the law for `arm`."""
    robot = SerialArm.named(name)
    q = np.array(robot.home) + offset
    J, M = robot.jacobian(q), robot.mass_matrix(q)
    normal = robot.forward_kinematics(q)[:3, 2]
    along, way = normal @ J[:3], np.linalg.pinv(J)[:, :3] @ normal
    tilts = [robot.gravity_torque(q + d) - robot.gravity_torque(q - d) for d in 1e-5 * np.eye(len(q))]
    spring = np.diag(kp) + np.column_stack(tilts) / 2e-5  # the arm's weight is one, too
    joints = Joints(along, kp * way, M, spring, np.diag(kd))
    lags = [lag_on(K, joints, delay, arm) for K in np.geomspace(1.0, arm.limits.stiffness, 40)]
    rest = solve(spring, kp * way)
    lag = float(along @ solve(spring, kd * rest)) / float(along @ rest)
    return lag, 1.0 / float(along @ solve(spring, along)), delay, max(lags)


class Joints(NamedTuple):
    """M qdd + D qd + K q = pull x_c, the tip at along q."""

    along: Array
    pull: Array
    M: Array
    K: Array
    D: Array


def lag_on(K: float, joints: Joints, delay: float, arm: Arm) -> float:
    """pi/2 over the ultimate gain of the loop on a surface [s]: joints, low-pass, readings of two ticks, lead."""
    n, w = len(joints.M), 2.0 * np.pi * 120.0
    A, b, c = np.zeros((2 * n + 3, 2 * n + 3)), np.zeros(2 * n + 3), np.zeros(2 * n + 3)
    A[:n, n : 2 * n] = np.eye(n)
    A[n : 2 * n, :n] = -solve(joints.M, joints.K + K * np.outer(joints.along, joints.along))
    A[n : 2 * n, n : 2 * n] = -solve(joints.M, joints.D)
    b[n : 2 * n] = solve(joints.M, joints.pull)
    A[2 * n, 2 * n + 1] = A[2 * n + 1, 2 * n + 2] = w  # f''' + 2 w f'' + 2 w^2 f' + w^3 f = w^3 K along q
    A[2 * n + 2, :n], A[2 * n + 2, 2 * n :], c[2 * n] = w * K * joints.along, [-w, -2.0 * w, -2.0 * w], 1.0
    ticks = delay * RATE
    whole, part = int(ticks), ticks - int(ticks)
    E, both = stepped(A, b, 1.0 / RATE)
    later = stepped(A, b, (1.0 - part) / RATE)[1]
    f = np.geomspace(0.2, 0.499 * RATE, 800)
    z = np.exp(2j * np.pi * f / RATE)
    plant = (
        solve(z[:, None, None] * np.eye(len(b)) - E, (later + np.outer(1.0 / z, both - later))[:, :, None])[
            :, :, 0
        ]
        @ c
    )
    K_s, lag, m = arm.inner.stiffness, arm.inner.damping / arm.inner.stiffness, arm.inner.mass
    total, smooth = 1.0 + K / K_s, 0.1 * lag
    lead = lag / (2.0 * total) * (1.0 + np.sqrt(max(1.0 - 4.0 * m * K_s / arm.inner.damping**2 * total, 0.0)))
    kept, ahead = smooth / (smooth + 1.0 / RATE), (lead + smooth) * RATE
    law = (1.0 - kept) / (1.0 - kept / z) * (1.0 + ahead * (1.0 - 1.0 / z)) / RATE / (1.0 - 1.0 / z)
    loop = plant * law * z ** -(2.0 + whole) * (1.0 / K + 1.0 / K_s)
    crossing = np.flatnonzero((loop.imag[:-1] * loop.imag[1:] < 0.0) & (loop.real[:-1] < 0.0))
    share = loop.imag[crossing] / (loop.imag[crossing] - loop.imag[crossing + 1])
    return 0.5 * np.pi * float(-(loop.real[crossing] + share * np.diff(loop.real)[crossing]).min())


def stepped(A, b, time: float):
    """z(t) = E z(0) + e u under a held u."""
    both = expm(time * np.block([[A, b[:, None]], [np.zeros((1, len(b) + 1))]]))
    return both[:-1, :-1], both[:-1, -1]


if __name__ == "__main__":
    main()
