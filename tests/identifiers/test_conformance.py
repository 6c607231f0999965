"""Every estimator of `palpate.identifiers` keeps the laws of all: found by looking, not by a list."""

import inspect

import numpy as np
import pytest

import palpate.identifiers as room
from palpate.errors import InputError
from palpate.identifiers import (
    ContactIdentifier,
    Exponential,
    NeuralProbe,
    RecursiveLeastSquares,
    RestartingLeastSquares,
    SIFt,
)
from palpate.testing import identifiers as laws
from palpate.testing.identifiers import NOISE, TRUTH, answers
from palpate.testing.identifiers import foam as press

START, VAGUE = np.zeros(3), np.diag([1e2, 1e6, 1e10])
NAMES = ("M", "B", "K")
MAKERS = {
    "least squares": lambda start=START, P=VAGUE: RecursiveLeastSquares(start, P, names=NAMES),
    "exponential": lambda start=START, P=VAGUE: RecursiveLeastSquares(start, P, Exponential(0.995), NAMES),
    "SIFt": lambda start=START, P=VAGUE: RecursiveLeastSquares(start, P, SIFt(0.99), NAMES),
    "restarting": lambda start=START, P=VAGUE: RestartingLeastSquares(start, P, names=NAMES),
    "network": lambda: NeuralProbe.thesis("foam"),
}
LINEAR = {name: make for name, make in MAKERS.items() if name != "network"}
FED_OTHERWISE = {ContactIdentifier}
"""Estimators that take something else than a regressor: they have tests of their own."""

OF_M_B_K = {laws.estimate_is_finite, laws.stiffness_of_foam_is_found}
"""Laws of what estimates (M, B, K) in this order."""

every = pytest.mark.parametrize("make", MAKERS.values(), ids=MAKERS)
linear = pytest.mark.parametrize("make", LINEAR.values(), ids=LINEAR)


def test_none_is_left_out():
    offered = (getattr(room, name) for name in room.__all__)
    found = {x for x in offered if inspect.isclass(x) and hasattr(x, "update") and hasattr(x, "estimate")}
    assert found - FED_OTHERWISE == {type(make()) for make in MAKERS.values()}


@every
@pytest.mark.parametrize("law", laws.LAWS, ids=lambda law: law.__name__)
def test_it_obeys_the_laws_that_users_run_on_theirs(make, law):
    if make is MAKERS["network"] and law in OF_M_B_K:
        pytest.skip("it answers K, B, M without a covariance, and learns for minutes")
    law(make)


@every
def test_of_many_samples_the_bad_one_is_named_and_those_before_are_in(make):
    phi, force = press(50)
    broken = phi.copy()
    broken[20, 1] = np.nan
    bad, good = make(), make()
    with pytest.raises(InputError, match="sample 20 is not finite"):
        bad.update_many(broken, force)
    good.update_many(phi[:20], force[:20])
    np.testing.assert_array_equal(answers(bad), answers(good))


@linear
def test_a_good_start_is_not_identified_either(make):
    """A guess with the covariance that was given for it."""
    guess = make(TRUTH, np.diag(TRUTH**2))
    np.testing.assert_allclose(guess.estimate().std, TRUTH, rtol=1e-12)
    assert set(guess.estimate().verdicts().values()) == {"not identifiable"}


@linear
def test_what_was_never_excited_is_never_identified(make):
    """A guess of the mass, and an hour in which nothing accelerates."""
    estimator = make(TRUTH, np.diag((3.0 * TRUTH) ** 2))
    random = np.random.default_rng(4)
    phi = np.column_stack([np.zeros(36_000), random.normal(0.0, 1e-2, 36_000), np.full(36_000, 5e-3)])
    for _ in range(5):
        estimator.update_many(phi, phi @ TRUTH + random.normal(0.0, NOISE, len(phi)))
    verdicts = estimator.estimate().verdicts()
    assert verdicts["M"] == "not identifiable"
    assert estimator.estimate().std[0] > TRUTH[0]
    assert verdicts["K"] == "identified"


REST = {
    "nothing": np.zeros((1, 3)),
    "still": np.array([[0.0, 0.0, 5e-3]]),
    "one direction": np.array([[20.0, 0.3, 5e-3]]),
    "steady rate": np.array([[0.0, 1e-3, 5e-3]]),
}


@linear
@pytest.mark.parametrize("rest", REST.values(), ids=REST)
def test_the_covariance_stays_one_through_any_rest(make, rest):
    """200 s of the same sample, with and without noise of a sensor in it, after a press."""
    phi, force = press(1000)
    estimator, random = make(), np.random.default_rng(5)
    estimator.update_many(phi, force)
    for noise in (0.0, 1e-4):
        for _ in range(4):
            still = np.tile(rest, (25_000, 1)) + noise * random.standard_normal((25_000, 3)) * [
                1.0,
                1e-1,
                1e-3,
            ]
            estimator.update_many(still, still @ TRUTH + random.normal(0.0, NOISE, 25_000))
            for C in (estimator.covariance, estimator.estimate().covariance):
                np.testing.assert_array_equal(C, C.T)
                scaled = C / np.sqrt(np.outer(np.diag(VAGUE), np.diag(VAGUE)))
                assert np.linalg.eigvalsh(scaled)[0] > -1e-15
            assert (np.diag(estimator.covariance) < 3.1 * np.diag(VAGUE)).all()
            assert np.isfinite(answers(estimator)).all()
    estimator.update_many(phi, force)
    assert estimator.theta[2] == pytest.approx(TRUTH[2], rel=0.05)


@linear
def test_units_of_the_parameters_do_not_matter(make):
    """Mass in g, damping in N s/mm, stiffness in kN/m; from a start so vague that nothing winds up."""
    phi, force = press(400)
    unit = np.array([1e-3, 1e3, 1e3])
    ours, theirs = make(START, 1e4 * VAGUE), make(START, 1e4 * VAGUE / np.outer(unit, unit))
    ours.update_many(phi, force)
    theirs.update_many(phi * unit, force)
    np.testing.assert_allclose(theirs.theta * unit, ours.theta, rtol=1e-6)
    np.testing.assert_allclose(theirs.estimate().std * unit, ours.estimate().std, rtol=1e-6)


@linear
def test_what_is_given_back_is_a_copy(make):
    estimator = make()
    before = answers(estimator)
    estimator.theta[:] = 7.0
    estimator.covariance[:] = 7.0
    estimator.estimate().covariance[:] = 7.0
    np.testing.assert_array_equal(answers(estimator), before)
