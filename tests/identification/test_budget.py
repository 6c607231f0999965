"""How far off each parameter may be, by cause: each cause planted in data that have it."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import t as student

from identification.test_mixed import DT, ROWS, coloured_columns, levels_of, system_of
from palpate.identification.estimators import budget as causes
from palpate.identification.estimators.budget import HIDDEN_SHARE, Spread
from palpate.identification.estimators.mixed import Levels, Solution, solve
from palpate.identification.estimators.octaves import PERIODS, Segment

NOISE = 0.1


def solution(theta, std):
    return Solution(np.array(theta, float), np.diag(np.square(np.array(std, float))))


def flat_columns(seed=0, count=1):
    """White columns: each octave has power by its lines."""
    return np.random.default_rng(seed).normal(size=(ROWS, count))


def stiffer_about(column, frequency, more):
    """A force of stiffness 5, and more in one octave [Hz]."""
    lines = np.fft.rfft(column)
    at = np.fft.rfftfreq(ROWS, DT)
    inside = (at > frequency / 2**0.5) & (at < frequency * 2**0.5)
    return np.fft.irfft(lines * np.where(inside, 5.0 + more, 5.0), ROWS)


def stretches(values, std):
    """Means of stretches, each known to a deviation: the whole's, and with one left out."""
    count = len(values)
    parts = [solution([np.delete(values, i).mean()], [std / np.sqrt(count - 1)]) for i in range(count)]
    return solution([np.mean(values)], [std / np.sqrt(count)]), parts


def test_stretches_that_differ_have_the_variance_of_their_mean():
    """The jackknife of a mean is its variance, less what their own deviations account for."""
    values = np.array([3.0, 9.0, 5.0, 7.0, 6.0])
    found = causes.of_stretches(*stretches(values, 0.1), 1)
    assert found.variance[0] == pytest.approx(values.var(ddof=1) / 5 - 0.1**2 / 5)
    assert found.freedom == 4


def test_stretches_that_agree_within_their_deviations_add_next_to_nothing():
    """In the mean over seeds: a fifth of the variance that is known already."""
    added = []
    for seed in range(100):
        values = np.random.default_rng(seed).normal(5.0, 1.0, 8)
        added.append(causes.of_stretches(*stretches(values, 1.0), 1).variance[0])
    assert np.mean(added) < 0.25 / 8 * 1.0 + 1e-9


@pytest.mark.parametrize("off", [0.0, 3.0])
def test_an_octave_that_differs_is_seen_by_leaving_it_out(off):
    """Its pull on the answer of all is what the jackknife finds, and no more than a deviation where none differs."""
    column = flat_columns()
    at = PERIODS / (ROWS // 16 * DT)
    noise = np.random.default_rng(1).normal(0, NOISE, ROWS)
    system = system_of(column, stiffer_about(column[:, 0], at, off) + noise)
    levels = levels_of(system, NOISE**2)
    whole = solve(system, levels)
    found = np.sqrt(causes.of_octaves(system, levels, whole).variance[0])
    pull = abs(whole.theta[0] - 5.0)
    std = np.sqrt(whole.cov[0, 0])
    if off:
        assert pull > 10 * std
        assert found > pull / 2  # the octaves beside it overlap with it
        assert found < 2 * pull
    else:
        assert found < 3 * std


def test_a_force_that_nothing_explains_is_bounded_by_what_is_seen_of_it():
    """A spring whose force is off by a known amount in one octave: half of that may lie along its column."""
    column = flat_columns()
    system = system_of(column, 5.0 * column[:, 0])
    count = len(system.lines)
    noise = np.full(count, NOISE**2)
    seen = noise.copy()
    seen[4] += 2.0**2
    levels = Levels(seen, {})
    found = causes.of_unexplained(system, levels, solve(system, levels), noise)
    weight = 1 / seen
    gram = system.products[:, 0, 0]
    # All lines of the octave may conspire: a force of amplitude 2 in each, along the column.
    pull = np.sqrt(system.lines[4] * 2.0**2 * gram[4]) * weight[4] / (weight @ gram)
    assert np.sqrt(found.variance[0]) == pytest.approx(HIDDEN_SHARE * pull, rel=1e-6)
    none = causes.of_unexplained(system, levels, solve(system, levels), seen)
    assert none.variance[0] == 0.0


def test_more_of_the_same_log_does_not_hide_what_is_unexplained():
    """Noise of the sensor averages out over four times the lines; a force that nothing explains does not."""
    shares = []
    for rows in (500, 2000):
        column = np.random.default_rng(3).normal(size=(rows, 1))
        system = system_of(column, 5.0 * column[:, 0], [Segment(0, rows)])
        levels = Levels(np.full(len(system.lines), 1.0), {})
        whole = solve(system, levels)
        hidden = causes.of_unexplained(system, levels, whole, np.full(len(system.lines), 0.01))
        shares.append(np.sqrt([hidden.variance[0], whole.cov[0, 0]]))
    (hidden, noise), (hidden_long, noise_long) = shares
    assert noise_long == pytest.approx(noise / 2, rel=0.1)
    assert hidden_long > 0.6 * hidden


def test_parts_of_the_covariance_add_up_to_it():
    """Noise, lag and other forces: whatever the share of each, together the mixed model's own."""
    own = np.column_stack([coloured_columns(0), flat_columns(1), flat_columns(2)])
    force = own[:, :2] @ [5.0, 2.0] + np.random.default_rng(5).normal(0, NOISE, ROWS)
    system = system_of(own, force, effects={"other": (3,)}, prior={"M": (0.0, 0.01)})
    levels = Levels(np.full(len(system.lines), NOISE**2), dict.fromkeys(system.effects, 0.04))
    whole = solve(system, levels)
    parts = causes.of_system(system, levels, whole, lag=2)
    assert set(parts) == {"noise", "lag", "other forces"}
    total = sum(part.variance for part in parts.values())
    np.testing.assert_allclose(total, np.diag(whole.cov)[:3], rtol=1e-9)
    assert parts["other forces"].variance[0] > 0
    assert parts["lag"].variance[2] == 0.0


def test_what_a_lag_does_is_the_difference_between_known_and_unknown():
    own = np.column_stack([flat_columns(0), flat_columns(0) + 0.5 * flat_columns(1)])
    force = own @ [5.0, 0.0] + np.random.default_rng(5).normal(0, NOISE, ROWS)
    free = system_of(own, force)
    levels = levels_of(free, NOISE**2)
    parts = causes.of_system(free, levels, solve(free, levels), lag=1)
    known = system_of(own[:, :1], force)
    assert parts["noise"].variance[0] == pytest.approx(
        solve(known, levels_of(known, NOISE**2)).cov[0, 0], rel=1e-9
    )
    whole = solve(free, levels).cov[0, 0]
    assert parts["lag"].variance[0] == pytest.approx(whole - parts["noise"].variance[0], rel=1e-9)


def test_half_widths_are_students_for_one_cause():
    for freedom in (1.0, 4.0, 30.0):
        found = causes.half_widths({"one": Spread(np.array([4.0]), freedom)})
        assert found[0] == pytest.approx(2 * student.ppf(0.975, freedom))


def test_of_two_causes_the_better_known_one_does_not_suffer():
    """Welch and Satterthwaite: two alike variances of n degrees have 2 n; a small one of few hardly counts."""
    alike = {"one": Spread(np.array([2.0]), 5.0), "two": Spread(np.array([2.0]), 5.0)}
    assert causes.half_widths(alike)[0] == pytest.approx(2 * student.ppf(0.975, 10))
    small = {"sure": Spread(np.array([4.0])), "open": Spread(np.array([1e-4]), 1.0)}
    assert causes.half_widths(small)[0] == pytest.approx(2 * 1.96, rel=1e-3)


@given(st.floats(-140, 140))
def test_half_widths_have_the_unit_of_the_parameter(size):
    variance = np.array([3.0, 0.0])
    parts = {"one": Spread(variance, 3.0), "two": Spread(2 * variance)}
    scaled = {name: Spread(10.0**size * part.variance, part.freedom) for name, part in parts.items()}
    one, other = causes.half_widths(parts), causes.half_widths(scaled)
    np.testing.assert_allclose(other, 10 ** (size / 2) * one, rtol=1e-6)
    assert one[1] == 0.0
