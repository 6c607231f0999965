"""Parts of a user's, good ones and bad ones, as text and as a module that experiments name."""

from typing import NamedTuple

import numpy as np

from palpate.bench import Vec3
from palpate.environments.surface import UNTOUCHED, SurfaceState
from palpate.identifiers import Estimate


class Push(NamedTuple):
    """Presses with the desired force and an integral of its error."""

    ki: float = 3.0
    hold: Vec3 = Vec3(0.0, 2000.0, 1.0)
    tick: float = 1e-3

    def start(self):
        return 0.0

    def step(self, state, sense, task, model):
        integral = state + self.ki * self.tick * (task.f.x - sense.f.x)
        hold = self.hold * (task.x - sense.x - 0.04 * sense.xd)
        return model.J.T @ Vec3(task.f.x + integral - 40.0 * sense.xd.x, hold.y, hold.z) + model.h, integral


class Spring(NamedTuple):
    """A spring with a damper, without mass."""

    stiffness: float
    damping: float = 100.0
    mass: float = 0.0

    def start(self):
        return UNTOUCHED

    def force(self, state, p, v):
        return self.stiffness * p + self.damping * v

    def relax(self, state, p, v, dt):
        return SurfaceState(p, v, 0.0, 1.0)

    def free(self, state, dt):
        s = state.deflection / (1.0 + dt * self.stiffness / self.damping)
        return SurfaceState(s, (s - state.deflection) / dt, 0.0, 0.0)

    def stored_energy(self, state):
        return 0.5 * self.stiffness * state.deflection**2


class Rigid(NamedTuple):
    """A spring whose number has another name."""

    k: float = 1e5
    mass: float = 0.0

    def start(self):
        return UNTOUCHED

    def force(self, state, p, v):
        return self.k * p

    def relax(self, state, p, v, dt):
        return SurfaceState(p, v, 0.0, 1.0)

    def free(self, state, dt):
        return SurfaceState(0.0, 0.0, 0.0, 0.0)


class Normal:
    """Least squares by the normal equations."""

    def __init__(self, keep=1.0):
        self.A, self.b, self.keep, self.n = np.eye(3) * 1e-9, np.zeros(3), keep, 0

    def update(self, regressor, force):
        phi, y = np.asarray(regressor, float), float(force)
        if phi.shape != (3,) or not (np.isfinite(phi).all() and np.isfinite(y)):
            raise ValueError("three finite numbers and a force")
        self.A, self.b = self.keep * self.A + np.outer(phi, phi), self.keep * self.b + phi * y
        self.n += 1

    def estimate(self):
        P = np.linalg.inv(self.A)
        return Estimate(("M", "B", "K"), P @ self.b, P if self.n else 1e9 * P, float(self.n))


def mean_force(look):
    """Mean of the true force."""
    return float(np.mean(look["force"]))


STEP = "    def step(self, state, sense, task, model):\n"
HEAD = "from typing import NamedTuple\nfrom palpate.bench import Vec3\n"
CLASS = "class Bad(NamedTuple):\n    ki: float = 1.0\n    def start(self):\n        return 0.0\n"


def controller(body, extra=""):
    """The source of a controller `Bad` with this body of its step."""
    return f"{HEAD}{extra}{CLASS}{STEP}        {body}\n"
