"""The Cramer-Rao bound: its derivatives, its limits by hand, and that an efficient estimator attains it."""

from __future__ import annotations

import numpy as np
import pytest
from cramer_rao import NAMES, cramer_rao_bound, filter_at, instants, sensitivities

from palpate.excitation import ForceChain
from palpate.excitation.sensors import phase_std
from palpate.signals.low_pass import LowPass

FOAM = {"K": 5200.0, "B": 200.0, "M": 0.1}


SENSOR = ForceChain()


def multisine(seconds=5.0, rate=1000.0):
    """A smooth motion with enough in it for all of K, B and M."""
    t = np.arange(round(seconds * rate) + 1) / rate
    rng = np.random.default_rng(4)
    x = 3e-3 + sum(
        2e-4 * np.sin(2 * np.pi * f * t + phase)
        for f, phase in zip((0.7, 3.0, 9.0, 17.0, 31.0, 40.0), rng.uniform(0, 6, 6), strict=True)
    )
    return t, x


def test_the_filter_is_exact_for_a_sine_between_the_rows():
    t = np.arange(2001) / 1000.0
    omega = 2 * np.pi * 25.0
    at = np.array([0.5003, 0.7771, 1.2345])
    H = SENSOR.low_pass.at(np.array([omega]))[0]
    found = filter_at(t, np.sin(omega * t), SENSOR.low_pass, at)
    for k, row in enumerate(found):
        exact = np.imag((1j * omega) ** k * H * np.exp(1j * omega * at))
        # The sine ends in the middle of the grid's band with another second derivative; what that leaves is small.
        assert row == pytest.approx(exact, abs=1e-5 * omega**k)


def test_the_derivative_by_the_lag_is_that_of_a_force_read_later():
    t, x = multisine()
    at = np.arange(0.5, 4.5, 1 / 480)
    value = np.array([FOAM["K"], FOAM["B"], FOAM["M"]])

    def force(late):
        return filter_at(t, x, SENSOR.low_pass, at - late, 3).T @ value

    slope = (force(1e-5) - force(-1e-5)) / 2e-5
    assert sensitivities(t, x, FOAM, SENSOR.low_pass, at)[:, 4] == pytest.approx(
        slope, rel=1e-5, abs=0.02
    )  # of some 3000 N/s


def test_a_still_press_knows_the_force_as_a_mean_does_and_nothing_else():
    t = np.arange(1001) / 1000.0
    still = np.full_like(t, 3e-3)
    found = cramer_rao_bound(t, still, FOAM, SENSOR, known={"K": 0.0, "B": 0.0, "M": 0.0})
    assert found.samples == 481
    assert found.std[NAMES.index("offset")] == pytest.approx(0.6 / np.sqrt(481))
    assert found.std[0] == 0.0
    free = cramer_rao_bound(t, still, FOAM, SENSOR)
    assert set(free.verdicts().values()) >= {"not identifiable"}
    assert free.verdicts()["K"] == free.verdicts()["B"] == free.verdicts()["M"] == "not identifiable"


def test_one_sine_by_hand():
    """With K alone unknown, over whole periods: var K = 2 noise^2 / (n X^2)."""
    t = np.arange(4001) / 1000.0
    x = 1e-3 * np.sin(2 * np.pi * 5.0 * t)
    chain = ForceChain(LowPass(), sampling=500.0)
    found = cramer_rao_bound(t, x, {"K": 5e3}, chain, known={"B": 0.0, "M": 0.0})
    assert found.std[0] == pytest.approx(0.6 * np.sqrt(2 / 2001) / 1e-3, rel=1e-3)


def test_linear_least_squares_with_the_true_regressors_attains_it():
    t, x = multisine(2.0)
    at = instants(t, 480.0)
    J = sensitivities(t, x, FOAM, SENSOR.low_pass, at)[:, :4]
    theta = np.array([*FOAM.values(), 1.0])
    noise = 0.6 * np.random.default_rng(1).standard_normal((len(at), 4000))
    found = np.linalg.lstsq(J, (J @ theta)[:, None] + noise, rcond=None)[0]
    std = cramer_rao_bound(t, x, FOAM, SENSOR).std[:4]
    # 4000 trials know a standard deviation to 1.1 %; four of them here.
    assert found.std(axis=1) == pytest.approx(std, rel=0.045)
    assert np.abs(found.mean(axis=1) - theta) == pytest.approx(0, abs=4 * std.max() / np.sqrt(4000))


def test_estimating_the_lag_too_attains_it():
    """One step of Gauss and Newton from near the truth, over random lags that the prior covers."""
    t, x = multisine(2.0)
    at = instants(t, 480.0, (0.02, 1.98))
    rng = np.random.default_rng(2)
    prior, trials = 2e-4, 3000
    J = sensitivities(t, x, FOAM, SENSOR.low_pass, at)
    lags = prior * rng.standard_normal(trials)
    # Second order in the lag is below a hundredth of the noise here, so the model is linear in it.
    readings = J[:, 4:] * lags + 0.6 * rng.standard_normal((len(at), trials))
    weight = np.diag([0, 0, 0, 0, (0.6 / prior) ** 2])
    found = np.linalg.solve(J.T @ J + weight, J.T @ readings)
    found[4] -= lags
    std = cramer_rao_bound(t, x, FOAM, SENSOR, known={"lag": prior}, span=(0.02, 1.98)).std
    assert found.std(axis=1) == pytest.approx(std, rel=0.05)


def test_the_phase_of_the_samples_is_a_lag_that_no_log_can_tell_from_the_sensors():
    t, x = multisine()
    phase = phase_std(480, 1000)
    assert phase == pytest.approx(1e-3 / 12 / np.sqrt(12))
    open_ = ForceChain(phase_std=phase)
    calibrated = cramer_rao_bound(t, x, FOAM, open_)
    by_hand = cramer_rao_bound(t, x, FOAM, SENSOR, known={"lag": phase})
    assert calibrated.std[:4] == pytest.approx(by_hand.std[:4], rel=1e-6)
    free = cramer_rao_bound(t, x, FOAM, open_, known={"lag": np.inf, "M": 0.0}).std[4]
    sharp = cramer_rao_bound(t, x, FOAM, SENSOR, known={"lag": np.inf, "M": 0.0}).std[4]
    assert free == pytest.approx(np.hypot(sharp, phase), rel=1e-6)


def test_a_slow_motion_confounds_lag_damping_and_mass_but_not_stiffness():
    t = np.arange(8001) / 1000.0
    x = 3e-3 + 1e-3 * np.sin(2 * np.pi * 1.0 * t)
    known = cramer_rao_bound(t, x, FOAM, SENSOR)
    free = cramer_rao_bound(t, x, FOAM, SENSOR, known={"lag": np.inf})
    assert free.std[1] > 50 * known.std[1]
    corr = free.covariance[1, 4] / (free.std[1] * free.std[4])
    assert corr == pytest.approx(1.0, abs=1e-3)  # dB = K dT
    assert free.covariance[1, 4] / free.covariance[4, 4] == pytest.approx(FOAM["K"], rel=0.02)
