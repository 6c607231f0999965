"""The numbers behind the pictures: spectra, the test for whiteness, and estimates from a growing log."""

from dataclasses import replace

import numpy as np
import pytest

from identification.synthetic_contacts import shaken
from palpate.identification import identify
from palpate.identification.filters.state_variable import Chain
from palpate.report.identification_growth import growth
from palpate.report.identification_spectra import (
    leaving,
    over_noise,
    reach,
    resting,
    spectrum,
    stretches,
    terms,
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


def test_the_terms_add_up_to_what_the_model_predicts(found):
    own = terms(found.traces)
    assert set(own) == {"K", "B", "M"}
    total = sum(own.values()) + found.traces.theta["offset"]
    assert total == pytest.approx(found.traces.predicted, abs=1e-9 * np.ptp(total))


def test_the_mass_is_seen_at_higher_frequencies_than_the_spring(found):
    """Its resonance, 16 Hz, is where the two are equal."""
    traces = found.traces
    spring, mass = (spectrum(terms(traces)[name], traces.fitted_time, found.cutoff) for name in "KM")
    above = mass.density > spring.density
    crossing = spring.frequency[np.flatnonzero(above)[0]]
    assert crossing == pytest.approx(np.sqrt(5000 / 0.5) / (2 * np.pi), rel=0.3)
    assert not above[: np.flatnonzero(above)[0]].any()


def test_the_misfit_of_a_good_model_is_the_noise_out_of_contact():
    good, bad = OUTCOMES["not_identifiable"](), OUTCOMES["rejected"]()
    assert over_noise(good, good.traces) == pytest.approx(1.0, rel=0.15)
    assert over_noise(bad, bad.traces) > 5
    rest, left = resting(good, good.traces), leaving(good, good.traces)
    assert 0.5 < rest.power / left.power < 2.0  # of coloured noise, from a second of it
    always = OUTCOMES["volts"]()
    assert over_noise(replace(always, contacts=((0.0, 4.0),)), always.traces) is None


def test_reach_is_where_a_signal_drowns():
    time = np.arange(8000) * DT
    noise = np.random.default_rng(3).normal(0, 1, len(time))
    slow = spectrum(20 * Chain(2.0, DT)(noise), time)
    floor = spectrum(0.1 * np.random.default_rng(4).normal(0, 1, len(time)), time)
    assert 2 < reach(slow, floor) < 30
    assert reach(floor, slow) > 400
    assert reach(replace(floor, density=0.5 * slow.density), slow) is None


def test_the_last_estimate_is_the_reported_one(found):
    for name, grown in growth(found).items():
        p = found.parameters[name]
        assert grown.value[-1] == pytest.approx(p.value, rel=1e-6)
        assert (grown.low[-1], grown.high[-1]) == pytest.approx(p.ci95, rel=1e-6)
        assert (np.diff(grown.time) > 0).all()


def test_so_it_is_where_the_fit_is_more_than_least_squares():
    """Behind a known sensor what noise of the position does to the answer is taken out."""
    noisy = identify(
        shaken(noise=0.05, position_noise=2e-5),
        lag=0.002,
        force_filter="butterworth2:100",
        model="kelvin-voigt-mass",
    )
    for name, grown in growth(noisy).items():
        assert grown.value[-1] == pytest.approx(noisy.traces.theta[name], rel=1e-9)


def test_a_part_of_the_log_gives_what_least_squares_gives(found):
    traces = found.traces
    grown = growth(found)
    k = len(grown["K"].time) // 3
    inside = traces.fitted_time <= grown["K"].time[k]
    columns = np.column_stack(list(traces.columns.values()))[inside]
    theta = np.linalg.lstsq(columns, traces.fitted_force[inside], rcond=None)[0]
    for i, name in enumerate(traces.columns):
        if name != "offset":
            assert grown[name].value[k] == pytest.approx(theta[i], rel=1e-5)


def test_intervals_narrow_and_hold_the_truth(found):
    truth = {"K": 5000, "B": 40, "M": 0.5}
    for name, grown in growth(found).items():
        width = grown.high - grown.low
        assert width[-1] < 0.5 * width[1]
        late = slice(len(width) // 2, None)
        assert ((grown.low <= truth[name]) & (truth[name] <= grown.high))[late].mean() > 0.8


def test_what_is_known_beforehand_holds_from_the_first_point():
    """A mass that is given does not wander while there is hardly any data."""
    given = growth(identify(shaken(noise=0.3), lag=0.0, mass=(0.5, 0.01), model="kelvin-voigt-mass"))["M"]
    free = growth(identify(shaken(noise=0.3), lag=0.0, model="kelvin-voigt-mass"))["M"]
    assert np.ptp(given.value) < 0.1
    assert np.ptp(free.value) > 0.2
    assert (given.high - given.low).max() < 0.5 * (free.high - free.low).max()


def test_too_few_samples_do_not_grow(found):
    few = {name: column[:20] for name, column in found.traces.columns.items()}
    short = replace(found.traces, fitted_time=found.traces.fitted_time[:20], columns=few)
    assert growth(replace(found, traces=short)) == {}
    assert growth(replace(found, traces=None)) == {}
