"""A surface becomes another: noticed soon, dated well, and never when it did not happen."""

import numpy as np
import pytest

from palpate.errors import InputError
from palpate.identifiers import RecursiveLeastSquares, RestartingLeastSquares, SIFt

RATE, NOISE = 480.0, 0.6
VAGUE = np.diag([1e6, 1e10, 1e6])
SOFT, HARD = (60.0, 7e3), (150.0, 62e3)
CHANGE = 1500


def motion(random, samples):
    """Rate, penetration and one, of a motion of four tones."""
    t = np.arange(samples) / RATE
    x, v = np.full(samples, 1e-2), np.zeros(samples)
    for frequency in (0.7, 2.0, 5.0, 11.0):
        omega, phase = 2 * np.pi * frequency * random.uniform(0.8, 1.2), random.uniform(0.0, 2 * np.pi)
        x, v = x + 9e-5 * np.sin(omega * t + phase), v + 9e-5 * omega * np.cos(omega * t + phase)
    return np.column_stack([v, x, np.ones(samples)])


def changed(seed, samples=3000, old=SOFT, new=HARD):
    """Regressors and forces; from `CHANGE` on the other surface, the force continuous."""
    random = np.random.default_rng(seed)
    phi = motion(random, samples)
    force = phi[:, :2] @ old
    if samples > CHANGE:
        force[CHANGE:] = force[CHANGE] + (phi[CHANGE:, :2] - phi[CHANGE, :2]) @ new
    return phi, force + random.normal(0.0, NOISE, samples)


def stiffness(estimator, phi, force):
    K = np.empty(len(force))
    for k, (row, f) in enumerate(zip(phi, force, strict=True)):
        estimator.update(row, f)
        K[k] = estimator.theta[1]
    return K


def settled(K, truth):
    """Samples until it is within 2 % and stays."""
    outside = np.flatnonzero(np.abs(K / truth - 1.0) > 0.02)
    return outside[-1] + 2 if len(outside) else 1


def test_it_knows_the_new_surface_within_twice_the_time_of_one_that_is_told():
    ratios = []
    for seed in range(15):
        phi, force = changed(seed)
        told = stiffness(RecursiveLeastSquares(np.zeros(3), VAGUE), phi[CHANGE:], force[CHANGE:])
        ours = RestartingLeastSquares(np.zeros(3), VAGUE)
        ours.update_many(phi[:CHANGE], force[:CHANGE])
        K = stiffness(ours, phi[CHANGE:], force[CHANGE:])
        ratios.append(settled(K, HARD[1]) / settled(told, HARD[1]))
        assert ours.changes == 1
        # Dated to within a fifth of a second, and rather late than early.
        assert -3 <= len(force) - CHANGE - ours.since < 100
    assert np.median(ratios) < 1.3
    assert np.quantile(ratios, 0.9) < 2.0


def test_the_interval_after_a_change_is_that_of_the_new_samples():
    inside, widths = [], []
    for seed in range(60):
        phi, force = changed(seed, CHANGE + 200)
        ours, told = (RestartingLeastSquares(np.zeros(3), VAGUE), RecursiveLeastSquares(np.zeros(3), VAGUE))
        ours.update_many(phi, force)
        told.update_many(phi[CHANGE:], force[CHANGE:])
        assert ours.changes == 1
        estimate = ours.estimate()
        inside.append(abs(estimate.theta[1] - HARD[1]) < 1.96 * estimate.std[1])
        widths.append(estimate.std[1] / told.estimate().std[1])
    assert np.mean(inside) > 0.87  # 60 runs know 95 % to 2.8 %
    assert 0.8 < np.median(widths) < 1.3


def test_the_noise_is_known_from_before_the_change():
    """1,500 samples know it to 2 %, its colour to 5 % more; the fifty since the change would to 10 % and 30 %."""
    for seed in range(20):
        phi, force = changed(seed, CHANGE + 60)
        estimator = RestartingLeastSquares(np.zeros(3), VAGUE)
        estimator.update_many(phi, force)
        estimate = estimator.estimate()
        assert estimate.samples == estimator.since < 63
        assert estimate.std[1] == pytest.approx(NOISE * np.sqrt(estimator.covariance[1, 1]), rel=0.1)


@pytest.mark.long
@pytest.mark.parametrize("colour", [0.0, 0.8], ids=["white", "coloured"])
@pytest.mark.parametrize("forgetting", [1.0, SIFt(0.999)], ids=["all kept", "SIFt"])
def test_a_surface_that_stays_is_not_taken_for_another(colour, forgetting):
    """Seven minutes; a log-likelihood ratio of 20 is one in hundreds of millions."""
    from scipy.signal import lfilter

    random = np.random.default_rng(8)
    phi = motion(random, 200_000)
    noise = lfilter([1.0 - colour], [1.0, -colour], random.normal(0.0, NOISE, len(phi)))
    estimator = RestartingLeastSquares(np.zeros(3), VAGUE, forgetting)
    estimator.update_many(phi, phi[:, :2] @ SOFT + noise)
    assert estimator.changes == 0
    assert estimator.since == len(phi)
    assert estimator.theta[1] == pytest.approx(SOFT[1], rel=0.03)


def test_one_outlier_is_no_change():
    phi, force = changed(0, 3000, new=SOFT)
    force[[1000, 1700, 2400]] += [40.0, -40.0, 40.0]
    estimator = RestartingLeastSquares(np.zeros(3), VAGUE)
    estimator.update_many(phi, force)
    assert estimator.changes == 0


def test_it_changes_as_often_as_the_surface_does():
    random = np.random.default_rng(1)
    phi = motion(random, 8000)
    turns = [SOFT, HARD, (30.0, 3e3), (200.0, 20e3)]
    force = np.concatenate([phi[i * 2000 : (i + 1) * 2000, :2] @ turn for i, turn in enumerate(turns)])
    estimator = RestartingLeastSquares(np.zeros(3), VAGUE)
    for i, turn in enumerate(turns):
        part = slice(i * 2000, (i + 1) * 2000)
        estimator.update_many(phi[part], force[part] + random.normal(0.0, NOISE, 2000))
        assert estimator.changes == i
        assert estimator.theta[1] == pytest.approx(turn[1], rel=0.05)


def test_between_changes_it_is_plain_least_squares():
    phi, force = changed(3, CHANGE)
    restarting = RestartingLeastSquares(np.zeros(3), VAGUE, 0.999)
    plain = RecursiveLeastSquares(np.zeros(3), VAGUE, 0.999)
    for estimator in (restarting, plain):
        estimator.update_many(phi, force)
    np.testing.assert_array_equal(restarting.theta, plain.theta)
    np.testing.assert_array_equal(restarting.covariance, plain.covariance)
    np.testing.assert_array_equal(restarting.estimate().covariance, plain.estimate().covariance)


def test_after_a_change_it_is_least_squares_on_the_samples_since():
    phi, force = changed(4)
    estimator = RestartingLeastSquares(np.zeros(3), VAGUE)
    estimator.update_many(phi, force)
    since = estimator.since
    again = RecursiveLeastSquares(np.zeros(3), VAGUE)
    again.update_many(phi[-since:], force[-since:])
    np.testing.assert_allclose(estimator.theta, again.theta, rtol=1e-8)
    np.testing.assert_allclose(estimator.covariance, again.covariance, rtol=1e-7)


def test_a_change_that_shows_only_when_it_moves_is_found_when_it_does():
    """Half a minute of stillness, in which the surface becomes another under the same force."""
    random = np.random.default_rng(6)
    phi = motion(random, 4000)
    phi[1500:2500] = phi[1500]
    phi[1500:2500, 0] = 0.0
    force = phi[:, :2] @ SOFT
    force[2000:] = phi[1500, :2] @ SOFT + (phi[2000:, :2] - phi[1500, :2]) @ HARD
    estimator = RestartingLeastSquares(np.zeros(3), VAGUE)
    force += random.normal(0.0, NOISE, 4000)
    estimator.update_many(phi[:2500], force[:2500])
    assert estimator.changes == 0
    estimator.update_many(phi[2500:], force[2500:])
    assert estimator.changes == 1
    assert estimator.theta[1] == pytest.approx(HARD[1], rel=0.02)


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        ({"memory": 3}, "memory must be a whole number of samples above 3"),
        ({"memory": 10.5}, "memory must be a whole number of samples above 3"),
        ({"evidence": 0.0}, "evidence must be above 0"),
        ({"evidence": np.nan}, "evidence must be above 0"),
        ({"forgetting": 1.1}, r"forgetting must be in \(0, 1\]"),
    ],
    ids=str,
)
def test_numbers_out_of_range_are_refused(arguments, told):
    with pytest.raises(InputError, match=told):
        RestartingLeastSquares(np.zeros(3), VAGUE, **arguments)


def pressed(make):
    phi, force = changed(11, CHANGE)
    estimator = make(np.zeros(3), VAGUE)
    estimator.update_many(phi, force)
    return estimator


@pytest.mark.parametrize("make", [RecursiveLeastSquares, RestartingLeastSquares])
def test_zeros_teach_nothing(make):
    """Ten thousand samples of exact zeros tell neither of the surface nor of the noise."""
    estimator = pressed(make)
    before = estimator.estimate()
    estimator.update_many(np.zeros((10_000, 3)), np.zeros(10_000))
    after = estimator.estimate()
    np.testing.assert_array_equal(after.theta, before.theta)
    np.testing.assert_array_equal(after.covariance, before.covariance)
