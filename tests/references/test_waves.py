"""Chirp and multisine: the frequencies they are said to have, when they are said to have them."""

import numpy as np
import pytest

from palpate.references import Chirp, Multisine

RATE = 100_000


def frequency(wave, at):
    """Of a wave of amplitude 1 about a time [Hz], by its two derivatives: s'^2 - s s'' = (phase')^2 for a pure sine."""
    step = 1.0 / RATE
    before, now, after = (wave.at(np.array([at + k * step]))[0] for k in (-1, 0, 1))
    rate, second = (after - before) / (2 * step), (after - 2 * now + before) / step**2
    return np.sqrt(rate**2 - now * second) / (2 * np.pi)


@pytest.mark.parametrize("logarithmic", [False, True])
@pytest.mark.parametrize(("low", "high"), [(0.5, 40.0), (40.0, 0.5), (3.0, 3.0)])
def test_a_chirp_has_at_each_time_the_frequency_it_sweeps_through(low, high, logarithmic):
    chirp = Chirp(low, high, 20.0, 1.0, logarithmic)
    for at in (2.0, 7.3, 11.1, 19.9):
        share = at / 20.0
        expected = low * (high / low) ** share if logarithmic else low + (high - low) * share
        # The sweep itself adds its rate's share to the second derivative: under half a percent of these.
        assert frequency(chirp, at) == pytest.approx(expected, rel=0.005, abs=0.15)


def test_its_phase_is_exact_over_the_whole_sweep():
    """Zero crossings of a linear sweep from 1 to 21 Hz in 10 s lie where t + t^2 is a multiple of a half."""
    chirp = Chirp(1.0, 21.0, 10.0, 3.0)
    crossings = 0.5 * (np.sqrt(1.0 + 2.0 * np.arange(220)) - 1.0)
    assert crossings[-1] < 10.0
    np.testing.assert_allclose(chirp.at(crossings), 0.0, atol=3.0 * 2e-12)
    assert np.abs(chirp.at(np.arange(10000) / 1000.0)).max() == pytest.approx(3.0, rel=1e-3)


def test_a_multisine_is_the_sum_of_its_sines():
    sines = Multisine((2.0, 5.0), (1.5, 0.5), (0.3, -1.0))
    time = np.arange(1000) / 1000.0
    spectrum = np.fft.rfft(sines.at(time)) / 500.0
    np.testing.assert_allclose(np.abs(spectrum[[2, 5]]), [1.5, 0.5], rtol=1e-9)
    np.testing.assert_allclose(np.angle(1j * spectrum[[2, 5]]), [0.3, -1.0], rtol=1e-9)
    assert np.abs(np.delete(spectrum, [2, 5])).max() < 1e-12
