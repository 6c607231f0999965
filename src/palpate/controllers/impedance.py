"""Impedance control: the tip gives way like a mass, a damper and a spring (thesis, (2.1)-(2.3); Hogan, 1985)."""

from typing import ClassVar, NamedTuple

from palpate._jit import law
from palpate._vector import Vec3
from palpate.controllers.controller import ControllerTable, controller
from palpate.controllers.hybrid import resolved_acceleration
from palpate.signals.types import NotNegativeTriple, PositiveTriple, triple


@law
def impedance_command(m, b, k, x, xd, x_d, xd_d, xdd_d, f):  # (2.3)
    """Task acceleration of the target impedance under the wrench f on the environment [m/s^2, rad/s^2]."""
    return xdd_d + (b * (xd_d - xd) + k * (x_d - x) - f) / m


@controller
class Impedance(NamedTuple):
    """Presses by asking for a place inside the surface; the force is what both springs agree on.

    It controls no force: in steady state f = k (target - x), friction aside, so on a surface of stiffness K_e the
    force is k K_e/(k + K_e) times the depth of the target.

    Args:
        mass: M of the target [kg, kg m^2], shape (m,).
        damping: B of the target [N s/m, N m s/rad], shape (m,).
        stiffness: K of the target [N/m, N m/rad], shape (m,).
        target: desired pose where a force is selected, beyond the surface [m, rad], shape (m,); elsewhere the
            desired pose is the task's.
    """

    mass: Vec3
    damping: Vec3
    stiffness: Vec3
    target: Vec3

    def start(self):
        return 0.0

    def step(self, state, sense, task, model):
        x_d = (1.0 - task.s) * task.x + task.s * self.target
        u = impedance_command(
            self.mass, self.damping, self.stiffness, sense.x, sense.xd, x_d, task.xd, task.xdd, sense.f
        )
        torque = resolved_acceleration(model.J, model.Jdqd, model.M, model.h, u)
        return torque + model.J.T @ sense.f, state


class ImpedanceController(ControllerTable, tag="impedance"):
    """A target impedance in x [m], y [m] and phi [rad]."""

    shares_loop: ClassVar[bool] = True

    mass: PositiveTriple = (5.0, 11.0, 0.25)
    damping: NotNegativeTriple = (600.0, 880.0, 20.0)
    stiffness: NotNegativeTriple = (2000.0, 4400.0, 100.0)
    beyond: float = 0.0138
    """How far beyond the wall the desired x lies [m]."""

    def build(self, tick: float, wall: float) -> Impedance:
        """The part, for a time between ticks [s] and a surface at x = `wall` [m]."""
        target = Vec3(float(wall + self.beyond), 0.0, 0.0)
        return Impedance(triple(self.mass), triple(self.damping), triple(self.stiffness), target)
