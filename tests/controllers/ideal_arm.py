"""The thesis' arm without friction, with perfect senses, on a spring: what a law's closed form may be held against."""

import numpy as np
from scipy.integrate import solve_ivp

from palpate._vector import ZERO3, Vec3, solve
from palpate.robots.arm3 import Arm3
from palpate.signals.types import Sense, Task

ARM = Arm3()
START = Vec3(0.454, 0.0, 0.0)
INTO = Vec3(1.0, 0.0, 0.0)


def task(force, y=0.0, selection=INTO):
    """Press with this force [N] along x, at this y [m]."""
    return Task(Vec3(START.x, y, 0.0), ZERO3, ZERO3, Vec3(force, 0.0, 0.0), selection)


def press(controller, asked, stiffness, duration=0.5, samples=501):
    """A controller without memory, in continuous time, on a spring that is slack at the start.

    Returns:
        Time (n,), poses (n, 3), their rates (n, 3), force on the spring (n,).
    """

    def feel(q, qd):
        model, x = ARM.model(q, qd), ARM.pose(q)
        f = Vec3(stiffness * (x.x - START.x), 0.0, 0.0)
        return model, Sense(q, qd, x, model.J @ qd, f)

    def rates(_, z):
        q, qd = Vec3(*z[:3].tolist()), Vec3(*z[3:].tolist())
        model, sense = feel(q, qd)
        torque, _ = controller.step(controller.start(), sense, asked, model)
        qdd = solve(model.M, torque - model.h - model.J.T @ sense.f)
        return [*qd, *qdd]

    t = np.linspace(0.0, duration, samples)
    z0 = [*ARM.inverse(START, 1.0), 0.0, 0.0, 0.0]
    z = solve_ivp(rates, (0.0, duration), z0, "DOP853", t, rtol=1e-10, atol=1e-12).y.T
    senses = [feel(Vec3(*row[:3]), Vec3(*row[3:]))[1] for row in z]
    return (
        t,
        *(np.array([list(getattr(s, name)) for s in senses]) for name in ("x", "xd")),
        np.array([s.f.x for s in senses]),
    )
