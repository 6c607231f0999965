"""Optimal powers: against results by hand, finite differences, and every other spectrum."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.excitation.power_spectrum import covariance, largest_variance, optimal_powers, power_sensitivity

NOTHING = np.zeros((2, 2))
UNIT = np.full(2, 1.96)  # so that the criteria are those of the plain covariance


def two_parameters(shares):
    """A spring and a damper under unit force: each frequency tells of the one what it does not tell of the other."""
    return np.array([[np.diag([1 - s, s]) for s in shares]])


def test_a_spring_and_a_damper_get_half_of_the_information_each():
    information = two_parameters(np.linspace(0.1, 0.8, 12))
    found = optimal_powers(information, NOTHING, UNIT)
    told = np.einsum("f,fij->ij", found.powers, information[0])
    assert found.powers.sum() == pytest.approx(1.0)
    assert np.diag(told) == pytest.approx([0.5, 0.5], abs=0.01)
    # The norm that replaces a maximum counts two equal values as 2^(1/8) of one.
    assert largest_variance(np.linalg.inv(told)[None])[0][0] == pytest.approx(2.0 * 2**0.125, rel=0.01)


def random_information(rng, surfaces=3, lines=10, size=3):
    columns = rng.standard_normal((surfaces, lines, size, 2)) * [[5.0], [1.0], [0.2]]
    return columns @ columns.transpose(0, 1, 3, 2)


def test_the_sensitivity_is_the_derivative():
    information = random_information(np.random.default_rng(1))
    prior, wanted = np.diag([0.1, 0.2, 0.3]), np.array([0.1, 0.2, np.inf])
    powers = np.full(10, 0.1)

    def value(w):
        C = covariance(np.einsum("f,cfij->cij", w, information), prior)[:, :2, :2]
        values = largest_variance(C / np.outer(wanted[:2], wanted[:2]) * 1.96**2)[0]
        return (values**8).sum() ** (1 / 8)

    found = power_sensitivity(information, prior, wanted, powers)
    step = 1e-6 * np.eye(10)
    slope = np.array([(value(powers - h) - value(powers + h)) / 2e-6 for h in step])
    assert found / found.sum() == pytest.approx(slope / slope.sum(), rel=1e-4)


def test_no_other_spectrum_is_better_by_more_than_the_gap():
    rng = np.random.default_rng(2)
    information, prior, wanted = random_information(rng), np.zeros((3, 3)), np.array([0.1, 0.2, 0.3])

    def value(w):
        C = covariance(np.einsum("f,cfij->cij", w, information), prior) / np.outer(wanted, wanted) * 1.96**2
        return (largest_variance(C)[0] ** 8).sum() ** (1 / 8)

    found = optimal_powers(information, prior, wanted)
    assert found.gap < 0.011
    best = value(found.powers)
    others = rng.dirichlet(np.full(10, 0.5), 300)
    assert min(value(0.999 * w + 1e-4) for w in others) >= best * (1 - found.gap)


def test_what_nothing_is_known_of_has_an_enormous_variance():
    C = covariance(np.diag([4.0, 0.0]), NOTHING)
    assert C[0, 0] == pytest.approx(0.25)
    assert C[1, 1] > 1e10
