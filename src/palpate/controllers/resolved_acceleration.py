"""Position control of the approach: resolved acceleration (thesis, sec. 4.3)."""

from typing import NamedTuple

from palpate._jit import law, part
from palpate._vector import Vec3, resolve


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
