"""Closed loops to judge printed control laws by: linearised, delayed, and an approach to a wall."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from errata.derivation import START
from palpate._vector import Vec3, clip
from palpate.robots import Arm3, Planar3R

ROBOT = Planar3R()
KP, KV = 400.0, 80.0
FOAM = (5200.0, 200.0)
"""K [N/m] and B [N s/m] of a foam: chosen, the thesis gives none."""
TIP_MASS = 11.2
"""What the arm weighs in the direction of x where the listing starts [kg]."""


class Model(NamedTuple):
    """What a control law may know at a state."""

    J: np.ndarray
    Jdqd: np.ndarray
    M: np.ndarray
    h: np.ndarray


def model(q, qd) -> Model:
    return Model(
        ROBOT.jacobian(q), ROBOT.jacobian_dot(q, qd) @ qd, ROBOT.mass_matrix(q), ROBOT.bias_torque(q, qd)
    )


def tip_acceleration(q, qd, torque, wrench=0.0):
    """Of the arm under a joint torque while it exerts a wrench."""
    at = model(q, qd)
    return at.J @ ROBOT.forward_dynamics(q, qd, torque, wrench) + at.Jdqd


def growth(law: Callable[[Model, np.ndarray], np.ndarray]) -> float:
    """Largest real part [1/s] of the poles of position control at the start pose: above 0 it runs away.

    Args:
        law: torque from the model and the commanded tip acceleration u_x.
    """
    target = ROBOT.forward_kinematics(START)

    def flow(s):
        q, qd = s[:3], s[3:]
        at = model(q, qd)
        u_x = KP * (target - ROBOT.forward_kinematics(q)) - KV * at.J @ qd
        return np.concatenate([qd, ROBOT.forward_dynamics(q, qd, law(at, u_x))])

    rest, h = np.concatenate([START, np.zeros(3)]), 1e-6
    A = np.array([(flow(rest + h * e) - flow(rest - h * e)) / (2 * h) for e in np.eye(6)]).T
    return float(np.linalg.eigvals(A).real.max())


def delayed_radius(A, B, C, lag: int, tick: float = 1e-3) -> float:
    """Spectral radius of x' = A x + B u, u = -C x late by `lag` ticks and held for one: above 1 it is unstable."""
    from scipy.linalg import expm

    n = len(A)
    block = expm(tick * np.block([[A, B], [np.zeros((1, n + 1))]]))
    Ad, Bd = block[:n, :n], block[:n, n:]
    F = np.zeros((n + lag, n + lag))
    F[:n, :n] = Ad
    if lag == 0:
        F[:n, :n] -= Bd @ C
    else:
        F[:n, -1:] = Bd
        F[n : n + 1, :n] = -C
        F[n + 1 :, n:-1] = np.eye(lag - 1)
    return float(np.abs(np.linalg.eigvals(F)).max())


class Approach(NamedTuple):
    x: float  # the furthest tip [m]
    force: float  # the largest contact force [N]
    reached: bool  # whether 5 N were
    sane: bool  # the arm stayed where an arm can be


def approach(law, gate: bool = False, seconds: float = 5.0) -> Approach:
    """The listing's approach without friction: x_d a millimetre further each second, a foam wall at 455.5 mm.

    Args:
        law: torque from the arm's model (J, Jdqd, M, h) and the commanded tip acceleration.
        gate: the torque goes out only after 5 N were felt.
        seconds: at most.
    """
    arm, dt, steps = Arm3(), 1e-3, 2
    q, qd, force, contact, far, most = Vec3(*START), Vec3(0.0, 0.0, 0.0), 0.0, False, 0.0, 0.0
    for k in range(round(seconds / dt)):
        at, x = arm.model(q, qd), arm.pose(q)
        x_d = Vec3(0.456 + 1e-3 * int(k * dt), 0.0, 0.0)
        contact = contact or force >= 5.0
        u_x = KP * (x_d - x) - KV * (at.J @ qd)
        torque = Vec3(0.0, 0.0, 0.0) if gate and not contact else clip(law(at, u_x), arm.limits)
        for _ in range(steps):
            x, rate = arm.pose(q), arm.jac(q) @ qd
            deep = x.x - 0.4555
            force = max(FOAM[0] * deep + FOAM[1] * rate.x, 0.0) if deep > 0.0 else 0.0
            qd = qd + (dt / steps) * arm.accelerations(q, qd, torque, Vec3(force, 0.0, 0.0))
            q = q + (dt / steps) * qd
        far, most = max(far, x.x), max(most, force)
        off = max(abs(x.x - x_d.x), abs(x.y))
        if contact or off > 0.05 or abs(x.z) > 0.5:
            return Approach(far, most, contact and off <= 0.05, off <= 0.05)
    return Approach(far, most, contact, True)
