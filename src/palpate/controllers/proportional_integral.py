"""Proportional-integral force control of a chosen bandwidth: what any other force controller is judged by."""

import math
from typing import NamedTuple

from palpate._vector import ZERO3, Vec3
from palpate.controllers.controller import controller
from palpate.controllers.hybrid import Hybrid
from palpate.signals.parameters import require


@controller
class ProportionalIntegral(NamedTuple):
    """`Hybrid` with its integral gain per second, so that it keeps its bandwidth when the rate changes.

    At frequencies where surface and arm give way at once the force is the force command, so with the desired force
    fed forward the error obeys (1 + kf) e' = -ki e: a time constant of (1 + kf)/ki, whatever the surface.

    Args:
        kp: position gain K_pp [1/s^2], shape (m,).
        kv: velocity gain K_pv [1/s], shape (m,).
        kf: force gain K_p [1], shape (m,).
        ki: integral gain K_i [1/s], shape (m,).
        tick: time between steps [s].
    """

    kp: Vec3
    kv: Vec3
    kf: Vec3
    ki: Vec3
    tick: float

    def start(self):
        """The force integral [N], shape (m,)."""
        return 0.0 * self.ki

    def step(self, state, sense, task, model):
        return Hybrid(self.kp, self.kv, self.kf, self.tick * self.ki).step(state, sense, task, model)

    def report(self, state):
        """The force integral."""
        return state, ZERO3


def integral_gain(bandwidth: float, kf: float = 0.0) -> float:
    """K_i [1/s] that gives the force loop this bandwidth [Hz] beside the force gain kf."""
    require(bandwidth > 0.0, "bandwidth", "above 0 Hz", bandwidth)
    require(kf > -1.0, "force gain", "above -1", kf)
    return 2.0 * math.pi * bandwidth * (1.0 + kf)
