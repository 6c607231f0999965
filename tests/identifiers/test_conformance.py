"""Every estimator of `palpate.identifiers` keeps the laws of all: found by looking, not by a list."""

import copy
import inspect
import pickle

import numpy as np
import pytest

import palpate.identifiers as room
from palpate.errors import InputError
from palpate.identifiers import (
    ContactIdentifier,
    Directional,
    Exponential,
    KalmanFilter,
    NeuralProbe,
    RecursiveLeastSquares,
    RestartingLeastSquares,
    SIFt,
)

START, VAGUE = np.zeros(3), np.diag([1e2, 1e6, 1e10])
TRUTH = np.array([0.1, 200.0, 5200.0])
NAMES = ("M", "B", "K")
NOISE = 0.6
MAKERS = {
    "least squares": lambda start=START, P=VAGUE: RecursiveLeastSquares(start, P, names=NAMES),
    "exponential": lambda start=START, P=VAGUE: RecursiveLeastSquares(start, P, Exponential(0.995), NAMES),
    "directional": lambda start=START, P=VAGUE: RecursiveLeastSquares(start, P, Directional(0.99), NAMES),
    "SIFt": lambda start=START, P=VAGUE: RecursiveLeastSquares(start, P, SIFt(0.99), NAMES),
    "Kalman": lambda start=START, P=VAGUE: KalmanFilter(
        start, P, 1e-5 * np.sqrt(np.abs(np.diag(P))), noise=NOISE, names=NAMES
    ),
    "Kalman, noise unknown": lambda start=START, P=VAGUE: KalmanFilter(
        start, P, 1e-5 * np.sqrt(np.abs(np.diag(P))), names=NAMES
    ),
    "restarting": lambda start=START, P=VAGUE: RestartingLeastSquares(start, P, names=NAMES),
    "network": lambda: NeuralProbe.thesis("foam"),
}
LINEAR = {name: make for name, make in MAKERS.items() if name != "network"}
FED_OTHERWISE = {ContactIdentifier}
"""Estimators that take something else than a regressor: they have tests of their own."""

every = pytest.mark.parametrize("make", MAKERS.values(), ids=MAKERS)
linear = pytest.mark.parametrize("make", LINEAR.values(), ids=LINEAR)


def press(samples, seed=0, noise=NOISE):
    """Acceleration, rate and penetration of three tones at 1 kHz, and the force of foam."""
    random = np.random.default_rng(seed)
    t = np.arange(samples)[:, None] / 1000.0
    omega, phase = 2 * np.pi * np.array([1.0, 7.0, 23.0]), random.uniform(0.0, 2 * np.pi, 3)
    amplitude = np.array([2e-3, 3e-4, 5e-5])
    a, v, x = (
        (amplitude * omega**k * f(omega * t + phase)).sum(axis=1)
        for k, f in ((2, lambda z: -np.sin(z)), (1, np.cos), (0, np.sin))
    )
    phi = np.column_stack([a, v, x + 3e-3])
    return phi, phi @ TRUTH + random.normal(0.0, noise, samples)


def told(estimator):
    """All that an estimator says."""
    estimate = estimator.estimate()
    return np.concatenate([estimate.theta, estimate.covariance.ravel(), [estimate.samples]])


def test_none_is_left_out():
    offered = (getattr(room, name) for name in room.__all__)
    found = {x for x in offered if inspect.isclass(x) and hasattr(x, "update") and hasattr(x, "estimate")}
    assert found - FED_OTHERWISE == {type(make()) for make in MAKERS.values()}


@every
def test_many_updates_are_updates_one_by_one(make):
    phi, force = press(300)
    one, many, mixed = make(), make(), make()
    for row, f in zip(phi, force, strict=True):
        one.update(row, f)
    many.update_many(phi, force)
    mixed.update_many(phi[:100].tolist(), force[:100].tolist())
    mixed.update(list(phi[100]), force[100])
    mixed.update_many(np.asfortranarray(phi[101:]), force[101:])
    np.testing.assert_array_equal(told(many), told(one))
    np.testing.assert_array_equal(told(mixed), told(one))


@every
def test_a_regressor_may_be_any_sequence_of_numbers(make):
    plain, strided, read_only, whole = make(), make(), make(), make()
    phi = np.array([1.0, -2.0, 3.0])
    wide = np.repeat(phi, 2)
    fixed = phi.copy()
    fixed.flags.writeable = False
    plain.update([1.0, -2.0, 3.0], 4.0)
    strided.update(wide[::2], np.float64(4.0))
    read_only.update(fixed, 4)
    whole.update(phi.astype(int), 4.0)
    for other in (strided, read_only, whole):
        np.testing.assert_array_equal(told(other), told(plain))


@every
def test_the_same_samples_give_the_same_estimate(make):
    phi, force = press(200)
    first, second = make(), make()
    for estimator in (first, second):
        estimator.update_many(phi, force)
    np.testing.assert_array_equal(told(first), told(second))


BAD = {
    "short": ([1.0, 2.0], 1.0),
    "long": ([1.0, 2.0, 3.0, 4.0], 1.0),
    "in a frame": ([[1.0, 2.0, 3.0]], 1.0),
    "a number": (1.0, 1.0),
    "nothing": ([], 1.0),
    "words": (["a", "b", "c"], 1.0),
    "not a number": ([1.0, np.nan, 3.0], 1.0),
    "infinite": ([1.0, -np.inf, 3.0], 1.0),
    "force not a number": ([1.0, 2.0, 3.0], np.nan),
    "force infinite": ([1.0, 2.0, 3.0], np.inf),
    "force a word": ([1.0, 2.0, 3.0], "five"),
    "force missing": ([1.0, 2.0, 3.0], None),
}


@every
@pytest.mark.parametrize("sample", BAD.values(), ids=BAD)
def test_a_bad_sample_is_refused_and_changes_nothing(make, sample):
    bad, good = make(), make()
    phi, force = press(120)
    for estimator in (bad, good):
        estimator.update_many(phi[:60], force[:60])
    with pytest.raises(InputError):
        bad.update(*sample)
    for estimator in (bad, good):
        estimator.update_many(phi[60:], force[60:])
    np.testing.assert_array_equal(told(bad), told(good))


@every
def test_of_many_samples_the_bad_one_is_named_and_those_before_are_in(make):
    phi, force = press(50)
    broken = phi.copy()
    broken[20, 1] = np.nan
    bad, good = make(), make()
    with pytest.raises(InputError, match="sample 20 is not finite"):
        bad.update_many(broken, force)
    good.update_many(phi[:20], force[:20])
    np.testing.assert_array_equal(told(bad), told(good))


@every
def test_a_copy_goes_its_own_way_and_a_pickle_goes_on(make):
    phi, force = press(200)
    estimator = make()
    estimator.update_many(phi[:100], force[:100])
    copied, thawed = copy.deepcopy(estimator), pickle.loads(pickle.dumps(estimator))
    before = told(estimator)
    copied.update_many(phi[100:], force[100:])
    np.testing.assert_array_equal(told(estimator), before)
    thawed.update_many(phi[100:], force[100:])
    np.testing.assert_array_equal(told(thawed), told(copied))
    thawed.update(phi[0], force[0])


@every
def test_nothing_is_identified_before_the_first_sample(make):
    assert set(make().estimate().verdicts().values()) == {"not identifiable"}
    assert make().estimate().samples == 0.0


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
            assert np.isfinite(told(estimator)).all()
    estimator.update_many(phi, force)
    assert estimator.theta[2] == pytest.approx(TRUTH[2], rel=0.05)


@linear
def test_without_forgetting_it_is_the_batch_solution(make):
    """Each with its memory as long as it can be."""
    kind, phi_force = make(), press(400)
    phi, force = phi_force
    if isinstance(kind, KalmanFilter):
        estimator, r = KalmanFilter(START, VAGUE, np.zeros(3), noise=0.7), 0.49
    else:
        estimator, r = type(kind)(START, VAGUE), 1.0
    estimator.update_many(phi, force)
    # On the square root, which keeps the digits that the normal equations lose.
    design = np.vstack([phi / np.sqrt(r), np.diag(1.0 / np.sqrt(np.diag(VAGUE)))])
    right = np.concatenate([force / np.sqrt(r), np.zeros(3)])
    Q, R = np.linalg.qr(design)
    inverse = np.linalg.inv(R)
    np.testing.assert_allclose(estimator.theta, inverse @ (Q.T @ right), rtol=1e-9)
    np.testing.assert_allclose(estimator.covariance, inverse @ inverse.T, rtol=1e-7)


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
@pytest.mark.parametrize(("pole", "least"), [(0.0, 0.90), (0.8, 0.88)], ids=["white", "coloured"])
def test_the_stated_interval_covers_the_truth_at_its_rate(make, pole, least):
    """300 runs know a rate of 95 % to 1.3 %; a second has few blocks to know the colour of its noise by."""
    from scipy.signal import lfilter

    inside = []
    for seed in range(300):
        phi, _ = press(1000, seed)
        white = np.random.default_rng(1000 + seed).normal(0.0, NOISE, 1100)
        noise = lfilter([np.sqrt(1.0 - pole**2)], [1.0, -pole], white)[100:]
        estimator = make()
        estimator.update_many(phi, phi @ TRUTH + noise)
        estimate = estimator.estimate()
        inside.append(np.abs(estimate.theta - TRUTH) < 1.96 * estimate.std)
    covered = np.mean(inside, axis=0)
    assert np.all(covered > least), covered
    assert np.all(covered < 0.995), covered


@linear
def test_what_is_given_back_is_a_copy(make):
    estimator = make()
    before = told(estimator)
    estimator.theta[:] = 7.0
    estimator.covariance[:] = 7.0
    estimator.estimate().covariance[:] = 7.0
    np.testing.assert_array_equal(told(estimator), before)


@linear
@pytest.mark.parametrize(
    ("arguments", "why"),
    [
        ((np.zeros(0), np.zeros((0, 0))), "n at least 1"),
        ((START, np.eye(2)), r"shape \(3, 3\)"),
        ((START, -np.eye(3)), "positive definite"),
        ((START, np.diag([1.0, np.inf, 1.0])), "finite"),
        (([0.0, np.nan, 0.0], np.eye(3)), "finite"),
    ],
    ids=["nothing", "size", "negative", "infinite", "not a number"],
)
def test_a_bad_start_is_refused(make, arguments, why):
    with pytest.raises(InputError, match=why):
        make(*arguments)
