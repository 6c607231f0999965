"""Samples of any size: an estimator stays finite, keeps its variances above zero, and takes the next honest sample."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.identifiers import (
    ContactIdentifier,
    Exponential,
    RecursiveLeastSquares,
    RestartingLeastSquares,
    SIFt,
)

START, VAGUE = np.zeros(3), np.diag([1e2, 1e6, 1e10])
TRUTH = np.array([0.3, 60.0, 5200.0])
MAKERS = {
    "exponential": lambda: RecursiveLeastSquares(START, VAGUE, Exponential(0.998)),
    "SIFt": lambda: RecursiveLeastSquares(START, VAGUE, SIFt(0.994)),
    "restarting": lambda: RestartingLeastSquares(START, VAGUE),
}


@pytest.mark.parametrize("make", MAKERS.values(), ids=MAKERS)
def test_regressors_of_any_size_leave_an_estimator_alive(make):
    for seed in range(3):
        random, estimator = np.random.default_rng(seed), make()
        for _ in range(10):
            scale = 10.0 ** random.choice([-12, -6, 0, 0, 6, 12, 20, 28])
            phi = scale * random.normal(0.0, 1.0, (150, 3)) * [10.0, 0.1, 1e-3]
            if random.random() < 0.3:
                phi[:] = phi[0]
            estimator.update_many(phi, phi @ TRUTH + random.normal(0.0, 10.0 ** random.choice([0, 6]), 150))
            found = estimator.estimate()
            assert np.isfinite(found.theta).all()
            assert np.isfinite(found.covariance).all()
            assert (np.diag(found.covariance) >= 0.0).all()


@pytest.mark.parametrize("variance", [1e-60, 1e60])
def test_the_smallest_and_the_largest_covariance_leave_an_estimator_finite(variance):
    random, P = np.random.default_rng(5), variance * np.eye(3)
    for one in (RecursiveLeastSquares(START, P), RestartingLeastSquares(START, P)):
        for scale in (1.0, 1e-20, 1e28, 1.0):
            one.update_many(scale * random.normal(size=(20, 3)), scale * random.normal(size=20))
            found = one.estimate()
            assert np.isfinite(found.theta).all()
            assert np.isfinite(found.covariance).all()


@pytest.mark.parametrize("touch", [None, 0.0, 3.0])
def test_ticks_of_any_size_leave_the_contact_identifier_alive(touch):
    random = np.random.default_rng(3)
    one = ContactIdentifier("butterworth3:120", 1000.0, 0.0035, touch=touch)
    for _ in range(12):
        x = random.normal(0.0, 10.0 ** random.uniform(-9, 2.5), 400).clip(-1e3, 1e3)
        force = random.normal(0.0, 10.0 ** random.uniform(-6, 5.5), 400).clip(-1e6, 1e6)
        one.update_many(x, force)
        found = one.estimate()
        assert np.isfinite(found.theta).all()
        assert np.isfinite(found.covariance).all()
        assert (np.diag(found.covariance) >= 0.0).all()
        for name, most in zip(found.names, (1e2, 1e5, 1e7, 1e4), strict=True):
            if found.verdicts()[name] == "identified":
                assert abs(found.theta[found.names.index(name)]) <= most


def test_two_minutes_and_more_are_answered():
    """Once every level has a block there is no line slower than all of them."""
    random = np.random.default_rng(0)
    one = ContactIdentifier("butterworth3:120", 1000.0, 0.0035, touch=0.0)
    t = np.arange(150_000) / 1000.0
    x = 1e-3 * np.sin(2 * np.pi * 3 * t) + 1e-4 * np.sin(2 * np.pi * 20 * t)
    one.update_many(x, 5200 * x + random.normal(0.0, 0.1, len(t)))
    assert one.estimate().samples > 149_000
