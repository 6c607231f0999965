"""Every instrument states its lag; a ramp and a slow sine measure it, compiled and plain."""

import numpy as np
import pytest

from palpate._jit import kernel
from palpate.instruments import Converter, Encoder, analog_filter_190, force_sensor
from palpate.signals.filters import butterworth2

PHYSICS, LOOP = 20000, 1000.0


def chain_plain(sensor, analog, converter, digital, forces, out):
    """The force at 1 kHz after sensor, analog filter, converter and digital filter; `forces` by sub-step.

    A tick reads what the physics steps before it left.
    """
    a, b, c = sensor.start(), analog.start(), digital.start()
    held, smooth, tick = 0.0, 0.0, 0
    for k in range(forces.size):
        if k % 20 == 0:
            out[tick, 0] = held
            out[tick, 1] = smooth
            out[tick, 2], c = digital.step(c, converter.convert(held))
            tick += 1
        held, a = sensor.sample(a, forces[k], k, 0.0)
        smooth, b = analog.step(b, held)


chain = kernel(chain_plain)
PARTS = (force_sensor(bits=30), analog_filter_190(), Converter(30, 200.0), butterworth2(120.0, LOOP))


def lag_by_ramp(run):
    """Mean lag of each output [s]; over 100 ms the 480 Hz cycle meets the 1 kHz loop in all its phases."""
    time = np.arange(20000) / PHYSICS
    out = np.empty((1000, 3))
    run(*PARTS, 10.0 * time, out)
    ticks = np.arange(1000) / LOOP
    return np.mean((ticks[:, None] - out / 10.0)[500:], axis=0)


def lag_by_sine(run, frequency=1.0):
    time = np.arange(4 * 20000) / PHYSICS
    out = np.empty((4000, 3))
    run(*PARTS, 10.0 * np.sin(2 * np.pi * frequency * time), out)
    turn = np.exp(-2j * np.pi * frequency * np.arange(4000) / LOOP)[1000:]
    return -np.angle(1j * turn @ out[1000:]) / (2 * np.pi * frequency)


def stated():
    sensor, analog, converter, digital = PARTS
    return np.array([sensor.lag, sensor.lag + analog.lag, sensor.lag + converter.lag + digital.lag])


@pytest.mark.parametrize("measure", [lag_by_ramp, lag_by_sine])
def test_the_force_chain_is_as_late_as_it_says(measure):
    # The two clocks start together: they meet in 25 phases only, 1/12000 s apart, of which the oldest reading is a
    # step younger than a cycle, so that the mean age is a step less 1/24000 s under half a cycle.
    seen = stated() + 1 / 24000 - 1 / PHYSICS
    np.testing.assert_allclose(measure(chain)[[0, 2]], seen[[0, 2]], atol=2e-6)
    # The analog filter averages over the steps of the held line.
    np.testing.assert_allclose(measure(chain), stated(), atol=40e-6)


def test_the_force_chain_plain_is_compiled():
    forces = np.random.default_rng(0).normal(20.0, 5.0, 4000)
    plain, compiled = np.empty((200, 3)), np.empty((200, 3))
    chain.plain(*PARTS, forces, plain)
    chain(*PARTS, forces, compiled)
    np.testing.assert_array_equal(plain, compiled)


@pytest.mark.parametrize(
    ("part", "read"), [(Encoder(2000.0), Encoder.read), (Converter(16, 200.0), Converter.convert)]
)
def test_quantisers_are_not_late(part, read):
    ramp = np.linspace(-1.0, 1.0, 20001)
    late = np.mean([u - read(part, u) for u in ramp])
    assert part.lag == 0.0
    assert late == pytest.approx(0.0, abs=0.01 * part.resolution)
