"""Each policy against its definition on the information itself, and the bounds that it promises."""

import numpy as np
import pytest

from palpate.errors import InputError
from palpate.identifiers import Exponential, RecursiveLeastSquares, SIFt

KEEP = 0.97


def exponential(information, phi, variances):
    return KEEP * information


def subspace(information, phi, variances):
    """The part of the information parallel to the regressor shrinks (Lai and Bernstein, in initial deviations)."""
    scale = np.sqrt(variances)
    R, u = scale[:, None] * information * scale, scale * phi
    parallel = np.outer(R @ u, R @ u) / (u @ R @ u)
    return (R - (1.0 - KEEP) * parallel) / scale[:, None] / scale


POLICIES = {"exponential": (Exponential(KEEP), exponential), "SIFt": (SIFt(KEEP), subspace)}


def samples(n, count, seed=0):
    random = np.random.default_rng(seed)
    phi = random.standard_normal((count, n)) * 10.0 ** np.linspace(0, -1, n)
    return phi, phi @ np.arange(1.0, n + 1.0) + 0.1 * random.standard_normal(count)


@pytest.mark.parametrize(
    ("n", "name"),
    [
        *((3, name) for name in POLICIES),
        (4, "exponential"),  # each policy is compiled again for a fourth parameter
        pytest.param(4, "SIFt", marks=pytest.mark.long),
    ],
)
def test_it_is_its_definition(n, name):
    policy, forgotten = POLICIES[name]
    phi, y = samples(n, 150)
    variances = 10.0 ** np.linspace(3, 5, n)
    information, theta = np.diag(1.0 / variances), np.zeros(n)
    estimator = RecursiveLeastSquares(theta, np.diag(variances), policy)
    for row, force in zip(phi, y, strict=True):
        estimator.update(row, force)
        information = forgotten(information, row, variances) + np.outer(row, row)
        theta = theta + np.linalg.solve(information, row * (force - row @ theta))
    # The definition squares the condition number, ours does not.
    np.testing.assert_allclose(estimator.theta, theta, rtol=1e-7)
    np.testing.assert_allclose(estimator.covariance, np.linalg.inv(information), rtol=1e-5, atol=1e-9)


def test_subspace_forgetting_keeps_the_information_within_its_bounds():
    """Between least/(1 - keep) and the largest sample/(1 - keep), in units of the initial deviations."""
    random = np.random.default_rng(3)
    least = 0.01
    estimator = RecursiveLeastSquares(np.zeros(3), np.eye(3), SIFt(KEEP, least))
    low, high, largest = min(1.0, least / (1.0 - KEEP)), 1.0, 0.0
    for _ in range(3000):
        kind = random.integers(4)  # mere noise, one direction, all directions, and a leap
        phi = random.standard_normal(3) * [[1e-3] * 3, [1.0, 0.0, 0.0], [0.3] * 3, [5.0, 5.0, 0.1]][kind]
        estimator.update(phi, random.standard_normal())
        largest = max(largest, phi @ phi)
        high = max(1.0, largest / (1.0 - KEEP))
        information = 1.0 / np.linalg.eigvalsh(estimator.covariance)
        assert information.min() > low * (1.0 - 1e-9)
        assert information.max() < high * (1.0 + 1e-9)


def test_a_sample_that_says_too_little_is_left_out():
    estimator = RecursiveLeastSquares(np.zeros(3), np.diag([1.0, 4.0, 1.0]), SIFt(0.9, least=0.1))
    before = estimator.covariance
    estimator.update([0.0, 0.1, 0.0], 100.0)  # foretold with a variance of 0.04
    np.testing.assert_array_equal(estimator.theta, np.zeros(3))
    np.testing.assert_array_equal(estimator.covariance, before)
    estimator.update([0.0, 0.2, 0.0], 100.0)  # 0.16
    assert estimator.theta[1] > 1.0


def test_what_is_not_excited_is_remembered():
    """Exponential forgetting loses it; SIFt keeps its value and how well it is known."""
    phi, y = samples(3, 500)
    estimator = RecursiveLeastSquares(np.zeros(3), 1e4 * np.eye(3), SIFt(KEEP))
    estimator.update_many(phi, y)
    known = estimator.theta, estimator.covariance
    still = np.tile([1.0, 0.0, 0.0], (20_000, 1))
    estimator.update_many(still, np.random.default_rng(1).normal(1.0, 0.1, len(still)))
    # The first parameter moves, and the others with it as far as they were correlated.
    np.testing.assert_allclose(estimator.theta[1:], known[0][1:], atol=3.0 * np.sqrt(np.diag(known[1]).max()))
    assert np.all(np.diag(estimator.covariance)[1:] < 2.0 * np.diag(known[1])[1:])
    exponential = RecursiveLeastSquares(np.zeros(3), 1e4 * np.eye(3), KEEP)
    exponential.update_many(phi, y)
    exponential.update_many(still, np.ones(len(still)))
    assert np.all(np.diag(exponential.covariance)[1:] > 1e3)


@pytest.mark.parametrize("kind", [Exponential, SIFt])
def test_a_surface_that_changes_is_followed(kind):
    phi, y = samples(3, 3000)
    estimator = RecursiveLeastSquares(np.zeros(3), 1e4 * np.eye(3), kind(KEEP))
    estimator.update_many(phi, y)
    estimator.update_many(phi, 2.0 * y)
    np.testing.assert_allclose(estimator.theta, [2.0, 4.0, 6.0], rtol=0.15)


def test_the_initial_covariance_bounds_what_is_forgotten():
    """Each variance by its own and all by their sum, though one is a million times another."""
    variances = np.array([1e-2, 1e4, 1.0])
    estimator = RecursiveLeastSquares(np.zeros(3), np.diag(variances), 0.9)
    random = np.random.default_rng(2)
    for _ in range(300):
        estimator.update([0.0, 0.0, 1.0] + 1e-9 * random.standard_normal(3), 1.0)
        P = np.diag(estimator.covariance)
        assert (P / variances).sum() < 3.0 / 0.9 * (1.0 + 1e-12)
        assert P.sum() < variances.sum() / 0.9 * (1.0 + 1e-12)
    # What is excited is forgotten on: the information of 1 / (1 - keep) samples is there, no more.
    assert estimator.covariance[2, 2] == pytest.approx(0.1, rel=1e-3)


def test_a_policy_of_ones_own_is_compiled_like_the_others(tmp_path, monkeypatch):
    """A part with `keep` and `forget`; here, all is forgotten, but only by samples that are large."""
    (tmp_path / "my_forgetting.py").write_text(OWN)
    monkeypatch.syspath_prepend(tmp_path)
    from my_forgetting import WhenLarge

    phi, y = samples(3, 100)
    phi[50:] *= 0.1
    ours = RecursiveLeastSquares(np.zeros(3), 1e4 * np.eye(3), WhenLarge(KEEP))
    theirs = RecursiveLeastSquares(np.zeros(3), 1e4 * np.eye(3), KEEP)
    for estimator in (ours, theirs):
        estimator.update_many(phi[:40] + 2.0, y[:40])
    np.testing.assert_allclose(ours.covariance, theirs.covariance, rtol=1e-12)
    plain = RecursiveLeastSquares(ours.theta, ours.covariance)
    for estimator in (ours, plain):
        estimator.update_many(phi[50:], y[50:])
    np.testing.assert_allclose(ours.covariance, plain.covariance, rtol=1e-9)


OWN = """
from typing import NamedTuple

from palpate._jit import part


@part
class WhenLarge(NamedTuple):
    keep: float

    def forget(self, S, phi, floor):
        return (self.keep**-0.5 if phi @ phi > 1.0 else 1.0) * S, True
"""


@pytest.mark.parametrize("kind", [Exponential, SIFt])
@pytest.mark.parametrize("keep", [0.0, 1.2, -0.5, np.nan])
def test_a_factor_that_is_none_is_refused(kind, keep):
    with pytest.raises(InputError, match=r"forgetting must be in \(0, 1\]"):
        kind(keep)


def test_a_negative_least_is_refused():
    with pytest.raises(InputError, match="least must be 0 or more, got -1"):
        SIFt(0.99, -1.0)
