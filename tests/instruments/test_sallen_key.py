"""The 190 Hz analog filter, from its components."""

import numpy as np
import pytest
from scipy import signal

from palpate.errors import InputError
from palpate.instruments import analog_filter_190, sallen_key

RATE = 20000.0


def gain(part, frequencies):
    numerator, denominator = [part.b0, part.b1, part.b2], [1.0, part.a1, part.a2]
    return signal.freqz(numerator, denominator, worN=frequencies, fs=RATE)[1]


def test_it_is_the_transfer_function_of_figure_3_6():
    r1, r2, c1, c2 = 100e3, 1.5e3, 470e-9, 10e-9
    frequencies = np.linspace(1.0, 1000.0, 200)
    s = 2j * np.pi * frequencies
    square = 1.0 / (r1 * r2 * c1 * c2)
    analog = square / (s * s + (r1 + r2) / (r1 * r2 * c1) * s + square)
    # The bilinear transform bends frequencies by (pi f/rate)^2/3: 0.8 % at 1 kHz.
    np.testing.assert_allclose(gain(analog_filter_190(), frequencies), analog, atol=0.003)


def test_its_corner_is_at_190_hz_but_3_db_at_217_hz():
    frequencies = np.arange(100.0, 300.0, 0.05)
    response = gain(analog_filter_190(), frequencies)
    natural = frequencies[np.argmin(np.abs(np.angle(response) + np.pi / 2))]
    assert natural == pytest.approx(189.6, abs=0.1)
    assert np.abs(response[np.argmin(np.abs(frequencies - natural))]) == pytest.approx(0.83, abs=0.005)
    assert frequencies[np.argmin(np.abs(np.abs(response) - np.sqrt(0.5)))] == pytest.approx(217.0, abs=1.0)


def test_the_values_as_printed_have_the_same_corner_but_absurd_impedances():
    # kOhm nF = Ohm uF: the corner cannot tell them apart. A 1.5 Ohm resistor on an amplifier's output can.
    printed = sallen_key(100.0, 1.5, 470e-6, 10e-6, RATE)
    np.testing.assert_allclose(printed, analog_filter_190(), rtol=1e-12)


def test_component_values_must_be_positive():
    with pytest.raises(InputError, match="component values must be above 0"):
        sallen_key(100e3, 0.0, 1e-9, 1e-9, RATE)
