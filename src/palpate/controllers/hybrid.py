"""Position control, and hybrid control of position and force, with the robot's dynamics (thesis, sec. 4.3, 4.4).

Raibert and Craig, 1981; Khatib, 1987.
"""

from typing import ClassVar, Literal, NamedTuple

from palpate._jit import law, part
from palpate._vector import ZERO3, Vec3, resolve
from palpate.controllers.controller import ControllerTable, controller
from palpate.signals.types import NotNegative, Positive, alike


@law
def position_command(kp, kv, x, xd, x_d, xd_d, xdd_d):  # (4.11)
    """Task acceleration that draws the pose to the desired one [m/s^2, rad/s^2]."""
    return xdd_d + kv * (xd_d - xd) + kp * (x_d - x)


@law
def resolved_acceleration(J, Jdqd, M, h, u_x):  # (4.10), friction aside
    """Torque that gives the task acceleration u_x, were the model perfect [N m]."""
    return M @ resolve(J, u_x - Jdqd, M) + h


@part
class ResolvedAcceleration(NamedTuple):
    """Draws the pose to the desired one; knows no force.

    Args:
        kp: position gain K_pp [1/s^2], shape (m,).
        kv: velocity gain K_pv [1/s]; at least 2 sqrt(kp) for no overshoot (4.12).
    """

    kp: Vec3
    kv: Vec3

    def start(self):
        return 0.0

    def step(self, state, sense, task, model):
        u_x = position_command(self.kp, self.kv, sense.x, sense.xd, task.x, task.xd, task.xdd)
        return resolved_acceleration(model.J, model.Jdqd, model.M, model.h, u_x), state


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
