"""A controller and a metric: a student's part of a study (19_your_controller_in_a_study.py)."""

from typing import NamedTuple

import numpy as np

from palpate.bench import Vec3, law
from palpate.studies import Metric


@law
def damped_push(f_d, integral, damping, rate):
    """Force command along the normal [N]."""
    return f_d + integral - damping * rate


class Damped(NamedTuple):
    """Presses with the desired force plus an integral of its error, damped in x; holds y and phi."""

    ki: float = 3.0  # [1/s]
    damping: float = 40.0  # [N s/m]
    kp: Vec3 = Vec3(0.0, 2000.0, 1.0)  # stiffness of what is held [N/m, N/m, N m/rad]
    tick: float = 1e-3  # [s], which the bench fills in

    def start(self):
        """The integral of the force's error [N]."""
        return 0.0

    def step(self, state, sense, task, model):
        integral = state + self.ki * self.tick * (task.f.x - sense.f.x)
        hold = self.kp * (task.x - sense.x - 0.04 * sense.xd)
        wrench = Vec3(damped_push(task.f.x, integral, self.damping, sense.xd.x), hold.y, hold.z)
        return model.J.T @ wrench + model.h, integral


def _jerk(look):
    return float(np.sqrt(np.mean(np.diff(look["force"]) ** 2)))


jerk = Metric("jerk", "N", "RMS of the true force's change from tick to tick", _jerk, better="least")
