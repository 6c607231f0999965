"""A law that knows the surface: what any law of the same gain, lag, limits and approach can come to at best."""

from __future__ import annotations

from typing import Any, NamedTuple

from palpate._jit import part
from palpate.force.expected import rise
from palpate.force.gains import Gains
from palpate.force.law import least_for


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

    def told(self, state):
        return self.bound


def knowing(gains: Gains, draw: Any, rises: float) -> Knowing:
    """For this surface.

    Args:
        gains: of the cautious law.
        draw: the touch.
        rises: after the touch, from which on it is known.
    """
    felt = draw.K if gains.arm.kind == "torque" else gains.arm.seen(draw.K)
    whole = felt * (1.0 + draw.B / draw.K / gains.theta)
    best = max(felt, least_for(gains.cautious(), whole))
    depth = gains.approach * rises * rise(gains, draw.K)
    return Knowing(gains.gain_at(best), gains.approach, gains.arm.limits.speed, depth, best)
