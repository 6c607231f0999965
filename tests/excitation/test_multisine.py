"""Phases: low peaks, and the sum of sines that the reference makes of them."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.excitation.multisine import low_peak, schroeder, sum_of_sines
from palpate.references import Multisine


def crest(amplitudes, harmonics, phases):
    signal = sum_of_sines(amplitudes * np.exp(1j * phases), harmonics, 64)
    return np.abs(signal).max() / np.sqrt((amplitudes**2).sum() / 2)


def test_the_sum_is_that_of_the_reference():
    harmonics, amplitudes, phases = np.array([1, 4, 7]), np.array([1.0, 0.5, 2.0]), np.array([0.3, -1.0, 2.0])
    signal = sum_of_sines(amplitudes * np.exp(1j * phases), harmonics)
    time = np.arange(len(signal)) / len(signal)
    wave = Multisine(tuple(harmonics.astype(float)), tuple(amplitudes), tuple(phases))
    assert signal == pytest.approx(wave.at(time), abs=1e-12)


def test_schroeders_phases_of_a_flat_spectrum():
    harmonics = np.arange(1, 41)
    amplitudes = np.ones(40)
    assert crest(amplitudes, harmonics, np.zeros(40)) > 6
    assert crest(amplitudes, harmonics, schroeder(amplitudes**2)) < 1.95
    assert crest(amplitudes, harmonics, low_peak(amplitudes, harmonics)) < 1.45


@pytest.mark.parametrize("seed", range(3))
def test_clipping_makes_them_lower_still(seed):
    rng = np.random.default_rng(seed)
    harmonics = np.sort(rng.choice(np.arange(1, 90), 25, replace=False))
    amplitudes = rng.uniform(0.2, 1.0, 25)
    found = low_peak(amplitudes, harmonics)
    before = crest(amplitudes, harmonics, schroeder(amplitudes**2))
    assert crest(amplitudes, harmonics, found) < min(0.8 * before, 1.9)
    assert np.array_equal(found, low_peak(amplitudes, harmonics))
