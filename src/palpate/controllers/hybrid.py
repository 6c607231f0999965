"""Hybrid position/force control with the robot's dynamics (thesis, sec. 4.4; Raibert and Craig, 1981; Khatib, 1987)."""

from typing import NamedTuple

from palpate._jit import law
from palpate._vector import ZERO3, Vec3
from palpate.controllers.controller import ControllerTable, controller
from palpate.controllers.resolved_acceleration import position_command, resolved_acceleration
from palpate.signals.types import NotNegative, alike


@law
def hybrid(J, Jdqd, M, h, s, u_x, f_d, u_f):  # (4.13), friction aside
    """Torque that follows u_x where s is 0 and presses with f_d + u_f where s is 1 [N m]."""
    return resolved_acceleration(J, Jdqd, M, h, (1.0 - s) * u_x) + J.T @ (s * (f_d + u_f))


@controller
class Hybrid(NamedTuple):
    """Position where the surface leaves the robot free, force where it does not.

    Args:
        kp: position gain K_pp [1/s^2], shape (m,).
        kv: velocity gain K_pv [1/s], shape (m,).
        kf: force gain K_fp [1], shape (m,). With the feed-forward of the desired force the loop's gain is 1 + kf.
        ki: integral gain K_fi [1 per sample], shape (m,): added to the force command at each tick, times the error.
    """

    kp: Vec3
    kv: Vec3
    kf: Vec3
    ki: Vec3

    def start(self):
        """The force integral [N], shape (m,)."""
        return 0.0 * self.ki

    def step(self, state, sense, task, model):
        error = task.s * (task.f - sense.f)
        integral = state + self.ki * error
        u_x = position_command(self.kp, self.kv, sense.x, sense.xd, task.x, task.xd, task.xdd)
        u_f = self.kf * error + integral  # (4.15)
        return hybrid(model.J, model.Jdqd, model.M, model.h, task.s, u_x, task.f, u_f), integral

    def report(self, state):
        """The force integral, for the record."""
        return state, ZERO3


class HybridController(ControllerTable, tag="hybrid"):
    """Hybrid control with the robot's dynamics, the integral gain per sample as in the thesis."""

    kp: NotNegative = 400.0
    kv: NotNegative = 80.0
    kf: NotNegative = 1.0
    ki: NotNegative = 0.003
    """Per sample."""

    def build(self, tick: float, wall: float) -> Hybrid:
        """The part, for a time between ticks [s] and a surface at x = `wall` [m]."""
        return Hybrid(alike(self.kp), alike(self.kv), alike(self.kf), alike(self.ki))
