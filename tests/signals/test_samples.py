"""Detrending, convolution, quadrature and periodogram against those of `scipy.signal`; rounding to steps."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import signal
from scipy.fft import next_fast_len

from palpate._jit import kernel
from palpate._vector import Vec3
from palpate.signals.samples import convolve, periodogram, quadrature, quantise, whole

reasonable = st.floats(-1e12, 1e12)
LENGTHS = (3, 16, 101, 4097)
"""Even, odd, below and above the length of a direct convolution."""


@pytest.fixture(params=LENGTHS)
def values(request):
    return np.random.default_rng(request.param).standard_normal(request.param) + 3.0


@pytest.mark.parametrize("taps", [1, 256, 257, 3000])
def test_a_convolution_is_the_same_direct_or_by_lines(values, taps):
    response = np.random.default_rng(taps).standard_normal(taps)
    expected = signal.convolve(values, response, method="direct")
    assert np.allclose(convolve(values, response), expected, rtol=0, atol=1e-9)


def test_every_frequency_is_a_quarter_of_a_period_later(values):
    expected = np.imag(signal.hilbert(values, next_fast_len(2 * len(values))))[: len(values)]
    assert np.allclose(quadrature(values), expected, rtol=0, atol=1e-12)


def test_power_by_frequency(values):
    size = next_fast_len(len(values), real=True)
    frequency, power = signal.periodogram(values, window=("tukey", 0.1), nfft=size)
    found = periodogram(values, 0.1)
    assert np.allclose(found[0], frequency, rtol=0, atol=1e-15)
    assert np.allclose(found[1], power, rtol=1e-9, atol=1e-12)


@given(reasonable)
def test_whole_rounds_to_the_nearest_and_ties_to_even(u):
    assert whole(u) == round(u)


@given(st.floats(-1e6, 1e6), st.floats(1e-6, 1e3))
def test_the_error_is_half_a_step_at_most(u, step):
    assert abs(quantise(u, step) - u) <= 0.5 * step * (1 + 1e-9) + 1e-9


@kernel
def compiled(u, step):
    return quantise(u, step)


def test_numbers_vectors_arrays_and_compiled_agree():
    values = np.array([-2.5, -0.3, 1.26])
    vector = quantise(Vec3(*values), 0.1)
    np.testing.assert_array_equal(vector, quantise(values, 0.1))
    np.testing.assert_array_equal(vector, [quantise(u, 0.1) for u in values])
    np.testing.assert_array_equal(vector, compiled(Vec3(*values), 0.1))
    np.testing.assert_allclose(vector, [-2.5, -0.3, 1.3])
