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


@pytest.mark.parametrize("lag", [-0.0123, -0.0004, 0.0003, 0.001, 0.0457])
def test_a_lag_moves_the_signal_between_samples(lag):
    time = np.arange(2000) * CHAIN.dt
    slow = 2 * np.pi * 5
    found = CHAIN(np.sin(slow * time), 0, lag)[300:1700]
    expected = np.imag((1 + 1j * slow / CHAIN.rate) ** -ORDER * np.exp(1j * slow * (time - lag)))[300:1700]
    np.testing.assert_allclose(found, expected, atol=2e-4)


def test_one_lag_against_scipy():
    u = 3 + np.random.default_rng(1).normal(size=400)
    b, a, _ = signal.cont2discrete(([1.0], [0.05, 1.0]), 1e-3, method="foh")
    read = low_passed(u, LowPass.of_first_order(0.05), 1e-3) - u[0]
    np.testing.assert_allclose(read, signal.lfilter(np.ravel(b), a, u - u[0]), atol=1e-12)


def test_white_noise_is_measured_under_a_slow_motion():
    rng = np.random.default_rng(2)
    noisy = np.sin(np.arange(5000) / 50) + rng.normal(0, 1e-3, 5000)
    assert white_noise(noisy) == pytest.approx(1e-3, rel=0.1)
