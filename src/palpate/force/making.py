"""From an arm to its cautious law."""

from __future__ import annotations

import numpy as np

from palpate._vector import Mat3, Vec3
from palpate.force.arm import Arm, PositionLoop
from palpate.force.lag import lag_of
from palpate.force.law import Cautious
from palpate.force.sampled_loop import filter_of

ALPHA = 0.42


def cautious(arm: Arm, force: float, **changes: float) -> Cautious:
    """The law for an arm and the force that it is to press with [N].

    Args:
        arm: what moves.
        force: F_d, the smallest there will be [N].
        changes: of the law's numbers.
    """
    theta = changes.pop("theta", None) or lag_of(arm)
    cap = arm.limits.stiffness
    compliance = 0.0
    speed = arm.limits.speed
    if isinstance(arm.inner, PositionLoop):
        cap = arm.seen(cap)
        touch = speed
    else:
        compliance = 1.0 / arm.inner.stiffness
        touch = 0.3 * force / np.sqrt(cap * arm.inner.mass)
    E, e0, e1, c, d = followed(arm)
    memory = 5.0 / arm.low_pass.decay + 1.0 / arm.sensor.sampling if arm.low_pass.roll_off else 2.0 * arm.tick
    numbers = {
        "tick": arm.tick, "theta": theta, "alpha": ALPHA, "compliance": compliance, "cap": cap, "floor": 0.02 * ALPHA * force / (theta * speed),
        "speed": speed, "approach": min(touch, speed), "noise": arm.sensor.noise, "memory": memory,
        "period": max(1.0 / arm.sensor.sampling, arm.tick),
        "E": E, "e0": e0, "e1": e1, "c": c, "d": d, "z": 2.0, "eps": 0.03,
        "full_scale": arm.sensor.full_scale, "force_limit": arm.sensor.full_scale,
        "locking": 1.0, "bounding": 1.0, "backing": 1.0,
    }
    numbers["floor"] = max(numbers["floor"], 1.0)
    return Cautious(**{k: v if isinstance(v, tuple) else float(v) for k, v in {**numbers, **changes}.items()})


def followed(arm: Arm):
    """The sensor's low-pass on a position that runs straight between ticks: E, e0, e1, c, d."""
    from scipy.linalg import expm

    A, b, c = filter_of(arm.low_pass)
    n, T = len(b), arm.tick
    if n == 0:
        none = Vec3(0.0, 0.0, 0.0)
        return Mat3(none, none, none), none, none, none, 1.0
    M = np.zeros((n + 2, n + 2))
    M[:n, :n], M[:n, n] = A * T, b * T
    M[n, n + 1] = 1.0
    both = expm(M)
    E, full, ramp = both[:n, :n], both[:n, n], both[:n, n + 1]
    wide = np.zeros((3, 3)); wide[:n, :n] = E
    pad = lambda v: Vec3(*(float(u) for u in np.concatenate([v, np.zeros(3 - n)])))
    return Mat3(*(pad(r[:n]) if False else Vec3(*map(float, r)) for r in wide)), pad(full - ramp), pad(ramp), pad(c), 0.0
