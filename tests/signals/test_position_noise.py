"""The noise of a position, judged from above the band of its motion."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.signals.position_noise import NOISELESS, PositionNoise, position_noise
from palpate.signals.samples import quantise

SAMPLES = 6000
TIME = np.arange(SAMPLES) / 1000
MOTION = 1e-3 * (np.sin(2 * np.pi * 0.8 * TIME) + np.sin(2 * np.pi * 30 * TIME) / 20)
COUNT = 5e-6


def white(std, seed=0, n=SAMPLES):
    return np.random.default_rng(seed).normal(0, std, n)


FREQUENCY = np.fft.rfftfreq(256)
SHAPE = np.column_stack([4 * np.sin(np.pi * FREQUENCY) ** 2, np.ones_like(FREQUENCY)])[FREQUENCY >= 0.2]
"""Of the increments' power above all motion, one row a line: from white noise and from jumps."""


def covariance(noise, jump, count=SAMPLES):
    """Of both squares, as least squares have them from the spectrum of so many samples.

    A periodogram's line deviates by its own power; Hann's window ties it to its neighbours by 4/9 and 1/36, and half
    overlapping segments by 1/6 to the next (their squared correlations).
    """
    power = SHAPE @ [noise**2, jump**2]
    apart = np.abs(np.subtract.outer(np.arange(len(power)), np.arange(len(power))))
    tied = np.select([apart == 0, apart == 1, apart == 2], [1, 4 / 9, 1 / 36])
    segments = (count - 1 - 256) // 128 + 1
    solve = np.linalg.pinv(SHAPE)
    return solve @ (tied * np.outer(power, power) * (1 + 2 / 36) / segments) @ solve.T


def assert_chance(found, squares, spread):
    """Four deviations at most: of either square, and of the power of both, which is known far better."""
    error = np.square([found.white, found.jump]) - squares
    for part in ([1, 0], [0, 1], SHAPE.mean(axis=0)):
        assert abs(np.dot(part, error)) <= 4 * np.sqrt(part @ spread @ part)


def test_over_many_seeds_both_are_right_and_deviate_as_least_squares_do():
    positions = (white(1e-6, [k, 0]) + np.cumsum(white(2e-6, [k, 1])) + MOTION for k in range(200))
    found = [position_noise([position]) for position in positions]
    squares = np.array([(own.white**2, own.jump**2) for own in found])
    expected = np.sqrt(np.diag(covariance(1e-6, 2e-6)))
    # Four deviations of a mean of 200; a deviation measured on 200 is known to 5 %, and neighbouring lines of
    # neighbouring segments, which the derivation leaves out, add some.
    np.testing.assert_array_less(np.abs(squares.mean(axis=0) - [1e-12, 4e-12]), 4 * expected / np.sqrt(200))
    np.testing.assert_allclose(squares.std(axis=0), expected, rtol=0.25)


@pytest.mark.parametrize(("noise", "jump"), [(1e-6, 0.0), (0.0, 1e-6)])
def test_one_alone_leaves_of_the_other_what_chance_does(noise, jump):
    for seed in range(40):
        found = position_noise([white(noise, [seed, 0]) + np.cumsum(white(jump, [seed, 1]))])
        assert_chance(found, [noise**2, jump**2], covariance(noise, jump))


@settings(max_examples=20)
@given(st.floats(-9, -3), st.floats(-10, 10))
def test_its_unit_and_its_origin_do_not_count(size, origin):
    scale = 10.0**size
    position = white(1.0, 1) + np.cumsum(white(0.5, 2))
    one, other = position_noise([position]), position_noise([scale * position + origin])
    # What rounding makes white noise of: half of the last bit of up to 10 beside a deviation of 1e-9 and more.
    assert other.white == pytest.approx(scale * one.white, rel=1e-6)
    assert other.jump == pytest.approx(scale * one.jump, rel=1e-6)


def test_an_encoder_that_is_run_through_quickly_makes_white_noise():
    """Each reading somewhere in its count: a deviation of 1/sqrt(12) of it (Widrow's model of quantising)."""
    fast = 20e-3 * np.sin(2 * np.pi * 2.0 * TIME)  # 40 counts a sample, at most
    std = COUNT / np.sqrt(12)
    assert_chance(position_noise([quantise(fast, COUNT)]), [std**2, 0.0], covariance(std, 0.0))


def test_one_that_is_run_through_slowly_makes_jumps():
    """A count every hundred samples; each jump then stands alone: their power is a count's square, once in as many."""
    slow = quantise(COUNT / 100 * np.arange(6000) + 40 * COUNT * np.sin(TIME / 3), COUNT)
    found = position_noise([slow])
    rate = np.mean(np.diff(slow) != 0)
    assert found.jump == pytest.approx(COUNT * np.sqrt(rate), rel=0.35)


def test_a_count_is_seen_where_it_is_made_alone():
    slow = quantise(COUNT / 100 * np.arange(6000) + 40 * COUNT * np.sin(TIME / 3), COUNT)
    assert position_noise([slow]).count == pytest.approx(COUNT, rel=1e-6)
    coarser = slow + quantise(2e-3 * np.sin(TIME) + 1e-6, 6 * COUNT)
    assert position_noise([coarser]).count > 3 * COUNT, "of two encoders, the coarser counts more"


def test_no_count_is_seen_in_what_never_rests():
    assert position_noise([MOTION]).count == 0.0
    assert position_noise([white(1e-6)]).count == 0.0


def test_of_a_walk_that_stays_half_the_power_of_its_jumps_counts():
    """For jumps that undo each other within 500 samples."""
    from scipy.signal import lfilter

    walk = lfilter([1.0], [1.0, -np.exp(-1 / 500)], np.random.default_rng(11).normal(size=2_000_000))
    kernel = np.pad(np.hanning(40), 3)  # so that its slopes sum to nothing
    weights = np.gradient(kernel / kernel.sum())
    # Of 2e6 / 40 independent values, one of which is uncertain by half: 1 %; the level beside the jumps adds 5 %.
    rate = lfilter(weights, [1.0], walk)[100:]
    assert np.mean(rate**2) == pytest.approx(2 * PositionNoise(0.0, 1.0).variance(weights), rel=0.05)


@pytest.mark.parametrize("stretches", [[], [np.zeros(15)], [white(1.0, 0, 15)] * 9])
def test_too_short_a_stretch_says_nothing(stretches):
    assert position_noise(stretches) == NOISELESS


def test_a_smooth_motion_has_no_noise():
    found = position_noise([MOTION])
    # Hann's window lets through A^2 N / (6 pi^2 k^6) of increments of amplitude A at k lines' distance: here of the
    # 30 Hz, 1e-3 / 20 * 2 pi 0.03 m, at 0.17 * 256 lines.
    limit = 1e-3 / 20 * 2 * np.pi * 0.03 * np.sqrt(256 / 6) / np.pi / (0.17 * 256) ** 3
    assert found.white < limit
    assert found.jump < limit
    assert position_noise([np.full(500, 3.0)]) == NOISELESS
