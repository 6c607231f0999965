"""The filter against its textbook, another library, and parameters that do walk."""

import numpy as np
import pytest

from palpate.errors import InputError
from palpate.identifiers import KalmanFilter, RecursiveLeastSquares

P0 = np.diag([100.0, 400.0, 25.0, 1.0])
DRIFT = np.array([0.1, 1.0, 5.0, 2.0])
PERIOD = 1e-2


def walk(n, samples, random, noise=0.6, drift=DRIFT):
    """Regressors, forces, and the parameters at the end."""
    theta = random.multivariate_normal(np.zeros(n), P0[:n, :n])
    steps = drift[:n] * np.sqrt(PERIOD) * random.standard_normal((samples, n))
    path = theta + np.cumsum(steps, axis=0)
    phi = random.standard_normal((samples, n))
    return phi, (phi * path).sum(axis=1) + random.normal(0.0, noise, samples), path[-1]


@pytest.mark.parametrize("n", [3, *(pytest.param(n, marks=pytest.mark.long) for n in (2, 4))])
def test_it_is_the_textbooks_filter(n):
    phi, force, _ = walk(n, 400, np.random.default_rng(n))
    P = P0[:n, :n] + 3.0
    kalman = KalmanFilter(np.zeros(n), P, DRIFT[:n], PERIOD, 0.6)
    kalman.update_many(phi, force)
    x = np.zeros(n)
    for row, f in zip(phi, force, strict=True):
        P = P + np.diag(DRIFT[:n] ** 2 * PERIOD)
        gain = P @ row / (0.36 + row @ P @ row)
        x, P = x + gain * (f - row @ x), P - np.outer(gain, row @ P)
    np.testing.assert_allclose(kalman.theta, x, rtol=1e-9)
    np.testing.assert_allclose(kalman.covariance, P, rtol=1e-8, atol=1e-12)


def test_it_is_filterpys():
    library = pytest.importorskip("filterpy.kalman")
    phi, force, _ = walk(3, 200, np.random.default_rng(9))
    theirs = library.KalmanFilter(dim_x=3, dim_z=1)
    theirs.P, theirs.F, theirs.Q = P0[:3, :3].copy(), np.eye(3), np.diag(DRIFT[:3] ** 2 * PERIOD)
    theirs.R *= 0.36
    ours = KalmanFilter(np.zeros(3), P0[:3, :3], DRIFT[:3], PERIOD, 0.6)
    for row, f in zip(phi, force, strict=True):
        theirs.H = row[None]
        theirs.predict()
        theirs.update(f)
        ours.update(row, f)
    np.testing.assert_allclose(ours.theta, theirs.x[:, 0], rtol=1e-9)
    np.testing.assert_allclose(ours.covariance, theirs.P, rtol=1e-8, atol=1e-12)


def test_without_drift_it_is_least_squares():
    phi, force, _ = walk(3, 300, np.random.default_rng(1), drift=0.0 * DRIFT)
    kalman = KalmanFilter(np.zeros(3), P0[:3, :3], np.zeros(3), PERIOD, 1.0)
    squares = RecursiveLeastSquares(np.zeros(3), P0[:3, :3])
    for estimator in (kalman, squares):
        estimator.update_many(phi, force)
    np.testing.assert_allclose(kalman.theta, squares.theta, rtol=1e-10)
    np.testing.assert_allclose(kalman.covariance, squares.covariance, rtol=1e-10)


@pytest.mark.parametrize("noise", [0.6, None], ids=["noise known", "noise estimated"])
def test_its_interval_covers_parameters_that_walk(noise):
    """200 walks of three parameters know a rate of 95 % to 0.9 %; the noise's estimate costs little."""
    random = np.random.default_rng(2)
    inside = []
    for _ in range(200):
        phi, force, truth = walk(3, 600, random)
        kalman = KalmanFilter(np.zeros(3), P0[:3, :3], DRIFT[:3], PERIOD, noise)
        kalman.update_many(phi, force)
        estimate = kalman.estimate()
        inside.append(np.abs(estimate.theta - truth) < 1.96 * estimate.std)
    assert 0.92 < np.mean(inside) < 0.98


def test_the_noise_is_estimated_as_it_is():
    random = np.random.default_rng(3)
    phi, force, _ = walk(3, 20_000, random, noise=0.05, drift=0.01 * DRIFT)
    kalman = KalmanFilter(np.zeros(3), P0[:3, :3], 0.01 * DRIFT[:3], PERIOD)
    assert kalman.noise == 1.0
    kalman.update_many(phi, force)
    assert kalman.noise == pytest.approx(0.05, rel=0.03)
    assert KalmanFilter(np.zeros(3), P0[:3, :3], DRIFT[:3], noise=0.7).noise == pytest.approx(0.7)


def test_noise_that_is_correlated_in_time_counts_for_what_it_is_worth():
    """First-order noise of pole 0.8 says as little as white noise of three times its deviation."""
    from scipy.signal import lfilter

    random = np.random.default_rng(4)
    phi = np.ones((20_000, 3)) * [1.0, 0.5, 0.2] + lfilter(
        [0.1], [1.0, -0.99], random.standard_normal((20_000, 3)), axis=0
    )
    force = phi @ [1.0, 2.0, 3.0] + lfilter([0.6], [1.0, -0.8], random.standard_normal(20_000))
    kalman = KalmanFilter(np.zeros(3), P0[:3, :3], np.zeros(3))
    kalman.update_many(phi, force)
    assert kalman.noise == pytest.approx(3.0, rel=0.1)


def test_what_rests_grows_doubtful_at_its_own_pace_and_not_without_end():
    kalman = KalmanFilter(np.zeros(3), P0[:3, :3], [0.0, 1.0, 0.5], 1.0, 0.6)
    random = np.random.default_rng(5)
    phi = random.standard_normal((500, 3))
    kalman.update_many(phi, phi @ [1.0, 2.0, 3.0])
    known = np.diag(kalman.covariance)
    kalman.update_many(np.zeros((50, 3)), np.zeros(50))
    np.testing.assert_allclose(np.diag(kalman.covariance) - known, [0.0, 50.0, 12.5], atol=1e-9)
    kalman.update_many(np.zeros((100_000, 3)), np.zeros(100_000))
    assert np.all(np.diag(kalman.covariance) < 3.01 * np.diag(P0)[:3])
    assert kalman.covariance[0, 0] == pytest.approx(known[0], rel=1e-4)


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        ({"drift": [1.0, 2.0]}, "drift must be 3 numbers of 0 or more"),
        ({"drift": [1.0, 2.0, -1.0]}, "drift must be 3 numbers of 0 or more"),
        ({"drift": [1.0, 2.0, np.nan]}, "drift must be 3 numbers of 0 or more"),
        ({"period": 0.0}, "period must be above 0 s, got 0.0"),
        ({"period": np.inf}, "period must be above 0 s, got inf"),
        ({"noise": -1.0}, "noise must be above 0 N, or None"),
        ({"noise": 0.0}, "noise must be above 0 N, or None"),
        ({"names": ("K",)}, "1 names for 3"),
    ],
    ids=str,
)
def test_numbers_out_of_range_are_refused(arguments, told):
    with pytest.raises(InputError, match=told):
        KalmanFilter(np.zeros(3), P0[:3, :3], **{"drift": np.ones(3), **arguments})
