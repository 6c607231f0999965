"""The force sensor's own way for the position: its laws, its series in the lag, its noise."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.identification.filters import Chain, SensorPath
from palpate.signals.low_pass import LowPass
from palpate.signals.position_noise import PositionNoise

DT = 1e-3
SENSOR = LowPass(((3, 120.0),))
COUNT = 2000
TIME = np.arange(COUNT) * DT
INSTANTS = 0.37 + 25 / 12 * np.arange(100, 850)
ROWS = np.arange(len(INSTANTS))
NEAR = 0.25 * DT
"""How far a lag may be from one that was read before to be reached by a series."""


def path(low_pass=SENSOR, instants=INSTANTS, dt=DT):
    return SensorPath(low_pass, 0.0, dt, instants, 25 / 12 * dt)


def sine(t, omega, derivative):
    return (np.exp(1j * omega * t) * (1j * omega) ** derivative).imag


@pytest.mark.parametrize("derivative", [0, 1, 2])
@pytest.mark.parametrize("frequency", [1.0, 40.0, 120.0])
@pytest.mark.parametrize("later", [0.0, 2e-3, 11.3e-3])
def test_a_motion_as_the_sensor_reads_it(derivative, frequency, later):
    """The low-pass's gain and phase, then late by what the lag is beyond it; in seconds, not samples."""
    omega = 2 * np.pi * frequency
    got = path().read(sine(TIME, omega, 0), derivative, SENSOR.lag + later, ROWS)
    gain = SENSOR.at(np.array(omega))
    wanted = (gain * np.exp(1j * omega * (INSTANTS * DT - later)) * (1j * omega) ** derivative).imag
    # Instants are rounded to 1/2048 sample: their error in the phase; weights of 1e-6 are left out.
    limit = abs(gain) * omega ** (derivative + 1) * DT / 2048 + 4e-5 * (np.pi / DT) ** derivative
    np.testing.assert_allclose(got, wanted, rtol=0, atol=1.01 * limit)


@given(st.integers(-30, 30), st.floats(0.0, 0.02), st.integers(0, 2))
@settings(max_examples=20)
def test_a_lag_longer_by_whole_samples_is_the_reading_of_a_position_that_is_as_much_later(
    steps, lag, derivative
):
    motion = np.cumsum(np.random.default_rng(1).standard_normal(COUNT))
    late = path().read(motion, derivative, lag + steps * DT, ROWS)
    shifted = path().read(np.roll(motion, steps), derivative, lag, ROWS)
    # Nothing but the rounding of an instant at the very middle between two places may differ.
    np.testing.assert_allclose(late, shifted, rtol=0, atol=1e-3 * np.abs(shifted).max() + 1e-9)


@pytest.mark.parametrize("derivative", [0, 1, 2])
@pytest.mark.parametrize("step", [-1.0, -0.4, 0.1, 1.0])
def test_a_lag_near_one_that_was_read_is_reached_by_a_series(derivative, step):
    """In band: sines up to 120 Hz with rates of one size, the least smooth thing that passes."""
    omega = 2 * np.pi * np.array([0.7, 5.0, 31.0, 120.0])[:, None]
    motion = (np.sin(omega * TIME + omega) / omega).sum(axis=0)
    lag = SENSOR.lag + 2.1e-3
    from_series, direct = path(), path()
    from_series.read(motion, 0, lag, ROWS)
    near = from_series.read(motion, derivative, lag + step * 0.999 * NEAR, ROWS)
    read = direct.read(motion, derivative, lag + step * 0.999 * NEAR, ROWS)
    # The series' third term: (w h)^3 / 6 of the fastest, 1.1e-3 of its size; the rounding of instants stands beside.
    fastest = omega[-1, 0]
    limit = fastest ** (derivative - 1) * ((fastest * NEAR) ** 3 / 6 + fastest * DT / 2048) * 2
    np.testing.assert_allclose(near, read, rtol=0, atol=limit)


def test_the_series_is_smooth_where_the_reading_is_in_steps():
    """A fit differentiates by the lag: within a step of the reading's own fractions it must see a slope."""
    motion = np.sin(2 * np.pi * 10 * TIME)
    one = path()
    lag, step = SENSOR.lag + 2e-3, 1e-8
    middle = one.read(motion, 0, lag, ROWS)
    slope = (one.read(motion, 0, lag + step, ROWS) - one.read(motion, 0, lag - step, ROWS)) / (2 * step)
    np.testing.assert_allclose(slope, -one.read(motion, 1, lag, ROWS), rtol=0, atol=1e-4 * 2 * np.pi * 10)
    assert np.abs(middle).max() > 0.5


def test_what_was_before_a_jump_has_left_the_readings_when_the_path_says_so():
    """The slowest mode has died away by ten powers of e."""
    jump = np.where(np.arange(COUNT) < 900, -1.0, 0.0)
    for low_pass in (SENSOR, LowPass(((2, 20.0),))):
        one = path(low_pass)
        got = one.read(jump, 0, low_pass.lag, ROWS)
        since = INSTANTS * DT - 0.9
        after = since >= one.settling
        assert after.sum() > 50
        # The taper's own ringing is left: the jump is no signal below half the sampling rate.
        assert np.abs(got[after]).max() < 3e-4
        assert np.abs(got[(since > 0) & ~after]).max() > 0.5


@pytest.mark.parametrize(("white", "jump"), [(5e-5, 0.0), (0.0, 2e-6)])
def test_the_noise_of_an_acceleration_is_that_of_noise_filtered(white, jump):
    """Of jumps, half of the power counts."""
    chain, rng = Chain(60.0, 1e-3), np.random.default_rng(5)
    noise = rng.normal(0, white, 100_000) + np.cumsum(rng.normal(0, jump, 100_000))
    stated = chain.acceleration_noise(PositionNoise(white, jump))
    # The filter leaves some thousand independent numbers, which know a variance to 5 %.
    assert chain(noise, 2)[100:-100].var() == pytest.approx(stated if white else 2 * stated, rel=0.2)
