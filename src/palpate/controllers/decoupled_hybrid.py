"""Hybrid control that decouples force from position by the identified stiffness (thesis, sec. 4.4)."""

from typing import ClassVar, Literal, NamedTuple

from palpate._jit import law
from palpate._vector import Vec3
from palpate.controllers.controller import ControllerTable, controller
from palpate.controllers.resolved_acceleration import position_command, resolved_acceleration
from palpate.signals.types import NotNegative, Positive, alike


@law
def decoupled_hybrid(J, Jdqd, M, h, s, u_x, u_f, f):  # (4.19), friction aside
    """Torque for the task acceleration u_x where s is 0 and u_f where s is 1, against the wrench f [N m]."""
    return resolved_acceleration(J, Jdqd, M, h, (1.0 - s) * u_x + s * u_f) + J.T @ f


@controller
class DecoupledHybrid(NamedTuple):
    """Accelerations in every direction, so that no direction's command moves another.

    With the measured wrench compensated the arm obeys xdd = u_x along the surface and xdd = u_f into it. On a spring
    K_e the force then follows f'' = K_e u_f, which `corrected` makes f'' = kf (f_d - f) - kfv f', by itself.

    Args:
        kp: position gain K_pp [1/s^2], shape (m,).
        kv: velocity gain K_pv [1/s], shape (m,).
        force_gain: acceleration for a force error [m/(s^2 N)], shape (m,).
        rate_gain: acceleration against a velocity [1/s], shape (m,): K_e times the velocity is the force's rate.
        measured: 1.0 compensates the measured wrench, 0.0 feeds the desired one forward.
    """

    kp: Vec3
    kv: Vec3
    force_gain: Vec3
    rate_gain: Vec3
    measured: float

    @classmethod
    def corrected(cls, kp, kv, kf, kfv, stiffness):
        """The law that decouples: u_f = (kf (f_d - f) - kfv K_e xd) / K_e; the desired force is taken as constant.

        Args:
            kp: position gain [1/s^2].
            kv: velocity gain [1/s].
            kf: force gain [1/s^2].
            kfv: force-rate gain [1/s]; 2 sqrt(kf) damps critically.
            stiffness: K_e [N/m].
        """
        return cls(kp, kv, kf / stiffness, kfv, 1.0)

    @classmethod
    def printed(cls, kp, kv, kf, stiffness):
        """(4.19)-(4.21) to the letter: K_e multiplies, nothing damps, f_d is fed forward.

        Its kf would have the unit m^2/(s^2 N^2); for the loop gain of `corrected` it is kf / K_e^2.
        """
        return cls(kp, kv, kf * stiffness, 0.0 * kv, 0.0)

    def start(self):
        return 0.0

    def step(self, state, sense, task, model):
        u_x = position_command(self.kp, self.kv, sense.x, sense.xd, task.x, task.xd, task.xdd)
        u_f = self.force_gain * (task.f - sense.f) + self.rate_gain * (task.xd - sense.xd)
        f = self.measured * sense.f + (1.0 - self.measured) * (task.s * task.f)
        return decoupled_hybrid(model.J, model.Jdqd, model.M, model.h, task.s, u_x, u_f, f), state


class DecoupledHybridController(ControllerTable, tag="decoupled-hybrid"):
    """Force and position by accelerations, with the identified stiffness of the surface."""

    shares_loop: ClassVar[bool] = True

    stiffness: Positive
    """K_e [N/m]."""
    form: Literal["corrected", "printed"] = "corrected"
    """The printed one multiplies by K_e, damps nothing and feeds the desired force forward."""
    kp: NotNegative = 400.0
    kv: NotNegative = 80.0
    kf: NotNegative = 3000.0
    """[1/s^2]; as printed it multiplies K_e."""
    kfv: NotNegative = 110.0
    """Of the force's rate [1/s]; not used as printed."""

    def build(self, tick: float, wall: float) -> DecoupledHybrid:
        """The part, for a time between ticks [s] and a surface at x = `wall` [m]."""
        kp, kv, kf = alike(self.kp), alike(self.kv), alike(self.kf)
        if self.form == "printed":
            return DecoupledHybrid.printed(kp, kv, kf, float(self.stiffness))
        return DecoupledHybrid.corrected(kp, kv, kf, alike(self.kfv), float(self.stiffness))
