"""The numbers behind the pictures: spectra, and the test for whiteness."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.identification.filters import Chain
from palpate.report.identification.spectra import (
    leaving,
    over_noise,
    resting,
    spectrum,
    stretches,
    white,
    whiteness_of,
)
from report.outcomes import OUTCOMES

DT = 1e-3


@pytest.fixture(scope="module")
def found():
    return OUTCOMES["identified"]()


def with_residuals(found, left, time, cutoff=np.nan, matched=False):
    zero = np.zeros(len(left))
    traces = replace(
        found.traces,
        fitted_time=time,
        fitted_force=left,
        predicted=zero,
        fitted_position=zero,
        matched=matched,
    )
    return replace(found, traces=traces, cutoff=cutoff), traces


def test_a_spectrum_holds_the_power_of_the_signal():
    time = np.arange(8000) * DT
    noise = np.random.default_rng(0).normal(0, 0.7, len(time))
    assert spectrum(noise, time).power == pytest.approx(0.49, rel=0.05)


def test_a_sine_stands_in_its_band():
    time = np.arange(8000) * DT
    own = spectrum(2 * np.sin(2 * np.pi * 20 * time), time)
    peak = own.amplitude.argmax()
    assert own.frequency[peak] == pytest.approx(20, rel=0.13)  # half a third of an octave
    assert own.amplitude[peak] == pytest.approx(np.sqrt(2), rel=0.05)


def test_stretches_end_at_gaps():
    time = np.r_[np.arange(100), np.arange(150, 200), np.arange(300, 420)] * DT
    assert [(p.start, p.stop) for p in stretches(time)] == [(0, 100), (100, 150), (150, 270)]
    assert spectrum(np.ones(20), np.arange(20) * 0.1 * DT) is not None
    assert spectrum(np.ones(10), np.arange(10) * DT) is None


def test_white_noise_behind_the_chain_stays_in_its_band():
    """19 of 20 values; over 20 records the share is known to about a hundredth."""
    chain = Chain(60.0, DT)
    rng = np.random.default_rng(1)
    time = np.arange(4000) * DT
    above, below = [], []
    for _ in range(20):
        own = spectrum(chain(rng.normal(0, 1, len(time) + 500))[500:], time, chain.cutoff)
        _, low, high = white(own, chain.cutoff)
        above.append((own.density > high).mean())
        below.append((own.density < low).mean())
    assert np.mean(above) == pytest.approx(0.025, abs=0.02)
    assert np.mean(below) == pytest.approx(0.025, abs=0.02)


@pytest.mark.parametrize("matched", [False, True])
def test_whiteness_is_tested_at_its_level(found, matched):
    """Of white residuals at most a tenth fall below 0.1, half or a little less below 0.5; of slow ones all do."""
    chain = Chain(60.0, DT)
    rng = np.random.default_rng(2)
    time = np.arange(3000) * DT

    def p_of(noise):
        left = noise if matched else chain(noise)
        return whiteness_of(*with_residuals(found, left[500:], time, chain.cutoff, matched))

    values = np.array([p_of(rng.normal(0, 1, 3500)) for _ in range(60)])
    assert (values < 0.1).mean() < 0.2  # 60 records: a tenth is 6 of them, give or take 2.3
    assert 0.2 < (values < 0.5).mean() < 0.7
    drift = 0.3 * np.sin(2 * np.pi * np.arange(3500) / 1750)
    assert p_of(rng.normal(0, 1, 3500) + drift) < 1e-3


def test_too_few_residuals_are_not_tested(found):
    assert whiteness_of(*with_residuals(found, np.ones(12), np.arange(12) * DT, 60.0)) is None
    assert whiteness_of(*with_residuals(found, np.empty(0), np.empty(0), 60.0)) is None


def contact_of(found, times):
    """Eight seconds of one noise behind the chain, in contact in the latter four; the model leaves it `times` over."""
    chain = Chain(60.0, DT)
    noise = chain(np.random.default_rng(7).normal(0, 1, 8500))[500:]
    time = np.arange(8000) * DT
    late = time >= 4
    bare, traces = with_residuals(found, times * noise[late], time[late], chain.cutoff)
    traces = replace(traces, time=time, force=noise)
    rmse = float(np.std(times * noise[late]))
    return replace(bare, traces=traces, contacts=((4.0, 8.0),), rmse=rmse), traces


def test_the_misfit_of_a_good_model_is_the_noise_out_of_contact(found):
    """The chain leaves some 400 independent values of four seconds: their deviation is known to 4 % (1 sigma)."""
    good, bad = contact_of(found, 1.0), contact_of(found, 6.0)
    assert over_noise(*good) == pytest.approx(1.0, rel=0.12)
    assert over_noise(*bad) == pytest.approx(6.0, rel=0.12)
    assert resting(*good).power / leaving(*good).power == pytest.approx(1.0, rel=0.25)
    always = replace(good[0], contacts=((0.0, 8.0),))
    assert over_noise(always, good[1]) is None
