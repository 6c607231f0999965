"""An arm's world for the simulator, and one run in it."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from palpate._vector import Mat3
from palpate.arrays import Array
from palpate.force.arm import Arm, PositionLoop, ServoLoop
from palpate.force.gains import padded_vector
from palpate.force.sampled_loop import filter_of, zero_order_hold
from palpate.force.touching import Surface, World, compiled_touch

PHYSICS_STEP = {"position": 2e-4, "torque": 5e-5, "servo": 5e-5}
"""Time step of the physics [s]."""
ENCODER = 1e-6
"""Resolution of the measured position [m]."""


def world_of(arm: Arm, *, noise: float, phase: float = 0.0, resolution: float = 0.0) -> World:
    """The world of an arm.

    Args:
        arm: what moves.
        noise: standard deviation of a reading [N].
        phase: when the sensor samples first [s].
        resolution: of a reading [N]; 0 for none.
    """
    inner = arm.inner
    steps = max(round(arm.tick / PHYSICS_STEP[arm.kind]), 1)
    A, b, c = filter_of(arm.low_pass)
    E, e = zero_order_hold(A, b, arm.tick / steps)
    if isinstance(inner, PositionLoop):
        w = 2.0 * math.pi * inner.bandwidth
        first = w * w
        second = 2.0 * inner.damping * w
    else:
        first = inner.mass
        second = inner.damping
    wide = np.zeros((3, 3))
    wide[: len(b), : len(b)] = E
    return World(
        torque=float(not isinstance(inner, PositionLoop)),
        yields=float(isinstance(inner, ServoLoop)),
        first=float(first),
        second=float(second),
        stiffness=float(inner.stiffness),
        delay=arm.delay_ticks,
        tick=arm.tick,
        steps=steps,
        speed=float(arm.limits.speed),
        E=Mat3(*map(padded_vector, wide)),
        e=padded_vector(e),
        c=padded_vector(c),
        d=0.0 if len(b) else 1.0,
        sampling=float(arm.sensor.sampling),
        phase=float(phase),
        noise=float(noise),
        full_scale=float(arm.sensor.full_scale),
        step=ENCODER,
        resolution=float(resolution),
    )


def surface(stiffness: float, damping: float = 0.0, **others: float) -> Surface:
    """A surface at 0; `others` as `Surface` has them."""
    numbers: dict[str, float] = {
        "exponent": 1.0, "place": 0.0, "sway": 0.0, "frequency": 0.0, "later": stiffness, "change": 1e9, "depth": 0.0,
        "mass": 0.0, "thickness": 1e9, "behind": 0.0, "cable": 0.0,
        **others,
    }  # fmt: skip
    return Surface(float(stiffness), float(damping), **{k: float(v) for k, v in numbers.items()})


# More than seven arguments: who waits for the compiler is told, and a sensor may be wrong.
def pressed(
    world: World,
    touched: Surface,
    control: Any,
    gap: float,
    desired: Array,
    seed: Any,
    waiting: Callable[[], None] | None = None,
    error: Array | None = None,
) -> Array:
    """A run from free motion: force on the surface (mean of each tick), K_u, position, speed and reading, shape (n, 5).

    Args:
        world: arm and sensor.
        touched: the surface.
        control: a part with start(), step(state, desired, force, position) and stiffness_bound(state).
        gap: between tip and surface at the start [m].
        desired: F_d at each tick [N], shape (n,).
        seed: of the noise.
        waiting: called when the loop has to be compiled first.
        error: of the sensor beside its noise [N], shape (n,); none if left out.
    """
    n = len(desired)
    out = np.zeros((n, 5))
    noise = np.random.default_rng(seed).standard_normal(8 * (n + 1))
    false = np.zeros(n) if error is None else error
    line = np.zeros(world.delay + 1)
    compiled_touch.run(waiting, world, touched, control, -gap, desired, noise, false, line, out)
    return out
