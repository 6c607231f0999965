"""The arm from Lagrange's equations, by computer algebra; nothing here is taken from the package."""

from functools import cache

import numpy as np
import sympy as sp

Q = sp.symbols("q1:4")
QD = sp.symbols("qd1:4")
QDD = sp.symbols("qdd1:4")
LENGTH, MASS, COM, MOMENT = (sp.symbols(f"{name}1:4") for name in ("a", "m", "s", "I"))
PARAMETERS = (*LENGTH, *MASS, *COM, *MOMENT)


def numbers(arm):
    """The values of `PARAMETERS`."""
    return (*arm.length, *arm.mass, *arm.com, *arm.moment)


def rate(expression):
    """Total time derivative of an expression in q and qd."""
    return sum(sp.diff(expression, x) * xd for x, xd in zip((*Q, *QD), (*QD, *QDD), strict=True))


@cache
def tip():
    """Pose of the tip, (3, 1)."""
    t = [sum(Q[: i + 1]) for i in range(3)]
    x = sum(a * sp.cos(angle) for a, angle in zip(LENGTH, t, strict=True))
    y = sum(a * sp.sin(angle) for a, angle in zip(LENGTH, t, strict=True))
    return sp.Matrix([x, y, t[2]])


@cache
def kinetic_energy():
    total, x, y = 0, 0, 0
    for i in range(3):
        angle = sum(Q[: i + 1])
        r = LENGTH[i] + COM[i]
        centre = x + r * sp.cos(angle), y + r * sp.sin(angle)
        speed = sum(rate(c) ** 2 for c in centre)
        total += (MASS[i] * speed + MOMENT[i] * rate(angle) ** 2) / 2
        x, y = x + LENGTH[i] * sp.cos(angle), y + LENGTH[i] * sp.sin(angle)
    return total


@cache
def torque():
    """Euler-Lagrange: d/dt dT/dqd - dT/dq, (3, 1)."""
    T = kinetic_energy()
    return sp.Matrix([rate(sp.diff(T, qd)) - sp.diff(T, q) for q, qd in zip(Q, QD, strict=True)])


@cache
def functions():
    """Numerical functions of (q, qd, qdd, parameters): pose, J, Jdot, M, h, tau."""
    J, tau = tip().jacobian(Q), torque()
    M = tau.jacobian(QDD)
    h = tau.subs(dict.fromkeys(QDD, 0))
    expressions = {"pose": tip(), "J": J, "Jdot": J.applyfunc(rate), "M": M, "h": h, "tau": tau}
    return {
        name: sp.lambdify((Q, QD, QDD, PARAMETERS), e, "numpy", cse=True) for name, e in expressions.items()
    }


def evaluated(name, arm, q, qd=(0.0, 0.0, 0.0), qdd=(0.0, 0.0, 0.0)):
    """One of `functions` on one state; a column comes back as shape (3,)."""
    return np.squeeze(np.array(functions()[name](q, qd, qdd, numbers(arm)), dtype=float))
