"""What the channels of a log are: steps of time that no machine could follow, and the last digit it was rounded to."""

from __future__ import annotations

import numpy as np
import pytest

from identification.synthetic_contacts import pressed, record
from palpate.errors import InputError
from palpate.identification import identify
from palpate.identification.sampling import last_digit


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
