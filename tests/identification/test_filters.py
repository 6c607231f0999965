from __future__ import annotations

import numpy as np
import pytest
from scipy import signal

from palpate.identification.filters import ORDER, Chain, low_passed
from palpate.signals.low_pass import LowPass
from palpate.signals.samples import white_noise

CHAIN = Chain(cutoff=60.0, dt=1e-3)


@pytest.mark.parametrize("derivative", range(4))
def test_the_chain_is_the_state_variable_filter(derivative):
    """Against scipy's first-order hold of s^k (w/(s+w))^5."""
    w = CHAIN.rate
    numerator = np.r_[w**ORDER, np.zeros(derivative)]
    b, a, _ = signal.cont2discrete((numerator, np.poly([-w] * ORDER)), CHAIN.dt, method="foh")
    u = np.cumsum(np.random.default_rng(0).normal(size=500))
    expected = signal.lfilter(np.ravel(b), a, u - u[0]) + (u[0] if derivative == 0 else 0)
    np.testing.assert_allclose(CHAIN(u, derivative), expected, atol=1e-6 * np.abs(expected).max())


@pytest.mark.parametrize("derivative", range(4))
def test_derivatives_of_a_sine_are_analytic(derivative):
    time = np.arange(3000) * CHAIN.dt
    omega = 2 * np.pi * 20
    expected = omega**derivative * np.imag(
        1j**derivative * (1 + 1j * omega / CHAIN.rate) ** -ORDER * np.exp(1j * omega * time)
    )
    found = CHAIN(np.sin(omega * time), derivative)
    np.testing.assert_allclose(found[500:], expected[500:], atol=0.003 * omega**derivative)


def test_all_derivatives_share_one_gain():
    """What interpolation takes from a sine it takes from each derivative alike: ratios are those of j omega."""
    time = np.arange(6000) * CHAIN.dt
    omega = 2 * np.pi * 80
    rows = slice(1000, 5000)
    basis = np.exp(-1j * omega * time[rows])
    parts = [np.mean(CHAIN(np.sin(omega * time), k)[rows] * basis) for k in range(3)]
    assert parts[1] / parts[0] == pytest.approx(1j * omega, rel=2e-4)
    assert parts[2] / parts[0] == pytest.approx(-(omega**2), rel=5e-4)


@pytest.mark.parametrize("lag", [-0.0123, -0.0004, 0.0003, 0.001, 0.0457])
def test_a_lag_moves_the_signal_between_samples(lag):
    time = np.arange(2000) * CHAIN.dt
    slow = 2 * np.pi * 5
    found = CHAIN(np.sin(slow * time), 0, lag)[300:1700]
    expected = np.imag((1 + 1j * slow / CHAIN.rate) ** -ORDER * np.exp(1j * slow * (time - lag)))[300:1700]
    np.testing.assert_allclose(found, expected, atol=2e-4)


def test_a_constant_passes_unchanged():
    np.testing.assert_allclose(CHAIN(np.full(100, 7.0)), 7.0, rtol=1e-12)


def test_one_lag_against_scipy():
    u = 3 + np.random.default_rng(1).normal(size=400)
    b, a, _ = signal.cont2discrete(([1.0], [0.05, 1.0]), 1e-3, method="foh")
    read = low_passed(u, LowPass.of_first_order(0.05), 1e-3) - u[0]
    np.testing.assert_allclose(read, signal.lfilter(np.ravel(b), a, u - u[0]), atol=1e-12)


def test_white_noise_is_measured_under_a_slow_motion():
    rng = np.random.default_rng(2)
    noisy = np.sin(np.arange(5000) / 50) + rng.normal(0, 1e-3, 5000)
    assert white_noise(noisy) == pytest.approx(1e-3, rel=0.1)
