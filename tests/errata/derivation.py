"""The arm from first principles, with nothing of the package but its numbers; and states to try formulas on."""

from __future__ import annotations

import numpy as np

from palpate.robots import Arm3

ARM = Arm3()
LENGTH, MASS, COM, MOMENT = (np.array(v) for v in ARM[:4])
START = np.array([-0.5377671, 1.3205011, -0.7827340])
"""Joint angles at which the listing starts [rad]."""


def states(n: int = 40, seed: int = 1):
    """Random q [rad], qd [rad/s], qdd [rad/s^2], each of shape (n, 3); joint 2 never straight."""
    generator = np.random.default_rng(seed)
    q = generator.uniform(-np.pi, np.pi, (n, 3))
    q[:, 1] = np.sign(q[:, 1]) * generator.uniform(0.4, 2.7, n)
    return q, generator.uniform(-3.0, 3.0, (n, 3)), generator.uniform(-20.0, 20.0, (n, 3))


def pose(q):
    """Tip pose: the three links laid one after the other."""
    t = np.cumsum(q)
    return np.array([LENGTH @ np.cos(t), LENGTH @ np.sin(t), t[2]])


def derivative(function, q, h: float = 1e-30):
    """Complex-step derivative of a real-analytic function along each joint: exact to rounding; last axis the joint."""
    columns = [np.imag(function(q + 1j * h * e)) / h for e in np.eye(3)]
    return np.stack(columns, axis=-1)


def mass_matrix(q):
    """Sum over the links of m Jc^T Jc + I w w^T, Jc the Jacobian of the centre of mass and w = dt/dq."""
    t = np.cumsum(q)
    M = np.zeros((3, 3), dtype=t.dtype)
    for i in range(3):
        arms = np.where(np.arange(3) < i, LENGTH, np.where(np.arange(3) == i, LENGTH + COM, 0.0))
        chain = np.tril(np.ones((3, 3)))  # dt_k/dq_j
        jx, jy = (-arms * np.sin(t)) @ chain, (arms * np.cos(t)) @ chain
        M = M + MASS[i] * (np.outer(jx, jx) + np.outer(jy, jy)) + MOMENT[i] * np.outer(chain[i], chain[i])
    return M


def bias_torque(q, qd):
    """Lagrange: Mdot qd - d(qd^T M qd / 2)/dq."""
    dM = derivative(mass_matrix, q)
    return (dM @ qd) @ qd - 0.5 * np.einsum("ijk,i,j->k", dM, qd, qd)


def torque(q, qd, qdd):
    """Joint torques of a motion in free motion."""
    return mass_matrix(q) @ qdd + bias_torque(q, qd)


def on_states(function, *arrays):
    """The function on each state, stacked."""
    return np.array([function(*row) for row in zip(*arrays, strict=True)])
