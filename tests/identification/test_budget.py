"""How far off each parameter may be, by cause: each cause planted in data that have it."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.fft import idct
from scipy.stats import t as student

from identification.test_mixed import DT, ROWS, coloured_columns, levels_of, system_of
from palpate.identification.estimators import budget as causes
from palpate.identification.estimators.budget import HIDDEN_SHARE, Spread
from palpate.identification.estimators.mixed import Levels, Solution, solve
from palpate.identification.estimators.octaves import Segment, line_frequencies, octave_of

NOISE = 0.1


def solution(theta, std):
    return Solution(np.array(theta, float), np.diag(np.square(np.array(std, float))))


def flat_columns(seed=0, count=1):
    """White columns: each octave has power by its lines."""
    return np.random.default_rng(seed).normal(size=(ROWS, count))


def by_octave(column, stiffness):
    """A force whose stiffness is another in each octave of the column."""
    from scipy.fft import dct

    lines = dct(column - column.mean(), norm="ortho")
    frequency = line_frequencies(ROWS, DT)
    number = octave_of(frequency, frequency[0])
    return idct(np.r_[0.0, lines[1:] * stiffness[number]], norm="ortho")


def test_two_halves_that_differ_leave_half_of_their_difference():
    """The mean of both is off by half of it, less what their own deviations account for."""
    found = causes.of_halves(solution([10.0, 1.0], [0.3, 1.0]), solution([16.0, 1.1], [0.4, 1.0]), 2)
    assert np.sqrt(found.variance[0]) == pytest.approx(np.sqrt(36 - 0.25) / 2)
    assert found.variance[1] == 0.0


@given(st.floats(0.01, 10), st.floats(0.01, 10), st.floats(-1, 1))
def test_halves_that_agree_within_their_deviations_add_nothing(one, other, share):
    apart = share * np.hypot(one, other) * 0.999
    found = causes.of_halves(solution([5.0], [one]), solution([5.0 + apart], [other]), 1)
    assert found.variance[0] == 0.0


@pytest.mark.parametrize("off", [0.0, 3.0])
def test_an_octave_that_differs_is_seen_by_leaving_it_out(off):
    """Its pull on the answer of all is what the jackknife finds, and no more than a deviation where none differs."""
    column = flat_columns()
    stiffness = np.full(20, 5.0)
    stiffness[6] += off
    force = by_octave(column[:, 0], stiffness) + np.random.default_rng(1).normal(0, NOISE, ROWS)
    system = system_of(column, force)
    levels = levels_of(system, NOISE**2)
    whole = solve(system, levels)
    found = np.sqrt(causes.of_octaves(system, levels, whole).variance[0])
    share = system.products[6, 0, 0] / system.products[:, 0, 0].sum()
    std = np.sqrt(whole.cov[0, 0])
    if off:
        assert whole.theta[0] - 5.0 == pytest.approx(off * share, abs=3 * std)
        assert found == pytest.approx(off * share, abs=3 * std)
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
    assert np.sqrt(found.variance[0]) == pytest.approx(HIDDEN_SHARE * pull, rel=1e-9)
    none = causes.of_unexplained(system, levels, solve(system, levels), seen)
    assert none.variance[0] == 0.0


def test_more_of_the_same_log_does_not_hide_what_is_unexplained():
    """Noise of the sensor averages out over four times the lines; a force that nothing explains does not."""
    shares = []
    for rows in (500, 2000):
        column = np.random.default_rng(3).normal(size=(rows, 1))
        system = system_of(column, 5.0 * column[:, 0], [Segment(0, rows, 0)])
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
    system = system_of(own, force, effects={"other": (3,)}, local=(0,), prior={"M": (0.0, 0.01)})
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


def test_strokes_that_say_no_more_than_they_must_add_nothing():
    whole, part = solution([5.0, 1.0], [0.1, 0.1]), solution([5.4, 3.0], [0.5, 0.5])
    found = causes.of_strokes(whole, part, 2)
    assert found.variance[0] == 0.0  # .4 apart, where the part's deviation is .49 larger
    assert found.variance[1] == pytest.approx(4.0 - 0.24)


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
