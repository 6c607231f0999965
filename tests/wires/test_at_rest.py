"""The rate of an arm, by the stamps of those readings that came."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.wires.at_rest import sampling_rate


@pytest.mark.parametrize("share", [0.0, 0.3, 0.6])
def test_readings_that_never_came_do_not_make_an_arm_slow(share):
    rng = np.random.default_rng(0)
    stamps = 0.008 * np.arange(200) + rng.normal(0.0, 1e-4, 200)
    came = np.r_[True, rng.random(198) >= share, True]
    assert sampling_rate(stamps[came]) == pytest.approx(125.0, rel=1e-3)


def test_stamps_that_shake_by_a_tenth_of_a_tick_tell_the_mean():
    stamps = 0.01 * np.arange(60) + np.random.default_rng(1).normal(0.0, 1e-3, 60)
    assert sampling_rate(stamps) == pytest.approx(100.0, rel=0.01)


def test_an_arm_that_is_slow_is_slow():
    assert sampling_rate(0.032 * np.arange(20)) == pytest.approx(31.25)
    assert sampling_rate(np.zeros(3)) > 0.0
