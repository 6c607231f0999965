"""The Gaussian process against its definition: gradients, conditioning, precision, places left out."""

import numpy as np
import pytest
from scipy.spatial.distance import cdist, pdist

from palpate.maps.gaussian_process import Conditioned, Hyperparameters, fit, loss, student95

RNG = np.random.default_rng(3)
PLACES = RNG.uniform(0.0, 0.1, (25, 2))
NOISE = RNG.uniform(0.01, 0.05, 25)
VALUES = 7.0 + np.sin(60.0 * PLACES[:, 0]) * 0.4 + NOISE * RNG.normal(size=25)
PARAMETERS = Hyperparameters(smooth=0.4, long=0.05, rough=0.2, short=0.01, repeat=0.02)


def prior_covariance(p, places, others):
    s, r = np.sqrt(5.0) * cdist(places, others) / p.long, np.sqrt(3.0) * cdist(places, others) / p.short
    return p.smooth**2 * (1 + s + s**2 / 3) * np.exp(-s) + p.rough**2 * (1 + r) * np.exp(-r)


@pytest.mark.parametrize("lines", [None, 5])
def test_the_gradient_is_that_of_the_likelihood(lines):
    theta = np.log([0.4, 0.05, 0.2, 0.01, 0.02, 0.03][: 5 if lines is None else 6])
    distance, step = pdist(PLACES), 1e-5
    same = None if lines is None else pdist(np.arange(25.0)[:, None] % lines) == 0.0
    numeric = [
        (
            loss(theta + step * e, distance, VALUES, NOISE, same)[0]
            - loss(theta - step * e, distance, VALUES, NOISE, same)[0]
        )
        / (2 * step)
        for e in np.eye(len(theta))
    ]
    assert loss(theta, distance, VALUES, NOISE, same)[1] == pytest.approx(numeric, rel=1e-5, abs=1e-6)


def test_conditioning_is_that_of_a_normal_distribution_whose_mean_is_unknown():
    """A mean of a very wide prior, in one dense solution, is the limit that the restricted likelihood takes."""
    at = RNG.uniform(0.0, 0.1, (7, 2))
    wide = 1e6
    K = prior_covariance(PARAMETERS, PLACES, PLACES) + wide + np.diag(NOISE**2 + PARAMETERS.repeat**2)
    k = prior_covariance(PARAMETERS, PLACES, at) + wide
    mean = k.T @ np.linalg.solve(K, VALUES)
    covariance = prior_covariance(PARAMETERS, at, at) + wide - k.T @ np.linalg.solve(K, k)
    process = Conditioned(PLACES, VALUES, NOISE, PARAMETERS)
    found, variance = process.reduction.predict(cdist(PLACES, at))
    assert found == pytest.approx(mean, rel=1e-5)
    assert variance == pytest.approx(np.diag(covariance), rel=1e-3)
    assert process.covariance(at) == pytest.approx(covariance, abs=1e-3 * covariance.max())


def test_a_value_left_out_is_foretold_as_by_the_process_of_the_others():
    process = Conditioned(PLACES, VALUES, NOISE, PARAMETERS)
    for i in (0, 11, 24):
        rest = np.arange(25) != i
        others = Conditioned(PLACES[rest], VALUES[rest], NOISE[rest], PARAMETERS)
        mean, variance = others.reduction.predict(cdist(PLACES[rest], PLACES[i : i + 1]))
        std = np.sqrt(variance[0] + NOISE[i] ** 2 + PARAMETERS.repeat**2)
        errors, variances = process.leave_one_out()
        assert errors[i] == pytest.approx(VALUES[i] - mean[0], rel=1e-6)
        assert np.sqrt(variances[i]) == pytest.approx(std, rel=1e-6)


def test_parts_of_a_prediction_are_those_of_the_whole():
    process = fit(PLACES, VALUES, NOISE)
    at = RNG.uniform(0.0, 0.1, (1300, 2))
    mean, variance = process.predict(at)
    exact = [node.reduction.predict(cdist(PLACES, at)) for node in process.nodes]
    means, variances = np.array([m for m, _ in exact]), np.array([v for _, v in exact])
    assert mean == pytest.approx(process.weights @ means, rel=1e-9)
    spread = process.weights @ (variances + (means - mean) ** 2)
    assert variance == pytest.approx(spread, rel=1e-7)
    assert [len(each) for each in process.predict(at[:0])] == [0, 0]


def test_the_scale_of_the_places_does_not_matter():
    one, other = fit(PLACES, VALUES, NOISE), fit(1e3 * PLACES, VALUES, NOISE)
    at = RNG.uniform(0.0, 0.1, (50, 2))
    for a, b in zip(one.predict(at), other.predict(1e3 * at), strict=True):
        assert a == pytest.approx(b, rel=2e-3)


def test_presses_beyond_one_block_are_fitted_too():
    places = RNG.uniform(0.0, 0.1, (420, 2))
    values = np.sin(60.0 * places[:, 0]) + 0.05 * RNG.normal(size=420)
    process = fit(places, values, np.full(420, 0.02))
    at = RNG.uniform(0.01, 0.09, (200, 2))
    mean, _ = process.predict(at)
    assert np.sqrt(np.mean((mean - np.sin(60.0 * at[:, 0])) ** 2)) < 0.05
    assert process.repeat == pytest.approx(np.sqrt(0.05**2 - 0.02**2), rel=0.25)


def test_intervals_are_wider_than_normal_ones_where_the_field_jumps():
    rng = np.random.default_rng(3)
    places, noise = rng.uniform(0.0, 0.1, (80, 2)), np.full(80, 0.03)
    plain = fit(places, 5.0 * places[:, 0] + noise * rng.normal(size=80), noise)
    jump = fit(places, (np.hypot(*(places - 0.05).T) < 0.015) + noise * rng.normal(size=80), noise)
    assert plain.next_z95 == pytest.approx(1.96, abs=0.1)
    assert jump.next_z95 > 2.2
    assert jump.z95 >= jump.next_z95
    assert plain.z95 < 2.5  # few presses tell little of the tails
    errors, variance = jump.likeliest.leave_one_out()
    assert np.mean(np.abs(errors) < jump.next_z95 * np.sqrt(variance)) >= 0.94


def test_the_width_of_an_interval_is_that_of_the_deviations():
    """Normal and Student's deviations, behind normal noise of half their variance."""
    rng = np.random.default_rng(4)
    field, noise = np.ones(800), np.full(800, 0.5)
    behind = np.sqrt(0.5) * rng.normal(size=800)
    assert student95(rng.normal(size=800) + behind, field, noise) == pytest.approx(1.96, rel=0.1)
    heavy = rng.standard_t(3, size=800)
    assert student95(heavy + behind, field, noise) == pytest.approx(3.18, rel=0.15)
    assert student95(1.5 * rng.normal(size=800) + behind, field, noise) == pytest.approx(2.94, rel=0.1)


def test_an_error_that_lines_share_is_not_taken_for_the_field():
    rng = np.random.default_rng(5)
    x, line = rng.uniform(0.0, 0.1, 80), np.repeat(np.arange(8.0), 10)
    places, noise = np.column_stack([x, 0.0125 * line]), np.full(80, 0.02)
    values = np.sin(40.0 * x) + 0.15 * rng.normal(size=8)[line.astype(int)] + noise * rng.normal(size=80)
    process, blind = fit(places, values, noise, line), fit(places, values, noise)
    assert process.shared == pytest.approx(0.15, rel=0.5)
    assert blind.shared == 0.0
    at = RNG.uniform([0.0, 0.0], [0.1, 0.0875], (300, 2))
    (mean, variance), (other, _) = process.predict(at), blind.predict(at)
    true = np.sin(40.0 * at[:, 0])
    assert np.mean(np.abs(mean - true) < 1.96 * np.sqrt(variance)) > 0.9
    assert np.mean((mean - true) ** 2) < np.mean((other - true) ** 2)
