"""Chapter 5 and what chapter 6 feeds it."""

import numpy as np

from errata.page import fails, holds
from palpate.identifiers import RecursiveLeastSquares

M, B, K = 0.1, 200.0, 5200.0


def press(n=400, seed=0, noise=0.05):
    """A seeded press on a Kelvin-Voigt surface: regressors (a, v, x), shape (n, 3), and noisy forces."""
    generator, t = np.random.default_rng(seed), 1e-3 * np.arange(n)
    x = 2e-3 + sum(1e-4 / w * np.sin(w * t + w) * 40 for w in (9.0, 31.0, 77.0))
    v, a = np.gradient(x, t), np.gradient(np.gradient(x, t), t)
    regressors = np.stack([a, v, x], axis=-1)
    return regressors, regressors @ [M, B, K] + noise * generator.standard_normal(n)


def recursion(regressors, forces, theta, P):
    """(5.7) to (5.10), as they stand."""
    for phi, f in zip(regressors, forces, strict=True):
        P = np.linalg.inv(np.linalg.inv(P) + np.outer(phi, phi))
        theta = theta + P @ phi * (f - phi @ theta)
    return theta


def test_E43_recursive_least_squares():
    regressors, forces = press()
    theta, P = np.array([0.0, 0.0, 2e4]), np.diag([1e2, 1e6, 1e10])
    information = np.linalg.inv(P)
    batch = np.linalg.solve(
        information + regressors.T @ regressors, information @ theta + regressors.T @ forces
    )
    holds(recursion(regressors, forces, theta, P) / batch - 1.0, 1e-6)
    streaming = RecursiveLeastSquares(theta, P)
    for phi, f in zip(regressors, forces, strict=True):
        streaming.update(phi, f)
    holds(streaming.theta / batch - 1.0, 1e-6)


def test_E44_the_regressors_are_stacked_the_other_way():
    regressors, forces = press(50)
    printed = regressors.T  # the definition names the transpose, so Phi has a column a sample
    fails(len(printed.T @ printed) - np.linalg.matrix_rank(printed.T @ printed), 40)
    Phi = regressors
    scale = np.linalg.norm(Phi, axis=0)
    holds(3 - np.linalg.matrix_rank((Phi / scale).T @ (Phi / scale)), 0)
    holds(np.linalg.solve(Phi.T @ Phi, Phi.T @ forces)[2] / K - 1.0, 0.01)


def test_E45_two_initial_stiffnesses():
    """After 0.12 s they have given the same answer, unless P(0) says that the start is known."""
    regressors, forces = press(120)

    def apart(P0):
        runs = [recursion(regressors, forces, np.array([0.0, 0.0, k]), P0 * np.eye(3)) for k in (2e5, 2e4)]
        return (runs[0] - runs[1])[2] / K

    holds(apart(1e10), 1e-3)
    assert abs(apart(1.0)) > 1.0


def force(x, v, a):
    return M * a + B * v + K * x


def test_E46_a_micrometre_for_a_millimetre():
    """B by probing: the force of 1 mm is taken off again, so 1 mm must have gone in."""
    off = force(1e-3, 0.0, 0.0)
    holds((force(1e-3, 0.01, 0.0) - off) / 0.01 / B - 1.0, 1e-12)
    fails((force(1e-6, 0.01, 0.0) - off) / 0.01 / B - 1.0, 2.0)


def test_E47_ten_metres_a_second():
    """M by probing: the force of 2 mm and 10 mm/s is taken off again."""
    off = force(2e-3, 0.01, 0.0)
    holds((force(2e-3, 0.01, 1.0) - off) / M - 1.0, 1e-9)
    fails((force(2e-3, 10.0, 1.0) - off) / M - 1.0, 1e4)


def test_E48_displacement_from_the_5_newton_point():
    """A spring pressed from 5 to 20 N: the force counts from the surface, the way only from 5 N on."""
    x = np.linspace(5.0, 20.0, 200) / K
    whole, way = K * x, x - x[0]
    fails(whole[-1] / way[-1] / K - 1.0, 0.33)
    holds((whole[-1] - whole[0]) / way[-1] / K - 1.0, 1e-12)
    # An offset in the regressor serves as well: [x, 1].
    fitted = np.linalg.lstsq(np.stack([way, np.ones_like(way)], axis=-1), whole, rcond=None)[0]
    holds(fitted / [K, 5.0] - 1.0, 1e-9)
