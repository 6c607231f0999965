"""Filters against scipy.signal, the thesis' printed coefficients, and their own stated lag."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import signal

from palpate._jit import kernel
from palpate._vector import Vec3
from palpate.errors import InputError
from palpate.signals.filters import (
    Biquad,
    Delay,
    butterworth2,
    butterworth3,
    delay,
    lowpass1,
    lowpass2,
    state_variable,
)

RATE = 1000.0
FILTERS = {
    "lowpass1": lowpass1(50.0, RATE),
    "butterworth2 at 120 Hz": butterworth2(120.0, RATE),
    "butterworth2 at 35 Hz": butterworth2(35.0, RATE),
    "resonant lowpass2": lowpass2(60.0, 2.0, RATE),
    "butterworth3": butterworth3(120.0, RATE),
    "delay": delay(7.6e-3, RATE),
    "no delay": delay(0.0, RATE),
}
each = pytest.mark.parametrize("part", FILTERS.values(), ids=FILTERS.keys())


def stream(part, samples, state):
    out = []
    for u in samples:
        y, state = part.step(state, u)
        out.append(y)
    return np.array(out), state


@kernel
def stream_compiled(part, samples, state, out):
    for k in range(samples.size):
        out[k], state = part.step(state, samples[k])
    return state


def polynomials(b: Biquad):
    return [b.b0, b.b1, b.b2], [1.0, b.a1, b.a2]


@pytest.mark.parametrize("cutoff", [0.5, 35.0, 120.0, 499.0])
def test_butterworth2_is_the_textbooks(cutoff):
    ours = np.concatenate(polynomials(butterworth2(cutoff, RATE)))
    np.testing.assert_allclose(ours, np.concatenate(signal.butter(2, cutoff, fs=RATE)), rtol=0, atol=1e-12)


@pytest.mark.parametrize(
    ("cutoff", "printed"),
    [(120.0, (0.0913, 0.1826, 0.0913, 0.9824, -0.3477)), (35.0, (0.0104, 0.0209, 0.0104, 1.691, -0.7327))],
)
def test_butterworth2_has_the_coefficients_of_appendix_e(cutoff, printed):
    b = butterworth2(cutoff, RATE)
    np.testing.assert_allclose((b.b0, b.b1, b.b2, -b.a1, -b.a2), printed, rtol=0, atol=5e-5)


@pytest.mark.parametrize(("cutoff", "rate"), [(120.0, 1000.0), (120.0, 20000.0)])
def test_butterworth3_is_the_textbooks(cutoff, rate):
    cascade = butterworth3(cutoff, rate)
    numerator = np.convolve(polynomials(cascade.first)[0][:2], polynomials(cascade.second)[0])
    denominator = np.convolve(polynomials(cascade.first)[1][:2], polynomials(cascade.second)[1])
    ours = np.concatenate((numerator, denominator))
    np.testing.assert_allclose(ours, np.concatenate(signal.butter(3, cutoff, fs=rate)), rtol=0, atol=1e-12)


def test_lowpass2_is_the_bilinear_transform_of_its_analog():
    frequency, quality, rate = 189.6, 0.83, 20000.0
    w = 2 * rate * math.tan(math.pi * frequency / rate)
    analog = signal.bilinear([w * w], [1.0, w / quality, w * w], rate)
    ours = np.concatenate(polynomials(lowpass2(frequency, quality, rate)))
    np.testing.assert_allclose(ours, np.concatenate(analog), rtol=1e-9)


@pytest.mark.parametrize("cutoff", [5.0, 120.0])
def test_step_is_scipys_filter(cutoff):
    samples = np.random.default_rng(0).normal(size=500)
    b = butterworth2(cutoff, RATE)
    np.testing.assert_allclose(
        stream(b, samples, b.start())[0], signal.lfilter(*polynomials(b), samples), atol=1e-12
    )


@each
def test_a_constant_passes_unchanged_from_the_start(part):
    out, _ = stream(part, [3.7] * 50, part.start_at(3.7))
    np.testing.assert_allclose(out, 3.7, rtol=1e-12)


@each
def test_start_is_the_steady_state_of_zero(part):
    assert stream(part, [0.0], part.start())[0] == 0.0
    np.testing.assert_array_equal(np.ravel(part.start()), np.ravel(part.start_at(0.0)))


@each
def test_a_ramp_comes_out_late_by_the_stated_lag(part):
    time = np.arange(2000) / RATE
    out, _ = stream(part, time, part.start())
    assert (time - out)[-1] == pytest.approx(part.lag, abs=1e-9)


@each
def test_vectors_are_three_channels(part):
    samples = np.random.default_rng(1).normal(size=(60, 3))
    start = part.start_at(Vec3(0.0, 0.0, 0.0))
    together, _ = stream(part, [Vec3(*u) for u in samples], start)
    apart = [stream(part, channel, part.start())[0] for channel in samples.T]
    np.testing.assert_array_equal(together, np.transpose(apart))


@each
def test_compiled_is_plain(part):
    samples = np.random.default_rng(2).normal(size=300)
    compiled = np.empty_like(samples)
    state = stream_compiled(part, samples, part.start(), compiled)
    plain, plain_state = stream(part, samples, part.start())
    np.testing.assert_array_equal(compiled, plain)
    np.testing.assert_array_equal(np.ravel(state), np.ravel(plain_state))


@pytest.mark.parametrize("cutoff", [10.0, 35.0, 120.0])
@pytest.mark.parametrize("order", [0, 1, 2])
def test_each_channel_is_the_bilinear_transform_of_its_derivative(cutoff, order):
    part = state_variable(cutoff, RATE)
    w = 2 * RATE * part.g
    numerator = w * w * np.array([1.0, *[0.0] * order])
    coefficients = signal.bilinear(numerator, [1.0, w * part.damping, w * w], RATE)
    samples = np.random.default_rng(3).normal(size=400)
    channels, _ = stream(part, samples, part.start())
    expected = signal.lfilter(*coefficients, samples)
    np.testing.assert_allclose(channels[:, order], expected, atol=1e-9 * np.abs(expected).max())


def test_matched_channels_of_a_parabola_are_its_derivatives():
    part = state_variable(35.0, RATE)
    time = np.arange(1500) / RATE
    channels, _ = stream(part, 0.5 * time**2, part.start())
    np.testing.assert_allclose(channels[-1, 1], time[-1] - part.lag, rtol=1e-9)
    np.testing.assert_allclose(channels[-1, 2], 1.0, rtol=1e-6)


def test_state_variable_lag_compiled_and_on_vectors():
    part = state_variable(35.0, RATE)
    time = np.arange(1500) / RATE
    channels, _ = stream(part, time, part.start())
    assert time[-1] - channels[-1, 0] == pytest.approx(part.lag, abs=1e-9)
    vectors, _ = stream(part, [Vec3(t, 2 * t, 0.0) for t in time[:50]], part.start_at(Vec3(0.0, 0.0, 0.0)))
    np.testing.assert_array_equal(vectors[:, 0, 0], channels[:50, 0])
    compiled = np.empty(50)
    channels_compiled(part, time[:50], compiled)
    np.testing.assert_array_equal(compiled, channels[:50].sum(axis=1))


@kernel
def channels_compiled(part, samples, out):
    state = part.start()
    for k in range(samples.size):
        channel, state = part.step(state, samples[k])
        out[k] = channel.value + channel.rate + channel.second


@given(st.floats(0.0, 9.0))
def test_a_delay_interpolates_between_neighbours(samples):
    part = Delay(samples, RATE)
    ramp = np.arange(40.0)
    out, _ = stream(part, ramp, part.start_at(0.0))
    np.testing.assert_allclose(out[10:], ramp[10:] - samples, atol=1e-12)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: butterworth2(500.0, RATE), "cut-off must be between 0 and half the rate .500 Hz., got 500"),
        (lambda: butterworth2(0.0, RATE), "cut-off"),
        (lambda: lowpass1(-3.0, RATE), "cut-off"),
        (lambda: lowpass2(30.0, 0.0, RATE), "quality must be above 0"),
        (lambda: state_variable(30.0, RATE, -1.0), "quality"),
        (lambda: state_variable(math.nan, RATE), "cut-off"),
        (lambda: delay(9.5e-3, RATE), "samples of delay must be between 0 and 9, got 9.5"),
        (lambda: delay(-1e-3, RATE), "samples of delay"),
    ],
)
def test_bad_parameters_are_refused_with_their_limit(make, words):
    with pytest.raises(InputError, match=words):
        make()
