"""The noise of a position, judged from above the band of its motion."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.identification.position_noise import NOISELESS, position_noise
from palpate.signals.quantise import quantise

TIME = np.arange(6000) / 1000
MOTION = 1e-3 * (np.sin(2 * np.pi * 0.8 * TIME) + np.sin(2 * np.pi * 30 * TIME) / 20)
COUNT = 5e-6


def white(std, seed=0, n=None):
    return np.random.default_rng(seed).normal(0, std, len(TIME) if n is None else n)


@settings(max_examples=20)
@given(st.floats(-9, -3), st.integers(0, 1000), st.sampled_from([0.0, 1.0]))
def test_white_noise_is_measured_under_any_motion(size, seed, moves):
    std = 10.0**size
    found = position_noise([moves * MOTION * 1e-3 + white(std, seed) + 7.0])
    # 6000 samples, of whose spectrum the upper part counts: 2 %; jumps may take some of it in chance.
    assert found.white == pytest.approx(std, rel=0.1)
    assert found.jump < 0.3 * std


@settings(max_examples=20)
@given(st.floats(-9, -3), st.integers(0, 1000))
def test_so_are_jumps(size, seed):
    std = 10.0**size
    found = position_noise([np.cumsum(white(std, seed))])
    assert found.jump == pytest.approx(std, rel=0.1)
    assert found.white < 0.3 * std


def test_both_are_told_apart():
    found = position_noise([white(2e-6, 1) + np.cumsum(white(1e-6, 2)) + MOTION])
    assert found.white == pytest.approx(2e-6, rel=0.1)
    assert found.jump == pytest.approx(1e-6, rel=0.2)


def test_an_encoder_that_is_run_through_quickly_makes_white_noise():
    """Each reading somewhere in its count: a deviation of 1/sqrt(12) of it (Widrow's model of quantising)."""
    fast = 20e-3 * np.sin(2 * np.pi * 2.0 * TIME)  # 40 counts a sample, at most
    found = position_noise([quantise(fast, COUNT)])
    assert found.white == pytest.approx(COUNT / np.sqrt(12), rel=0.05)


def test_one_that_is_run_through_slowly_makes_jumps():
    """A count every hundred samples; each jump then stands alone: their power is a count's square, once in as many."""
    slow = quantise(COUNT / 100 * np.arange(6000) + 40 * COUNT * np.sin(TIME / 3), COUNT)
    found = position_noise([slow])
    rate = np.mean(np.diff(slow) != 0)
    assert found.jump == pytest.approx(COUNT * np.sqrt(rate), rel=0.35)


def test_stretches_count_by_their_length():
    """One of each noise: the mean power, and no jump where one ends and another begins."""
    found = position_noise([white(1e-6, 3, 4000), 1.0 + white(2e-6, 4, 4000), -5.0 + white(3e-6, 5, 1000)])
    power = (4000 * 1e-12 + 4000 * 4e-12 + 1000 * 9e-12) / 9000
    assert found.white == pytest.approx(np.sqrt(power), rel=0.1)
    assert found.jump < 0.3e-6


def test_short_stretches_are_enough_together():
    found = position_noise([white(1e-6, seed, 40) for seed in range(200)])
    assert found.white == pytest.approx(1e-6, rel=0.1)


@pytest.mark.parametrize("stretches", [[], [np.zeros(15)], [white(1.0, 0, 15)] * 9])
def test_too_short_a_stretch_says_nothing(stretches):
    assert position_noise(stretches) == NOISELESS


def test_a_smooth_motion_has_no_noise():
    found = position_noise([MOTION])
    # What a window of 256 lets through of a motion of 1 mm below 30 Hz.
    assert found.white < 2e-11
    assert found.jump < 2e-11
    assert position_noise([np.full(500, 3.0)]) == NOISELESS
