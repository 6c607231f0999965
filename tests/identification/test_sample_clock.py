"""The sensor's own samples, found behind readings that a faster log has held."""

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from palpate.identification.sample_clock import sample_clock_of

STEP = 1 / 12
"""Of the grid that the instants of 480 samples a second fall on, between 1000 rows a second [rows]."""


def estimate_with_fixed(instants, samples, count):
    """What `count` rows show of samples that came out at these instants: each row the last one until then."""
    shown = np.searchsorted(instants, np.arange(count), side="right") - 1
    return samples[shown]


def grid(period, phase, count):
    """An even grid of instants [rows] from before the first to the last row, the first shown in row 0."""
    instants = phase + period * np.arange(-1, int(count / period) + 2)
    return instants[instants <= count - 1]


def noisy(seed, number):
    return np.random.default_rng(seed).normal(size=number)


def rows_of(instants):
    return np.ceil(instants).astype(int)


periods = st.floats(1.15, 12.0)
phases = st.floats(0.001, 0.999).filter(lambda p: 0.01 < p * 25 % 1 < 0.99)
"""Of a period; with 480 samples in 1000 rows none of them comes out at the very instant of a row."""
seeds = st.integers(0, 2**32 - 1)


@settings(max_examples=40)
@example(1.250001, 0.75, 0)  # all lines of this pattern are as strong
@given(periods, phases, seeds)
def test_any_even_grid_is_recovered(period, phase, seed):
    count = 1500
    instants = grid(period, phase * period, count)
    # Where a sample comes out at the very instant of a row, rounding decides which row shows it.
    assume(np.abs(instants - np.round(instants)).min() > 1e-7)
    values = estimate_with_fixed(instants, noisy(seed, len(instants)), count)
    found = sample_clock_of(values)
    inside = instants[instants > 0]
    wanted, rows = rows_of(inside), found.rows[found.instants > 0]
    # The first sample and the last may stand so near to the edge of their row that they count as out of the log.
    assert set(wanted[1:-1]) <= set(rows.tolist())
    assert set(rows[1:-1]) <= set(wanted.tolist())
    place = np.searchsorted(found.rows, wanted[1:-1])
    # The true grid and the one found both lie among those that show this pattern, `spread` being that of their phases
    # in the middle of the log; farther out a period that is not known either adds to it, up to the row itself.
    error = (found.instants[place] - inside[1:-1])[len(place) // 2]
    assert abs(error) <= 2 * np.sqrt(3) * found.spread + 4 / len(wanted)
    assert found.period == pytest.approx(period, abs=4 / len(wanted) + 1e-9)


def test_at_its_rate():
    """Over all phases, the error has the deviation that is stated and no mean."""
    errors, spreads = [], []
    for seed in range(40):
        phase = np.random.default_rng([seed, 1]).uniform(0, 25 / 12)
        instants = grid(25 / 12, phase, 500)
        found = sample_clock_of(estimate_with_fixed(instants, noisy(seed, len(instants)), 500))
        place = np.searchsorted(found.rows, rows_of(instants[5]))
        errors.append(found.instants[place] - instants[5])
        spreads.append(found.spread)
    scaled = np.array(errors) / spreads
    assert abs(scaled.mean()) < 3 / np.sqrt(40)
    assert scaled.std() == pytest.approx(
        1.0, abs=0.21
    )  # three deviations of 40 numbers of an even distribution


def test_a_sensor_that_rests_for_long_is_followed_through():
    """Ten samples of fifty each, and nothing in between: the count goes on."""
    instants = grid(25 / 12, 0.4, 3000)
    samples = noisy(3, len(instants))
    moving = (np.arange(len(samples)) // 60) % 2 == 0
    samples = np.where(moving, samples, np.repeat(samples[::60], 60)[: len(samples)])
    found = sample_clock_of(estimate_with_fixed(instants, samples, 3000))
    place = np.searchsorted(found.rows, rows_of(instants[3:-3]))
    assert np.abs(found.instants[place] - instants[3:-3]).max() <= STEP


@pytest.mark.parametrize("drift", [-2e-4, -3e-5, 3e-5, 2e-4])
def test_a_clock_that_is_off_by_parts_in_a_million_is_not_taken_for_the_nominal_one(drift):
    """Over 20 s, 0.2 per mille is four rows; every sample is found, and far nearer than the row it shows in."""
    period = 25 / 12 * (1 + drift)
    instants = grid(period, 0.3, 20_000)
    found = sample_clock_of(estimate_with_fixed(instants, noisy(4, len(instants)), 20_000))
    place = np.searchsorted(found.rows, rows_of(instants[3:-3]))
    assert found.period == pytest.approx(period, abs=1e-6)
    # The rows that a drifting grid passes leave less than STEP open.
    assert np.abs(found.instants[place] - instants[3:-3]).max() < 0.02
    assert found.spread < STEP / np.sqrt(12)


@pytest.mark.parametrize("nominal", [2.0, 3.0, 10.0])
@pytest.mark.parametrize("slips", [-2.4, -1.6, 0.0, 1.6, 2.4])
def test_a_clock_in_step_with_the_rows_but_for_a_few(nominal, slips):
    """A sample more or less every some seconds: near 2 rows, one kind looks nearly like the other."""
    instants = grid(nominal * (1 + slips / 20_000), 0.3, 20_000)
    found = sample_clock_of(estimate_with_fixed(instants, noisy(4, len(instants)), 20_000))
    own = instants[3:-3]
    place = np.searchsorted(found.rows, rows_of(own))
    np.testing.assert_array_equal(found.rows[place], rows_of(own))
    error = found.instants[place] - own
    assert np.abs(error).max() < 1.0
    # What moves the lag of all of them is the mean, and that is stated: up to a whole row in step, less after slips.
    assert abs(error.mean()) <= np.sqrt(3) * found.spread + 1e-3
    if slips == 0:
        assert found.spread == pytest.approx(1 / np.sqrt(12), rel=0.01)


def test_a_clock_without_an_even_beat_leaves_each_sample_half_a_row_before_it_shows():
    rng = np.random.default_rng(5)
    instants = np.cumsum(25 / 12 + rng.uniform(-0.6, 0.6, 900))
    samples = noisy(6, 900)
    values = estimate_with_fixed(np.r_[-1.0, instants], np.r_[0.0, samples], 1800)
    found = sample_clock_of(values)
    own = np.intersect1d(found.rows, rows_of(instants), return_indices=True)
    assert len(own[0]) >= 860  # two samples within one row are one change
    error = found.instants[own[1]] - instants[own[2]]
    assert np.abs(error).max() <= 0.5 + 1e-9
    # What is stated is how well the mean of them is known, which the lag is confounded with.
    assert abs(error.mean()) < 4 * found.spread
    assert found.spread < 0.02


@pytest.mark.parametrize(("period", "repeated"), [(1.0, 0.0), (1.05, 0.0), (1.0, 0.2), (1.0, 0.6)])
def test_a_channel_as_fast_as_the_log_is_fresh_in_every_row(period, repeated):
    """However often it reads the same twice."""
    instants = grid(period, 0.0, 500)
    rng = np.random.default_rng(7)
    samples = noisy(7, len(instants))
    for k in np.flatnonzero(rng.uniform(size=len(samples)) < repeated):
        samples[k] = samples[k - 1]
    found = sample_clock_of(estimate_with_fixed(instants, samples, 500))
    np.testing.assert_array_equal(found.rows, np.arange(500))
    np.testing.assert_array_equal(found.instants, np.arange(500.0))
    assert (found.spread, found.period) == (0.0, 1.0)


@given(st.integers(1, 9), st.integers(0, 400))
def test_what_hardly_ever_changes_has_no_grid_of_its_own(changes, first):
    values = np.zeros(5000)
    for k in range(changes):
        values[first + 480 * k + 1 :] += 1.0
    found = sample_clock_of(values)
    np.testing.assert_array_equal(found.rows, np.arange(5000))


@pytest.mark.parametrize("period", [60.0, 100.3, 1000.7])
def test_a_sensor_a_hundred_times_slower_than_the_log(period):
    instants = grid(period, 0.3, 20_000)
    found = sample_clock_of(estimate_with_fixed(instants, noisy(9, len(instants)), 20_000))
    own = instants[instants > 0]
    place = np.searchsorted(found.rows, rows_of(own))
    assert np.abs(found.instants[place] - own).max() <= 0.5
    assert found.period == pytest.approx(period, rel=1e-3)
