"""Friction of the arm's joints that depends on its configuration (thesis, sec. 4.5)."""

from __future__ import annotations

from typing import Any, NamedTuple

from palpate._jit import law, part
from palpate._vector import Vec3, sqrt
from palpate.friction import LuGre
from palpate.robots.arm3 import Arm3, directions, onto_joints

GRAVITY = 9.81
"""[m/s^2]."""


@law
def tilting(arm: Any, q: Any) -> Any:
    """Moment that tilts each joint's vertical axis: of the weight of all links beyond it [N m], shape (3,)."""
    (c, s), m, a = directions(q), arm.mass, arm.length
    first = m * (a + arm.com) + Vec3((m.y + m.z) * a.x, m.z * a.y, 0.0)
    x, y = onto_joints(first * c), onto_joints(first * s)
    return GRAVITY * sqrt(x * x + y * y)


@part
class ConfigurationState(NamedTuple):
    bristles: Vec3  # [rad]
    q: Vec3  # joint angles [rad]


@part
class FrictionByConfiguration(NamedTuple):
    """Friction of bearings that carry the weight of the links beyond them: as strong as that weight tilts them.

    Args:
        friction: where the bearings carry `reference`.
        arm: whose weight it is.
        reference: tilting moments [N m], shape (3,).
        q: joint angles at the start [rad], shape (3,).
    """

    friction: LuGre
    arm: Arm3
    reference: Vec3
    q: Vec3

    def start(self):
        return ConfigurationState(self.friction.start(), self.q)

    def step(self, state, v, dt):
        """As that of `LuGre`; the plant's angles are the integral of its rates."""
        q = state.q + dt * v
        now = self.friction.scaled_by(tilting(self.arm, q) / self.reference)
        torque, bristles = now.step(state.bristles, v, dt)
        return torque, ConfigurationState(bristles, q)
