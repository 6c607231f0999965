"""Noise and drift of a force at rest, compared with those of the gains."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest

from palpate.errors import InputError
from palpate.force import load_arm
from palpate.press.at_rest import check_drift, check_range, fitting, noise_and_drift
from palpate.press.engines import press_gains

GAINS = press_gains(load_arm("ur5e"), 20.0)
TIMES = np.arange(250) / 500.0


def shown(seed, noise=0.1, drift=0.0, hum=0.0):
    rng = np.random.default_rng(seed)
    return noise * rng.normal(size=250) + drift * TIMES + hum * np.sin(2.0 * np.pi * 50.0 * TIMES)


@pytest.mark.parametrize("drift", [0.0, 0.3, -2.0])
def test_noise_and_drift_are_found_with_an_honest_uncertainty(drift):
    found = np.array([noise_and_drift(TIMES, shown(seed, drift=drift)) for seed in range(2000)])
    assert found[:, 0].mean() == pytest.approx(0.1, rel=0.02)
    assert found[:, 1].mean() == pytest.approx(drift, abs=0.01)
    # Student's t of eight degrees of freedom: 2.31 deviations are 95 %, here to 0.5 % (1 sigma).
    covered = np.abs(found[:, 1] - drift) < 2.31 * found[:, 2]
    assert covered.mean() == pytest.approx(0.95, abs=0.015)


def test_a_hum_is_noise_and_no_drift():
    noise, drift, std = noise_and_drift(TIMES, shown(0, noise=0.02, hum=0.5))
    assert noise == pytest.approx(0.5 / np.sqrt(2.0), rel=0.05)
    assert abs(drift) < 4.5 * std


def test_a_sensor_that_drifts_is_refused_and_a_still_one_never():
    sensor = GAINS.arm.sensor
    for seed in range(300):
        _, drift, std = noise_and_drift(TIMES, shown(seed))
        check_drift(drift, std, 20.0, 30.0, sensor)
    for seed in range(30):
        _, drift, std = noise_and_drift(TIMES, shown(seed, drift=1.5))
        with pytest.raises(InputError, match=r"N/s at rest, and at most 0\.033 N/s is borne"):
            check_drift(drift, std, 20.0, 30.0, sensor)


def test_the_makers_drift_is_borne_where_it_is_more_than_a_press_would_bear():
    sensor = msgspec.structs.replace(GAINS.arm.sensor, drift=0.5)
    check_drift(0.45, 0.001, 20.0, 30.0, sensor)
    with pytest.raises(InputError, match=r"at most 0\.5 N/s is borne"):
        check_drift(0.55, 0.001, 20.0, 30.0, sensor)


def test_gains_are_those_of_the_noise_that_is_there():
    assert fitting(GAINS, 0.1, 250) is None
    assert fitting(GAINS, 0.12, 250) is None
    again = fitting(GAINS, 0.5, 250)
    assert again.arm.sensor.noise == 0.5
    assert (again.theta, again.gain, again.approach) == (GAINS.theta, GAINS.gain, GAINS.approach)
    with pytest.raises(InputError, match="below 8 standard deviations"):
        fitting(GAINS, 3.0, 250)


def test_a_force_is_read_up_to_the_full_scale_and_no_further():
    check_range(20.0, 80.0, 100.0)
    check_range(98.9, 1.0, 100.0)
    with pytest.raises(InputError, match="tare it"):
        check_range(20.1, 80.0, 100.0)
    with pytest.raises(InputError, match="the end of its scale"):
        check_range(99.0, 1.0, 100.0)
