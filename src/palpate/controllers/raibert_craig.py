"""The original hybrid position/force control, without dynamics (thesis, fig. 2.1; Raibert and Craig, 1981)."""

from typing import Any, ClassVar, NamedTuple

import numpy as np

from palpate._jit import law, part
from palpate._vector import Vec3, resolve
from palpate.controllers.controller import ControllerTable, controller
from palpate.signals.types import NotNegative, NotNegativeTriple, triple


@law
def joint_errors(J, M, s, x_e, xd_e, f_e):
    """Errors of the pose [m, rad], its rate and the wrench [N, N m], selected and carried to the joints.

    Returns:
        The joints' error of angle [rad], of rate [rad/s] and of torque [N m], each of shape (n,).
    """
    free = 1.0 - s
    return resolve(J, free * x_e, M), resolve(J, free * xd_e, M), J.T @ (s * f_e)


@part
class RaibertCraigState(NamedTuple):
    angle: Vec3  # integral of the joints' angle error [rad s], shape (n,)
    torque: Vec3  # integral of the joints' torque error [N m s], shape (n,)


@controller
class RaibertCraig(NamedTuple):
    """Selects errors at the tip, then controls each joint by itself: PID on angles, PI on torques.

    No inertia, no Coriolis torque: the joints disturb each other, and where inertia couples them strongly against
    the selection the loop is unstable for any gain (An and Hollerbach, 1987). `growth_rate` tells.

    Args:
        stiffness: gain of the angle error [N m/rad], shape (n,).
        damping: gain of its rate [N m s/rad], shape (n,).
        integral: gain of its integral [N m/(rad s)], shape (n,).
        kf: gain of the torque error [1].
        ki: gain of its integral [1/s].
        feed_forward: share of the desired wrench that is fed forward [1].
        tick: time between steps [s].
    """

    stiffness: Vec3
    damping: Vec3
    integral: Vec3
    kf: float
    ki: float
    feed_forward: float
    tick: float

    def start(self):
        """The state before the first error."""
        return RaibertCraigState(0.0 * self.stiffness, 0.0 * self.stiffness)

    def step(self, state, sense, task, model):
        q_e, qd_e, torque_e = joint_errors(
            model.J, model.M, task.s, task.x - sense.x, task.xd - sense.xd, task.f - sense.f
        )
        angle = state.angle + self.tick * q_e
        torque = state.torque + self.tick * torque_e
        position = self.stiffness * q_e + self.damping * qd_e + self.integral * angle
        force = self.kf * torque_e + self.ki * torque
        ahead = self.feed_forward * (model.J.T @ (task.s * task.f))
        return position + force + ahead, RaibertCraigState(angle, torque)


def growth_rate(controller: RaibertCraig, model: Any, s: Any) -> float:
    """How fast a small error of the free directions grows, the arm at rest and its force loop left out [1/s].

    Above 0 (and its rounding) the posture is kinematically unstable: M^-1 K J^-1 (I - S) J has an eigenvalue that no
    damping of the joints holds. 0 is the direction in which the force is controlled.

    Args:
        controller: its stiffness and damping count.
        model: the arm at the posture; as many joints as directions.
        s: selection, shape (m,).
    """
    J, M = np.array(model.J), np.array(model.M)
    free = np.linalg.solve(J, (1.0 - np.array(s))[:, None] * J)
    spring = np.linalg.solve(M, np.array(controller.stiffness)[:, None] * free)
    damper = np.linalg.solve(M, np.array(controller.damping)[:, None] * free)
    n = len(M)
    motion = np.block([[np.zeros((n, n)), np.eye(n)], [-spring, -damper]])
    return float(np.linalg.eigvals(motion).real.max())


class RaibertCraigController(ControllerTable, tag="raibert-craig"):
    """The original hybrid control: joint by joint, no dynamics. One number a joint."""

    shares_loop: ClassVar[bool] = True

    stiffness: NotNegativeTriple = (414.0, 47.0, 1.15)
    """[N m/rad]; 400 times each joint's own inertia where the thesis' arm starts."""
    damping: NotNegativeTriple = (83.0, 9.4, 0.23)
    """[N m s/rad]; 80 times."""
    integral: NotNegativeTriple = (0.0, 0.0, 0.0)
    """[N m/(rad s)]."""
    kf: NotNegative = 1.0
    ki: NotNegative = 3.0
    """[1/s]."""
    feed_forward: NotNegative = 1.0
    """Share of the desired force that is fed forward."""

    def build(self, tick: float, wall: float) -> RaibertCraig:
        """The part, for a time between ticks [s] and a surface at x = `wall` [m]."""
        stiffness, damping, integral = triple(self.stiffness), triple(self.damping), triple(self.integral)
        return RaibertCraig(
            stiffness, damping, integral, float(self.kf), float(self.ki), float(self.feed_forward), tick
        )
