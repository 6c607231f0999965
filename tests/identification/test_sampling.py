"""What the channels of a log are: steps of time that no machine could follow, and the last digit it was rounded to."""

from __future__ import annotations

import numpy as np
import pytest

from identification.synthetic_contacts import pressed, record
from palpate.errors import InputError
from palpate.identification import identify
from palpate.identification.sampling import channels_of, last_digit
from palpate.identification.steady_press import strokes_of


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


def test_a_stroke_begins_where_the_probe_last_rested():
    time = np.arange(5000) / 1000
    position = np.interp(time, [0.0, 0.5, 1.5, 3.0, 5.0], [0.0, 0.3e-3, 0.3e-3, 2e-3, 0.0])
    advance, retreat = strokes_of(channels_of(record(time, position, 3000 * position)))
    assert (advance.way, retreat.way) == (1, -1)
    assert 1.45 < advance.begin < 1.6
