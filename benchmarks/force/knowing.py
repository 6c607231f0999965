"""A law that knows the surface: what any law of the same gain, lag, limits and approach can come to at best."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from palpate._jit import part
from palpate.force.gains import Gains
from palpate.force.stiffness_bound import least_for


@part
class Knowing(NamedTuple):
    """The approach until the tip is so deep in the surface, from then on v = g e with the best g that is allowed."""

    gain: float
    approach: float
    speed: float
    depth: float
    bound: float

    def start(self):
        return 0.0

    def step(self, state, desired, force, position):
        if state == 0.0 and position <= self.depth:
            return self.approach, 0.0
        return max(min(self.gain * (desired - force), self.speed), -self.speed), 1.0

    def stiffness_bound(self, state):
        return self.bound


def knowing(gains: Gains, draw: Any, energy: float) -> Knowing:
    """For this surface.

    Args:
        gains: of the cautious law.
        draw: the touch.
        energy: of the force, in variances of a reading, at which the touch is known.
    """
    felt = draw.K if gains.arm.kind == "torque" else gains.arm.seen(draw.K)
    whole = felt * (1.0 + draw.B / draw.K / gains.theta)
    best = max(felt, least_for(gains.cautious(), whole))
    moved = (
        1.0 if gains.arm.kind == "position" else gains.arm.seen(draw.K) / draw.K
    )  # of the command, as measured
    depth = moved * gains.approach * known_after(gains, draw, energy)
    return Knowing(gains.gain_at(best), gains.approach, gains.arm.limits.speed, depth, best)


def known_after(gains: Gains, draw: Any, energy: float) -> float:
    """When n v^2/sigma^2 (K^2 t^3/3 + K B t^2 + B^2 t) comes to it, the force being K v t + B v in the approach [s]."""
    sensor, share = gains.arm.sensor, gains.arm.seen(draw.K) / draw.K
    K, B = share * draw.K, share * share * draw.B
    whole = energy * draw.noise**2 / (sensor.sampling * gains.approach**2)
    roots = np.roots([K * K / 3.0, K * B, B * B, -whole])
    return (
        float(max(roots.real[np.abs(roots.imag) < 1e-9 * np.abs(roots)].max(), 0.0)) if energy > 0.0 else 0.0
    )
