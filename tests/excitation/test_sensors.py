"""Information by frequencies is the information of the samples."""

from __future__ import annotations

import numpy as np
import pytest
from cramer_rao import cramer_rao_bound

from palpate.excitation import ForceChain, LinearSurface, Sensors
from palpate.excitation.power_spectrum import covariance
from palpate.excitation.sensors import LAG_UNIT

FOAM = LinearSurface(5200.0, 200.0, 0.1)


def test_it_is_that_of_the_samples_of_the_same_motion():
    frequencies, seconds = np.array([0.5, 3.0, 11.0, 27.0, 39.5]), 8.0
    omega = 2 * np.pi * frequencies
    force = np.array([2.0, 1.0j, -1.0, 0.7, 0.5 + 0.5j])
    chain = ForceChain(phase_std=2.4e-5)
    sensors = Sensors(chain, position_step=0.0, lag_std=1e-4)
    told = seconds * sensors.information(FOAM, omega, force).sum(axis=0)
    relative = np.sqrt(np.diag(covariance(told, sensors.prior())))

    t = np.arange(round(seconds * 1000) + 1) / 1000
    phasors = force / FOAM.impedance(omega)
    x = 3e-3 + np.imag(np.exp(1j * np.multiply.outer(t, omega)) @ phasors)
    truth = dict(zip("KBM", FOAM.values, strict=True))
    std = cramer_rao_bound(t, x, truth, chain, known={"lag": 1e-4}).std
    expected = [std[0] / 5200.0, std[1] / 200.0, std[2] / 0.1]
    # The ends of the motion, and the offset that the samples must find as well, cost a little.
    assert relative[:3] == pytest.approx(expected, rel=0.02)
    # There the lag is that of the log; here it is what a sample feels, the phase of the sampling included.
    assert np.hypot(relative[3] * LAG_UNIT, 0) == pytest.approx(np.hypot(std[4], 2.4e-5), rel=0.05)


def test_a_coarse_position_tells_less_most_of_all_at_high_frequencies():
    omega, force = 2 * np.pi * np.array([1.0, 39.0]), np.ones(2, complex)
    fine = Sensors(position_step=0.0).information(FOAM, omega, force)[:, 0, 0]
    coarse = Sensors(position_step=1e-4).information(FOAM, omega, force)[:, 0, 0]
    assert (coarse < fine).all()
    assert coarse[1] / fine[1] < coarse[0] / fine[0]


def test_position_noise_is_a_force_of_its_own():
    """Quantisation q of the position and a stiff spring alone: a white force of K q / sqrt(12) at the log's rate."""
    spring = LinearSurface(1e5, 1e-9)
    q, omega = 1e-4, 2 * np.pi * np.array([0.01])
    noisy = Sensors(ForceChain(noise=1e-9), position_step=q, rate=1000.0)
    found = noisy.information(spring, omega, np.ones(1, complex))[0, 0, 0]
    # One second of a sine of amplitude 1 in noise of that size, 1000 samples: n/2 / var.
    assert found == pytest.approx(500 / ((1e5 * q) ** 2 / 12), rel=1e-3)
