"""The force sensor: when it samples, what it puts out, how noisy it is."""

import math

import numpy as np
import pytest

from palpate._jit import kernel
from palpate.errors import InputError
from palpate.instruments import Converter, ForceSensor, force_sensor
from palpate.signals.filters import butterworth3


@kernel
def hold(sensor, forces, noise, out):
    state = sensor.start()
    for k in range(forces.size):
        out[k], state = sensor.sample(state, forces[k], k, noise[k])


def run(sensor, forces, noise=None):
    out = np.empty(len(forces))
    hold(sensor, np.asarray(forces, float), np.zeros(len(forces)) if noise is None else noise, out)
    return out


def instants(sensor, stop, start=0):
    return [k for k in range(start, stop) if sensor.samples_at(k)]


def test_sampling_does_not_drift():
    sensor = force_sensor()
    exact = [-(-j * 20000 // 480) for j in range(4800)]  # the first step at or after j/480 s
    assert instants(sensor, 200000) == exact
    after_a_day = 24 * 3600 * 20000
    assert instants(sensor, after_a_day + 20000, after_a_day)[:3] == [after_a_day + k for k in exact[:3]]


@pytest.mark.parametrize("phase", [0.0, 1e-4, 7.3e-4, 1.0 / 960.0, 2.0e-3])
def test_a_phase_moves_every_sampling_instant(phase):
    sensor = force_sensor(phase=phase)
    steps = np.array(instants(sensor, 200000))
    exact = np.ceil((sensor.shift + np.arange(4800) * 20000) / 480)
    assert sensor.shift / (480 * 20000) == pytest.approx(phase, abs=0.06e-6)
    np.testing.assert_array_equal(steps, exact)


@pytest.mark.parametrize("phase", [0.0, 1e-4, 7.3e-4, 2.0e-3])
@pytest.mark.parametrize("sampling", [480, 500, 1000, 333])
def test_the_delay_of_a_sample_is_its_mean(phase, sampling):
    """From the sampled step to the clock's tick after which the value is read, over all positions of the two clocks."""
    sensor = force_sensor(sampling=sampling, phase=phase % (1.0 / sampling))
    steps = np.array(instants(sensor, 60000 + 60000 // sampling))[: 3 * sampling + 1]
    clock = (sensor.shift / (sampling * 20000.0)) + np.arange(1, 3 * sampling + 1) / sampling
    readable = clock + 1.0 / 20000.0  # the step after the one that puts it out, as far as that can be told
    assert np.mean(readable - steps[:-1] / 20000.0) == pytest.approx(sensor.delay, abs=1e-9)


def test_a_sample_comes_out_one_cycle_later_and_is_held():
    sensor = force_sensor(bits=30)
    forces = np.sin(np.arange(3000) * 0.01) * 50.0
    filtered, state = np.empty(3000), sensor.analog.start()
    for k, force in enumerate(forces):
        filtered[k], state = sensor.analog.step(state, force)
    out, when = run(sensor, forces), instants(sensor, 3000)
    for sampled, begin, end in zip(when, when[1:], when[2:], strict=False):
        np.testing.assert_allclose(out[begin:end], filtered[sampled], atol=sensor.converter.resolution)


def test_noise_is_that_of_a_sample():
    sensor = force_sensor(noise=0.6)
    noise = np.random.default_rng(0).normal(size=400000)
    out = run(sensor, np.full(400000, 20.0), noise)[4000:]
    fresh = out[np.flatnonzero(np.diff(out)) + 1]
    assert np.std(fresh) == pytest.approx(0.6, rel=0.03)
    assert np.mean(fresh) == pytest.approx(20.0, abs=0.05)


@pytest.mark.parametrize("force", [1000.0, -1000.0])
def test_it_saturates_at_full_scale(force):
    sensor = force_sensor()
    out = run(sensor, np.full(4000, force))
    assert out[-1] == math.copysign(200.0 - sensor.converter.resolution, force)
    assert np.abs(out).max() < 200.0


@pytest.mark.parametrize(
    ("sampling", "noise", "words"),
    [
        (0, 0.6, "sampling must be between 1 and 20000 Hz, got 0"),
        (30000, 0.6, "sampling"),
        (480, -0.1, "noise must be at least 0 N, got -0.1"),
    ],
)
def test_bad_parameters_are_refused(sampling, noise, words):
    with pytest.raises(InputError, match=words):
        ForceSensor(butterworth3(120.0, 20000), Converter(12, 200.0), noise, sampling, 20000)


@pytest.mark.parametrize("phase", [-1e-4, 1.0 / 480.0, 1.0])
def test_a_phase_of_more_than_a_period_is_refused(phase):
    with pytest.raises(InputError, match=r"phase must be at least 0 and below 0\.00208333 s"):
        force_sensor(phase=phase)
