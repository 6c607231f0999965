"""What the channels of a log are: steps of time that no machine could follow, and the last digit it was rounded to."""

from __future__ import annotations

import numpy as np
import pytest

from identification.synthetic_contacts import pressed, record
from palpate.errors import InputError
from palpate.identification import identify
from palpate.identification.sample_clock import past_end
from palpate.identification.sampling import channels_of, last_digit


def test_a_jump_of_the_time_that_would_fill_the_memory_is_refused():
    log = pressed()
    late = log["time"] + np.where(np.arange(len(log)) >= 1500, 1e6, 0.0)
    with pytest.raises(InputError, match="the time jumps by 1e\\+06 s at row 1501"):
        identify(record(late, log["position"], log["force"]))


def test_a_cut_off_far_below_a_short_log_is_no_crash():
    t = np.arange(24) / 1000
    x = np.interp(t, [0, 0.01, 0.024], [-1e-3, 2e-3, 1e-3])
    force = np.maximum(3000 * x, 0) + np.random.default_rng(0).normal(0, 0.01, len(t))
    with pytest.raises(InputError, match="needed"):
        identify(record(t, x, force), bonded=True, cutoff=1.0)


@pytest.mark.parametrize("digit", [1e-3, 2.5e-5])
@pytest.mark.parametrize("unit", [1.0, 1e-3, 4.44822])
def test_the_last_digit_of_a_log_is_found_in_any_unit(digit, unit):
    values = 0.2 + np.random.default_rng(0).normal(0, 0.05, 4000)
    assert last_digit(np.round(values / digit) * digit * unit) == pytest.approx(digit * unit, rel=1e-6)


def test_readings_that_are_no_multiples_have_no_last_digit():
    values = np.random.default_rng(0).normal(size=4000)
    assert last_digit(values) == 0.0
    assert last_digit(np.round(values, 3) + 1e-4 * np.sin(np.arange(4000))) == 0.0


def test_spikes_of_one_row_are_bridged_and_noise_and_edges_stay():
    log, rng = pressed(), np.random.default_rng(0)
    force = log["force"] + rng.normal(0, 0.02, len(log))
    at = np.array([300, 900, 1500, 2100])
    spiked = force.copy()
    spiked[at] += np.array([1, -1, 0.5, -0.3]) * np.ptp(force)
    found = channels_of(record(log["time"], log["position"], spiked))
    assert ["stand alone" in warn.text for warn in found.warnings] == [True]
    assert np.abs(found.force - force)[at].max() < 0.01 * np.ptp(force)
    rest = np.delete(np.arange(len(force)), at)
    np.testing.assert_array_equal(found.force[rest], force[rest])
    steps = np.where(np.arange(len(log)) % 500 < 250, 0.0, 10.0) + rng.normal(0, 0.02, len(log))
    for clean in (force, steps, np.round(force, 1)):
        assert not channels_of(record(log["time"], log["position"], clean)).warnings


def test_a_position_at_the_end_of_its_sensor_carries_no_stiffness():
    rng = np.random.default_rng(0)
    t = np.arange(8000) / 1000
    depth = 1e-3 - 3e-3 * np.cos(2 * np.pi * 0.7 * t)
    force = np.maximum(2000 * depth, 0) + rng.normal(0, 0.02, len(t))
    seen = np.minimum(depth + rng.normal(0, 1e-6, len(t)), 2.6e-3)
    found = identify(record(t, seen, force), lag=0.0)
    assert "the position rests at its extreme value" in found.warnings[0].text
    low, high = found.working_point.stiffness.ci95
    assert 1900 < low < 2000 < high < 2100


@pytest.mark.parametrize("late", [0, 30])
def test_a_hold_is_no_end_of_the_position(late):
    """Its force relaxes, and a late one rises a while after the position has come to rest."""
    t = np.arange(4000) / 1000
    depth = np.interp(t, [0.5, 0.8, 3.0, 3.3], [-1e-3, 3e-3, 3e-3, -1e-3])
    relaxed = 1 + 0.5 * np.exp(-np.maximum(t - 0.8, 0) / 0.7)
    force = np.roll(np.maximum(2000 * depth, 0) * relaxed, late) + np.random.default_rng(0).normal(
        0, 0.02, len(t)
    )
    assert not past_end(depth, force).any()
