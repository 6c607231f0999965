"""Appendix C and the kinematics of the listing."""

import numpy as np

from errata.derivation import LENGTH, derivative, on_states, pose, states
from errata.page import fails, holds
from palpate.robots import Planar3R

A1, A2, A3 = LENGTH
ROBOT = Planar3R()
Q, QD, _ = states()


def links(q):
    """Cosines and sines of the absolute angles."""
    t = np.cumsum(q)
    return np.cos(t), np.sin(t)


def eq_1_3(q):
    """Product of the links' homogeneous transformations."""
    T = np.eye(3)
    for angle, a in zip(q, LENGTH, strict=True):
        c, s = np.cos(angle), np.sin(angle)
        T = T @ np.array([[c, -s, a * c], [s, c, a * s], [0, 0, 1]])
    return T


def eq_1_8(x, y, phi):
    u, v = x - A3 * np.cos(phi), y - A3 * np.sin(phi)
    return np.arccos((u * u + v * v - A1**2 - A2**2) / (2 * A1 * A2))


def eq_1_9(x, y, phi, q2):
    k, m = -A1 - A2 * np.cos(q2), A2 * np.sin(q2)
    u, v = A3 * np.cos(phi) - x, A3 * np.sin(phi) - y
    return np.arctan2(v * k + u * m, u * k - v * m)


def inverse(target, elbow):
    q2 = elbow * eq_1_8(*target)
    q1 = eq_1_9(*target, q2)
    return np.array([q1, q2, target[2] - q1 - q2])


def eq_2_1(q):
    c, s = links(q)
    x, y = np.cumsum((-LENGTH * s)[::-1])[::-1], np.cumsum((LENGTH * c)[::-1])[::-1]
    return np.array([x, y, np.ones(3)])


def eq_2_2(q, first_of_element_22):
    (c1, c12, _), (s1, s12, _) = links(q)
    s2, s3, s23 = np.sin(q[1]), np.sin(q[2]), np.sin(q[1] + q[2])
    adjugate = [
        [A2 * c12, A2 * s12, A3 * A2 * s3],
        [-A2 * c12 - A1 * c1, -first_of_element_22 * s12 - A1 * s1, -A3 * (A2 * s3 + A1 * s23)],
        [A1 * c1, A1 * s1, A3 * A1 * s23 + A1 * A2 * s2],
    ]
    return np.array(adjugate) / (A1 * A2 * s2)


def eq_2_3(q, rates):
    """Each link's part of J turned by a right angle, times a rate of that link."""
    c, s = links(q)
    x, y = -LENGTH * rates * c, -LENGTH * rates * s
    return np.array([np.cumsum(x[::-1])[::-1], np.cumsum(y[::-1])[::-1], np.zeros(3)])


def test_E1_forward_kinematics():
    T = on_states(eq_1_3, Q)
    right = on_states(pose, Q)
    holds(T[:, :2, 2] - right[:, :2], 1e-14)
    holds(T[:, 0, 0] - np.cos(right[:, 2]), 1e-14)
    holds(ROBOT.forward_kinematics(Q) - right, 1e-14)


def test_E2_arccos_has_one_elbow():
    up, down = Q[Q[:, 1] > 0], Q[Q[:, 1] < 0]
    holds(on_states(lambda q: eq_1_8(*pose(q)) - q[1], up), 1e-12)
    holds(on_states(lambda q: -eq_1_8(*pose(q)) - q[1], down), 1e-12)
    fails(on_states(lambda q: eq_1_8(*pose(q)) - q[1], down), 0.8)  # both elbows reach, one is found


def test_E3_first_joint_angle():
    for elbow in (+1, -1):
        targets = on_states(pose, Q)
        holds(on_states(lambda p, e=elbow: pose(inverse(p, e)) - p, targets), 1e-13)


def test_E4_jacobian():
    holds(on_states(lambda q: eq_2_1(q) - derivative(pose, q), Q), 1e-14)


def test_E5_element_22_of_the_inverse_jacobian():
    right = on_states(lambda q: np.linalg.inv(derivative(pose, q)), Q)
    holds(on_states(lambda q: eq_2_2(q, A2), Q) - right, 1e-12)
    printed = on_states(lambda q: eq_2_2(q, A3), Q) - right
    fails(printed[:, 1, 1], 0.1)
    printed[:, 1, 1] = 0.0  # and nowhere else
    holds(printed, 1e-12)


def test_E6_jacobian_rate_without_joint_rates():
    h = 1e-6
    right = on_states(lambda q, qd: (eq_2_1(q + h * qd) - eq_2_1(q - h * qd)) / (2 * h), Q, QD)
    holds(on_states(lambda q, qd: eq_2_3(q, np.cumsum(qd)), Q, QD) - right, 1e-8)
    fails(on_states(lambda q, qd: eq_2_3(q, 1.0), Q, QD) - right, 0.5)
    # What is printed is dJ/dq1: the rate of J while joint 1 turns alone at 1 rad/s.
    alone = np.array([1.0, 0.0, 0.0])
    holds(on_states(lambda q: eq_2_3(q, 1.0) - eq_2_3(q, np.cumsum(alone)), Q), 1e-15)


def test_E7_subscripts_that_belong_on_the_line():
    def wrist(x, y, phi):
        return np.array([x - A3 * np.cos(phi), y - A3 * np.sin(phi)])

    def scanned(x, y, phi):
        return np.array([-A3 * np.cos(phi + x), -A3 * np.sin(phi + y)])

    right = on_states(lambda q: eq_1_3(q)[:2, 2] - A3 * eq_1_3(q)[:2, 0], Q)
    targets = on_states(pose, Q)
    holds(on_states(lambda p: wrist(*p), targets) - right, 1e-14)
    fails(on_states(lambda p: scanned(*p), targets) - right, 0.2)
