"""Recursive least squares against the batch solution, another library, and a million idle samples."""

import numpy as np
import pytest

from palpate._vector import Mat3, Vec3
from palpate.errors import InputError
from palpate.identifiers import RecursiveLeastSquares
from palpate.identifiers.estimator import Exponential, SIFt
from palpate.identifiers.least_squares import LeastSquares, learn_sample, unsure

SIZES = [3, 4, 5]  # three and four parameters go by value, other numbers by array


def problem(n, samples=400, seed=0, noise=0.5):
    """Regressors (samples, n) of unlike scales, forces (samples,), and the truth."""
    random = np.random.default_rng(seed)
    phi = random.standard_normal((samples, n)) * 10.0 ** np.linspace(0, -2, n)
    truth = random.uniform(-3, 3, n) / 10.0 ** np.linspace(0, -2, n)
    return phi, phi @ truth + noise * random.standard_normal(samples), truth


def spread_of(n, scale=1e3):
    """A covariance that is no multiple of the identity."""
    root = np.random.default_rng(9).standard_normal((n, n)) + 2.0 * np.eye(n)
    return scale * root @ root.T


def regularised(phi, y, theta, P, forgetting=1.0):
    """The minimum of sum lam^(N-k) e_k^2 + lam^N (t - theta)^T P^-1 (t - theta), and the inverse of its Hessian."""
    age = forgetting ** np.arange(len(y) - 1, -1, -1.0)
    prior = forgetting ** len(y) * np.linalg.inv(P)
    information = (age[:, None] * phi).T @ phi + prior
    return np.linalg.solve(information, (age * y) @ phi + prior @ theta), np.linalg.inv(information)


@pytest.mark.parametrize("forgetting", [1.0, 0.995])
@pytest.mark.parametrize("n", SIZES)
def test_it_is_the_regularised_batch_solution(n, forgetting):
    phi, y, _ = problem(n)
    start, P = np.linspace(-1, 1, n), spread_of(n)
    estimator = RecursiveLeastSquares(start, P, forgetting)
    estimator.update_many(phi, y)
    theta, covariance = regularised(phi, y, start, P, forgetting)
    np.testing.assert_allclose(estimator.theta, theta, rtol=1e-9)
    np.testing.assert_allclose(estimator.covariance, covariance, rtol=1e-7, atol=1e-12 * covariance.max())


@pytest.mark.parametrize("n", SIZES)
def test_it_is_padasips(n):
    padasip = pytest.importorskip("padasip")
    phi, y, _ = problem(n, samples=300)
    start = np.linspace(-1, 1, n)
    theirs = padasip.filters.FilterRLS(n, mu=0.98, eps=0.01, w=start.copy())
    ours = RecursiveLeastSquares(start, 100.0 * np.eye(n), 0.98)
    for regressor, force in zip(phi, y, strict=True):
        theirs.adapt(force, regressor)
        ours.update(regressor, force)
    np.testing.assert_allclose(ours.theta, theirs.w, rtol=1e-9)
    np.testing.assert_allclose(ours.covariance, theirs.R, rtol=1e-6, atol=1e-12)


@pytest.mark.parametrize("forgetting", [1.0, 0.97])
@pytest.mark.parametrize("n", [1, 2, 3, 5])
def test_many_updates_are_updates_one_by_one_to_the_bit(n, forgetting):
    phi, y, _ = problem(n)
    one, many, mixed = (RecursiveLeastSquares(np.zeros(n), spread_of(n), forgetting) for _ in range(3))
    for regressor, force in zip(phi, y, strict=True):
        one.update(regressor, force)
    many.update_many(phi, y)
    mixed.update_many(phi[:150], y[:150])
    mixed.update(phi[150], y[150])
    mixed.update_many(np.asfortranarray(phi[151:]), y[151:])
    for other in (many, mixed):
        np.testing.assert_array_equal(one.theta, other.theta)
        np.testing.assert_array_equal(one.covariance, other.covariance)
        np.testing.assert_array_equal(one.estimate().covariance, other.estimate().covariance)


class NumPy:
    """The size of laws that run on plain arrays."""

    def __init__(self, n):
        self.n = n

    def identity(self):
        return np.eye(self.n)


POLICIES = [Exponential(0.99), SIFt(0.98)]


@pytest.mark.parametrize(
    ("n", "policy"),
    [
        *((3, policy) for policy in POLICIES),
        (4, POLICIES[0]),
        (5, POLICIES[0]),
        *(
            pytest.param(4, policy, marks=pytest.mark.long) for policy in POLICIES[1:]
        ),  # seconds to compile, each
    ],
    ids=lambda p: p if isinstance(p, int) else type(p).__name__,
)
def test_laws_mean_the_same_on_values_and_arrays(n, policy):
    """The laws on plain arrays, stepped, are the compiled estimator."""
    phi, y, _ = problem(n, samples=250)
    theta, P = np.zeros(n), 1e4 * np.eye(n)
    estimator = RecursiveLeastSquares(theta, P, policy)
    estimator.update_many(phi, y)
    S, doubt, floor = 100.0 * np.eye(n), unsure(theta, 100.0 * np.eye(n), np.eye(n)), np.full(n, 1e-4)
    for regressor, force in zip(phi, y, strict=True):
        S, _ = policy.forget(S, regressor, floor)
        theta, S, doubt, _, _ = learn_sample(theta, S, doubt, regressor, force, policy.keep, NumPy(n))
    np.testing.assert_allclose(estimator.theta, theta, rtol=1e-9)
    np.testing.assert_allclose(estimator.covariance, S @ S.T, rtol=1e-8, atol=1e-12 * (S @ S.T).max())
    np.testing.assert_allclose(estimator.estimate().covariance, doubt.covariance(n), rtol=1e-7)


def textbook_step(theta, P, phi, force, forgetting):
    """One sample on the covariance itself: equations 5.7 to 5.10 of the thesis, by the matrix inversion lemma."""
    seen = P @ phi
    scale = 1.0 / (forgetting + phi @ seen)
    innovation = force - phi @ theta
    return theta + seen * (scale * innovation), (P - scale * np.outer(seen, seen)) / forgetting


def test_a_vague_start_costs_the_root_half_the_digits():
    """Twelve decades from the start to the end: six are lost from P as from the textbook's form, three from S."""
    phi = np.ones((500, 3)) + 1e-2 * np.random.default_rng(0).standard_normal((500, 3))
    theta, P = np.zeros(3), 1e12 * np.eye(3)
    root = RecursiveLeastSquares(theta, P)
    root.update_many(phi, np.ones(500))
    for regressor in phi:
        theta, P = textbook_step(theta, P, regressor, 1.0, 1.0)
    _, s, V = np.linalg.svd(np.vstack([phi, 1e-6 * np.eye(3)]))  # never squares a number
    exact = (V.T / s**2) @ V
    plain, ours = (np.abs(C - exact).max() / exact.max() for C in (P, root.covariance))
    assert ours < 1e-11
    assert plain > 1e3 * ours


def test_the_part_for_kernels_is_the_streaming_estimator():
    phi, y, _ = problem(3)
    P = spread_of(3)
    streaming = RecursiveLeastSquares(np.zeros(3), P, 0.99)
    part = LeastSquares(Vec3(0.0, 0.0, 0.0), Mat3(*(Vec3(*map(float, row)) for row in P)), 0.99)
    state = part.start()
    for regressor, force in zip(phi, y, strict=True):
        streaming.update(regressor, force)
        theta, state = part.step(state, Vec3(*map(float, regressor)), float(force))
    np.testing.assert_array_equal(np.array(theta), streaming.theta)
    np.testing.assert_allclose(np.array(state.root @ state.root.T), streaming.covariance, rtol=1e-15)
    np.testing.assert_allclose(np.array(state.std()), streaming.estimate().std, rtol=1e-12)


def coloured(rng, samples, pole):
    """First-order noise of variance 1."""
    from scipy.signal import lfilter

    white = rng.standard_normal(samples + 200)
    return lfilter([np.sqrt(1 - pole**2)], [1, -pole], white)[200:]


@pytest.mark.parametrize("pole", [0.0, 0.8, 0.95], ids=["white", "coloured", "very coloured"])
def test_the_stated_interval_covers_the_truth_as_often_as_it_says(pole):
    """Slow and fast regressors under coloured noise: one correction for all would be wrong for one of them."""
    rng = np.random.default_rng(3)
    samples, runs = 6000, 120
    slow, fast = coloured(rng, samples, 0.98), rng.standard_normal(samples)
    phi = np.column_stack([slow, fast, np.ones(samples)])
    truth = np.array([2.0, -1.0, 0.5])
    z = []
    for _ in range(runs):
        estimator = RecursiveLeastSquares(np.zeros(3), 1e8 * np.eye(3))
        estimator.update_many(phi, phi @ truth + coloured(rng, samples, pole))
        estimate = estimator.estimate()
        z.append((estimate.theta - truth) / estimate.std)
    spread = np.std(z, axis=0)
    # With 120 runs the spread itself is known to 6.5 %; blocks of 100 lose up to 1/6 at pole 0.95,
    # and four blocks of caution in sixty cost the fast regressor up to a factor of 2 there.
    assert np.all(spread > 0.5), spread
    assert np.all(spread < 1.3), spread
    covered = np.mean(np.abs(z) < 1.96, axis=0)
    assert np.all(covered > 0.89), covered


def test_little_data_make_a_wide_interval():
    """A moment's data under coloured noise must not look precise."""
    rng = np.random.default_rng(5)
    phi = np.column_stack([coloured(rng, 60, 0.95), coloured(rng, 60, 0.95), np.ones(60)])
    z = []
    for _ in range(200):
        estimator = RecursiveLeastSquares(np.zeros(3), 1e8 * np.eye(3))
        estimator.update_many(phi, coloured(rng, 60, 0.95))
        estimate = estimator.estimate()
        z.append(estimate.theta / estimate.std)
    assert np.median(np.abs(z)) < 1.3


def test_the_callers_arrays_stay_the_callers():
    theta, P = np.ones(3), np.eye(3)
    estimator = RecursiveLeastSquares(theta, P)
    estimator.update([1.0, 2.0, 3.0], 4.0)
    np.testing.assert_array_equal(theta, np.ones(3))
    np.testing.assert_array_equal(P, np.eye(3))
    theta[:] = 9.0
    assert estimator.theta[0] != 9.0


BAD_STARTS = {
    "theta in two dimensions": ((np.zeros((3, 1)), np.eye(3)), r"shape \(k,\)"),
    "covariance as a vector": ((np.zeros(3), np.ones(3)), r"shape \(3, 3\)"),
    "complex theta": ((np.zeros(3, complex), np.eye(3)), "real numbers"),
    "complex covariance": ((np.zeros(3), 1j * np.eye(3)), "real numbers"),
    "covariance beyond any": ((np.zeros(3), 1e300 * np.eye(3)), "1e-60 to 1e60"),
    "covariance below any": ((np.zeros(3), 1e-300 * np.eye(3)), "1e-60 to 1e60"),
    "theta beyond any": (([1e31, 0.0, 0.0], np.eye(3)), "up to 1e30"),
    "covariance zero": ((np.zeros(3), np.zeros((3, 3))), "positive definite"),
    "covariance skew": ((np.zeros(2), [[1.0, 0.5], [0.1, 1.0]]), "symmetric"),
    "forgetting zero": ((np.zeros(3), np.eye(3), 0.0), r"in \(0, 1\], got 0.0"),
    "forgetting above one": ((np.zeros(3), np.eye(3), 1.2), r"in \(0, 1\], got 1.2"),
    "forgetting not a number": ((np.zeros(3), np.eye(3), np.nan), r"in \(0, 1\], got nan"),
    "too few names": ((np.zeros(3), np.eye(3), 1.0, ("K", "B")), "2 names for 3"),
}


@pytest.mark.parametrize(("arguments", "told"), BAD_STARTS.values(), ids=BAD_STARTS)
def test_a_bad_start_is_refused(arguments, told):
    with pytest.raises(InputError, match=told):
        RecursiveLeastSquares(*arguments)


@pytest.mark.parametrize(
    ("phi", "y"),
    [(np.zeros((4, 2)), np.zeros(4)), (np.zeros((4, 3)), np.zeros(3)), (np.zeros(3), np.zeros(1))],
    ids=["width", "length", "one row without its frame"],
)
def test_many_samples_of_a_wrong_shape_are_refused(phi, y):
    estimator = RecursiveLeastSquares(np.ones(3), np.eye(3))
    with pytest.raises(InputError, match=r"of shape \((k, 3|4,)\)"):
        estimator.update_many(phi, y)
    np.testing.assert_array_equal(estimator.theta, np.ones(3))
