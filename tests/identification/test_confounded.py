"""What an uncalibrated lag can be mistaken for, and what a spring in series cannot be."""

from __future__ import annotations

import numpy as np
import pytest

from identification.synthetic_contacts import coloured, press_path, record
from palpate.identification import Verdict, identify

TRUTH = {"K": 20_000.0, "B": 400.0, "M": 0.5}
_FINE = 20_000


def heavy(rate=1000, ramp=0.2, m=0.5, b=400.0, lag=0.0, seed=0):
    """A press on f = max(K d + b d' + m d'', 0), computed at 20 kHz and read at `rate`."""
    fine = np.arange(3 * _FINE) / _FINE
    x = press_path(fine, ramp)
    v = np.gradient(x, 1 / _FINE)
    inside = np.maximum(TRUTH["K"] * x + b * v + m * np.gradient(v, 1 / _FINE), 0)
    force = np.where(x > 0, inside, 0)
    time = np.arange(3 * rate) / rate
    noise = coloured(len(time), 0.05, 0.5, np.random.default_rng(seed))
    return record(time, np.interp(time, fine, x), np.interp(time - lag, fine, force) + noise)


def contradicts(parameter, truth):
    """A number that is said to be identified and far off: an interval of 95 % is missed once in twenty, not by half."""
    if parameter.verdict is not Verdict.IDENTIFIED:
        return False
    low, high = parameter.ci95
    return abs(truth - parameter.value) > 1.5 * (high - low) / 2


@pytest.mark.parametrize("rate", [250, pytest.param(1000, marks=pytest.mark.long)])
@pytest.mark.parametrize("lag", [0.0, 0.005])
def test_a_mass_that_hides_behind_a_lag_is_in_the_interval(rate, lag):
    """Nobody tells the lag: M a looks like a lag of -M/B of B v, and K x late like a damping."""
    found = identify(heavy(rate, lag=lag))
    for name, truth in TRUTH.items():
        assert not contradicts(found.parameters[name], truth), name
    assert found.parameters["K"].value == pytest.approx(TRUTH["K"], rel=0.02)
    assert abs(found.lag.value - lag) < 1.5 * found.lag.bound  # a half-width is exceeded once in twenty


def test_nothing_hides_behind_a_lag_that_is_calibrated():
    found = identify(heavy(), lag=0.0)
    for name, truth in TRUTH.items():
        assert not contradicts(found.parameters[name], truth)
    for name in ("K", "B"):
        assert found.parameters[name].verdict is Verdict.IDENTIFIED
        assert found.parameters[name].value == pytest.approx(TRUTH[name], rel=0.05)


@pytest.mark.parametrize("b", [5.0, 100.0])
@pytest.mark.parametrize("ramp", [pytest.param(0.06, marks=pytest.mark.long), 0.2])
def test_a_lag_that_nobody_told_leaves_the_stiffness_right(b, ramp):
    found = identify(heavy(m=0.0, b=b, lag=0.008, ramp=ramp))
    assert not contradicts(found.parameters["K"], TRUTH["K"])
    assert not contradicts(found.parameters["B"], b)


def shaken(lag, seed=0, stiffness=5200.0, damping=20.0):
    """Ten seconds of six tones about a depth, never in free motion; noise of .02 N and 100 nm."""
    rng = np.random.default_rng(seed)
    time = np.arange(10_000) / 1000
    tones = 2 * np.pi * np.geomspace(0.3, 12, 6)
    phases = rng.uniform(0, 2 * np.pi, 6)
    turned = phases + tones * (time[:, None] - lag)
    depth = 1.5e-3 + 2e-4 * np.sin(turned).sum(axis=1)
    force = stiffness * depth + damping * 2e-4 * (np.cos(turned) @ tones)
    position = 1.5e-3 + 2e-4 * np.sin(phases + tones * time[:, None]).sum(axis=1)
    return record(time, position + 1e-7 * rng.normal(size=10_000), force + 0.02 * rng.normal(size=10_000))


@pytest.mark.parametrize("lag", [0.0, 4e-3])
def test_noise_of_the_position_does_not_tell_a_lag_from_a_damping(lag):
    """Both have one column: K is as sharp as if the lag were known, and B as wide as the lag's prior."""
    found = identify(shaken(lag))
    low, high = found.K.ci95
    assert low < 5200 < high
    assert high - low < 0.005 * 5200
    low, high = found.B.ci95
    assert low < 20 < high
    assert high - low < 1.25 * 2 * 1.96 * found.lag.std * 5200


def test_what_only_noise_tells_apart_the_prior_bounds():
    """One tone tells K - omega^2 M alone; the acceleration's noise told them apart, and K had no bound at all."""
    time = np.arange(6000) / 1000
    depth = 1e-3 + 6e-4 * np.sin(2 * np.pi * 2 * time)
    noise = np.random.default_rng(1).normal(size=(2, 6000))
    found = identify(record(time, depth + 3e-6 * noise[0], 2000 * depth + 0.05 * noise[1]), lag=0.0)
    low, high = found.K.ci95
    assert low < 2000 < high
    assert high - low < 2000
