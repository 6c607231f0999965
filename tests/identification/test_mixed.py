"""The mixed model: weighted least squares where nothing else is there, and variances of what is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.identification.estimators.mixed import Design, Levels, estimate, expanded, solve
from palpate.identification.estimators.octaves import Segment, longest_of, octaves_of

DT = 1e-2
ROWS = 2000
TRUTH = np.array([5.0, -2.0])


def coloured_columns(seed, count=2):
    """Columns with power at all frequencies, more of it at low ones, without a mean."""
    rng = np.random.default_rng(seed)
    own = rng.normal(size=(ROWS, count))
    return own + np.cumsum(rng.normal(size=(ROWS, count)), axis=0) / 10


def system_of(columns, force, segments=None, effects=None, prior=None):
    names = tuple("KBM"[: columns.shape[1] - sum(len(e) for e in (effects or {}).values())])
    segments = segments or [Segment(0, len(force))]
    octaves = octaves_of(np.column_stack([columns, force]), segments, DT, longest_of(segments))
    return expanded(octaves, Design(names, prior or {}, effects or {}))


def two_columns(seed=0, noise=0.5, extra=None):
    own = coloured_columns(seed)
    rng = np.random.default_rng([seed, 1])
    return own, own @ TRUTH + rng.normal(0, noise, ROWS) + (0.0 if extra is None else extra)


def levels_of(system, noise=1.0, effect=0.0):
    return Levels(np.full(len(system.lines), noise), dict.fromkeys(system.effects, effect))


@pytest.mark.parametrize("last", [1.0, 0.1])
def test_without_effects_it_is_weighted_least_squares(last):
    """Over lines, summed by hand; but for the weak prior that no term is many times the force."""
    own, force = two_columns()
    system = system_of(own, force)
    noise = np.geomspace(1.0, last, len(system.lines))
    gram = sum(part[:2, :2] / s for part, s in zip(system.products, noise, strict=True))
    right = sum(part[:2, 2] / s for part, s in zip(system.products, noise, strict=True))
    found = solve(system, Levels(noise, {}))
    np.testing.assert_allclose(found.theta, np.linalg.solve(gram, right), rtol=1e-5)
    np.testing.assert_allclose(found.cov, np.linalg.inv(gram), rtol=1e-5)


def test_effects_of_no_variance_change_nothing():
    own, force = two_columns()
    plain = system_of(own, force)
    other = np.random.default_rng(9).normal(size=(ROWS, 2))
    both = system_of(np.column_stack([own, other]), force, effects={"other": (2, 3)})
    one, two = solve(plain, levels_of(plain)), solve(both, levels_of(both, effect=1e-200))
    np.testing.assert_allclose(two.theta[:2], one.theta, rtol=1e-9)
    np.testing.assert_allclose(two.cov[:2, :2], one.cov, rtol=1e-9)
    np.testing.assert_allclose(two.theta[2:], 0.0, atol=1e-9)


def test_where_there_is_nothing_else_its_variance_comes_to_nothing():
    """Theta is that of the columns alone to half of its deviation, and as sure."""
    for seed in range(6):
        own, force = two_columns(seed)
        other = np.random.default_rng([seed, 5]).normal(size=(ROWS, 3))
        system = system_of(np.column_stack([own, other]), force, effects={"other": (2, 3, 4)})
        found, levels = estimate(system)
        alone, alone_levels = estimate(system_of(own, force))
        std = np.sqrt(np.diag(alone.cov))
        assert (np.abs(found.theta[:2] - alone.theta) < 0.5 * std).all()
        assert np.sqrt(np.diag(found.cov)[:2]) == pytest.approx(std, rel=0.2)
        assert levels.effects["other"] < 0.01 * levels.noise[-1]
        assert alone_levels.noise[-1] == pytest.approx(0.25, rel=0.2)


def test_the_noise_of_each_octave_is_found():
    """Noise of one level below a frequency and another above; 60 lines and more to an octave that is judged."""
    own = coloured_columns(3)
    white = np.random.default_rng(4).normal(size=ROWS)
    from scipy.signal import butter, sosfiltfilt

    slow = sosfiltfilt(butter(6, 2.0, fs=1 / DT, output="sos"), white)
    force = own @ TRUTH + 3.0 * slow + np.random.default_rng(5).normal(0, 0.1, ROWS)
    segments = [Segment(0, ROWS)]
    octaves = octaves_of(np.column_stack([own, force]), segments, DT, ROWS)
    _, levels = estimate(expanded(octaves, Design(("K", "B"), {}, {})))
    low = (octaves.all_lines >= 16) & (1.4 * octaves.frequency < 1.5)
    high = octaves.frequency / 1.4 > 3.5
    assert low.any()
    assert high.any()
    assert levels.noise[low] == pytest.approx(9.0, rel=0.9)
    assert levels.noise[high] == pytest.approx(0.01, rel=0.5)


def test_a_planted_variance_is_recovered():
    """Twenty effects of one variance: their sum of squares deviates by sqrt(2/20) of it; four of those, and the mean."""
    found = []
    for seed in range(12):
        rng = np.random.default_rng([seed, 7])
        own, other = coloured_columns(seed), rng.normal(size=(ROWS, 20))
        effect = rng.normal(0, 3.0, 20)
        force = own @ TRUTH + other @ effect + rng.normal(0, 0.5, ROWS)
        system = system_of(np.column_stack([own, other]), force, effects={"other": tuple(range(2, 22))})
        solution, levels = estimate(system)
        found.append(levels.effects["other"])
        np.testing.assert_allclose(solution.theta[2:22], effect, atol=0.3)
    assert np.mean(found) == pytest.approx(9.0, rel=4 * np.sqrt(2 / 20 / 12))


def test_a_direction_without_information_is_not_known():
    """Two columns that are one: what they do together is known, and each of them not at all."""
    for seed in range(20):
        own, force = two_columns(seed, noise=1e-6)
        size = float(np.random.default_rng(seed).uniform(0.1, 10))
        twin = np.column_stack([own[:, 0], size * own[:, 0]])
        system = system_of(twin, force)
        found = solve(system, levels_of(system, 1e-12))
        assert (np.sqrt(np.diag(found.cov)) > 1e3 * np.abs(found.theta)).all()
        alone = system_of(own[:, :1], force)
        expected = solve(alone, levels_of(alone, 1e-12)).theta[0]
        assert found.theta @ [1, size] == pytest.approx(expected, rel=1e-6)


def test_a_column_of_nothing_is_not_known():
    own, force = two_columns()
    system = system_of(np.column_stack([own, np.zeros(ROWS)]), force)
    found = solve(system, levels_of(system, 0.25))
    assert found.cov[2, 2] > 1e6 * found.cov[:2, :2].max() or not np.isfinite(found.cov[2, 2])
    np.testing.assert_allclose(found.theta[:2], TRUTH, atol=0.2)


def test_a_prior_is_an_observation_as_good_as_its_deviation():
    own, force = two_columns()
    free = system_of(own, force)
    alone = solve(free, levels_of(free, 0.25))
    own_std = np.sqrt(alone.cov[0, 0])
    told = system_of(own, force, prior={"K": (4.0, own_std)})
    found = solve(told, levels_of(told, 0.25))
    assert found.theta[0] == pytest.approx((alone.theta[0] + 4.0) / 2, rel=1e-5)
    assert found.cov[0, 0] == pytest.approx(own_std**2 / 2, rel=1e-4)


def found_of(force, own, drift):
    system = system_of(np.column_stack([own, drift]), force, effects={"drift": (2,)})
    return estimate(system)


@settings(max_examples=10, deadline=None)
@given(st.floats(-6, 6), st.floats(-6, 6), st.integers(0, 50))
def test_units_of_force_and_position_do_not_count(force_size, position_size, seed):
    """Theta has the unit of force over position, and everything else follows."""
    c, s = 10.0**force_size, 10.0**position_size
    own, force = two_columns(seed)
    drift = np.linspace(-1, 1, ROWS)[:, None]
    one, one_levels = found_of(force, own, drift)
    other, other_levels = found_of(c * force, s * own, s * drift)
    # The fixed point stops when no noise moves by 1e-4.
    np.testing.assert_allclose(other.theta[:2] * s / c, one.theta[:2], rtol=1e-3)
    np.testing.assert_allclose(np.diag(other.cov)[:2] * (s / c) ** 2, np.diag(one.cov)[:2], rtol=1e-2)
    np.testing.assert_allclose(other_levels.noise / c**2, one_levels.noise, rtol=1e-2)


def test_octaves_that_do_not_count_are_as_if_there_were_none():
    own, force = two_columns()
    system = system_of(own, force)
    use = np.ones(len(system.lines), bool)
    use[:3] = False
    some = solve(system, levels_of(system), use)
    cut = replace(system, products=np.where(use[:, None, None], system.products, 0.0))
    np.testing.assert_allclose(some.theta, solve(cut, levels_of(cut)).theta, rtol=1e-12)
