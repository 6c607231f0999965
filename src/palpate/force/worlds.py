"""The simulated world of an arm."""

from __future__ import annotations

import math

import numpy as np
from scipy.linalg import expm

from palpate._vector import Mat3, Vec3
from palpate.force.arm import Arm, PositionLoop
from palpate.force.sampled_loop import filter_of
from palpate.force.touching import Surface, World


def world_of(arm: Arm, **changes) -> World:
    inner = arm.inner
    steps = max(round(arm.tick / (2e-4 if arm.kind == "position" else 5e-5)), 1)
    h = arm.tick / steps
    A, b, c = filter_of(arm.low_pass)
    n = len(b)
    M = np.zeros((n + 1, n + 1)); M[:n, :n], M[:n, n] = A * h, b * h
    both = expm(M)
    wide = np.zeros((3, 3)); wide[:n, :n] = both[:n, :n]
    pad = lambda v: Vec3(*(float(u) for u in np.concatenate([v, np.zeros(3 - n)])))
    if isinstance(inner, PositionLoop):
        w = 2 * math.pi * inner.bandwidth
        first, second = w * w, 2 * inner.damping * w
    else:
        first, second = inner.mass, inner.damping
    numbers = dict(torque=float(arm.kind == "torque"), first=first, second=second, stiffness=inner.stiffness,
        delay=arm.delay_ticks, tick=arm.tick, steps=steps, speed=arm.limits.speed, E=Mat3(*(Vec3(*map(float, r)) for r in wide)),
        e=pad(both[:n, n]), c=pad(c), d=0.0 if n else 1.0, sampling=arm.sensor.sampling, phase=0.0, noise=arm.sensor.noise,
        full_scale=arm.sensor.full_scale, step=0.0)
    numbers.update(changes)
    for k, v in numbers.items():
        if k not in ("delay", "steps") and not isinstance(v, tuple):
            numbers[k] = float(v)
    return World(**numbers)


def surface(K, B=0.0, n=1.0, place=0.0, sway=0.0, frequency=0.0, later=None, change=1e9):
    return Surface(*map(float, (K, B, n, place, sway, frequency, K if later is None else later, change)))
