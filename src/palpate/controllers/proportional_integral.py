"""Proportional-integral force control of a chosen bandwidth: what any other force controller is judged by."""

import math
from typing import ClassVar, NamedTuple

from palpate._vector import ZERO3, Vec3
from palpate.controllers.controller import ControllerTable, controller
from palpate.controllers.hybrid import Hybrid
from palpate.errors import InputError
from palpate.signals.types import NotNegative, Positive, alike, require


@controller
class ProportionalIntegral(NamedTuple):
    """`Hybrid` with its integral gain per second, so that it keeps its bandwidth when the rate changes.

    At frequencies where surface and arm give way at once the force is the force command, so with the desired force
    fed forward the error obeys (1 + kf) e' = -ki e: a time constant of (1 + kf)/ki, on any surface.

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
        """The force integral, for the record."""
        return state, ZERO3


def integral_gain(bandwidth: float, kf: float = 0.0) -> float:
    """K_i [1/s] that gives the force loop this bandwidth [Hz] beside the force gain kf."""
    require(bandwidth > 0.0, "bandwidth", "above 0 Hz", bandwidth)
    require(kf > -1.0, "force gain", "above -1", kf)
    return 2.0 * math.pi * bandwidth * (1.0 + kf)


class ProportionalIntegralController(ControllerTable, tag="proportional-integral"):
    """PI on the force, hybrid control in all else: what other force controllers are judged by."""

    shares_loop: ClassVar[bool] = True

    kp: NotNegative = 400.0
    kv: NotNegative = 80.0
    kf: NotNegative = 0.25
    ki: NotNegative | None = None
    """[1/s]; 5 when left out, which is what the neural controller amounts to."""
    bandwidth: Positive | None = None
    """Of the force loop [Hz], instead of ki."""

    def build(self, tick: float, wall: float) -> ProportionalIntegral:
        """The part, for a time between ticks [s] and a surface at x = `wall` [m]."""
        if self.ki is not None and self.bandwidth is not None:
            raise InputError("ki and bandwidth in [controller] set the same gain; leave one out")
        wanted = 5.0 if self.ki is None else float(self.ki)
        ki = wanted if self.bandwidth is None else integral_gain(self.bandwidth, self.kf)
        return ProportionalIntegral(alike(self.kp), alike(self.kv), alike(self.kf), alike(ki), tick)
