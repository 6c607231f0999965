"""What an uncalibrated lag can be mistaken for, and what a spring in series cannot be."""

from __future__ import annotations

import numpy as np
import pytest

from identification.synthetic_contacts import coloured, press_path, pressed, record
from palpate.errors import InputError
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
    """A number that is said to be identified, and whose interval does not hold the truth."""
    if parameter.verdict is not Verdict.IDENTIFIED:
        return False
    low, high = parameter.ci95
    return not low <= truth <= high


@pytest.mark.parametrize("rate", [250, 500, 1000, 4000])
def test_a_mass_that_hides_behind_a_lag_is_in_the_interval(rate):
    found = identify(heavy(rate))
    assert found.model == "kelvin-voigt"
    assert found.parameters["B"].value == pytest.approx(375, abs=3)  # the wrong one: B - K T at a lag of M/B
    assert not contradicts(found.parameters["B"], TRUTH["B"])
    assert "a mass of up to" in found.parameters["B"].reason
    assert found.parameters["K"].value == pytest.approx(TRUTH["K"], rel=0.002)
    assert abs(found.lag[0]) < 1.96 * found.lag[1]


def test_a_force_before_the_position_is_the_sign_of_a_mass():
    found = identify(heavy())
    said = next(w.text for w in found.warnings if w.code.word == "lag-damping-confounded")
    assert "before the position" in said
    assert "lag-damping-confounded" not in identify(heavy(m=0.0)).codes


def test_the_same_mass_behind_a_lag_that_is_there():
    found = identify(heavy(lag=0.005))
    assert not contradicts(found.parameters["B"], TRUTH["B"])
    assert abs(found.lag[0] - 0.005) < 1.96 * found.lag[1]


def test_a_tolerance_below_what_a_hidden_mass_can_do_identifies_no_damping():
    found = identify(heavy(), tolerance=0.03)
    assert found.parameters["B"].verdict is Verdict.NOT_IDENTIFIABLE
    assert "hides a mass" in found.parameters["B"].reason
    assert found.parameters["K"].verdict is Verdict.IDENTIFIED


def test_nothing_hides_behind_a_lag_that_is_calibrated():
    found = identify(heavy(), lag=0.0)
    for name, truth in TRUTH.items():
        assert found.parameters[name].verdict is Verdict.IDENTIFIED
        assert found.parameters[name].value == pytest.approx(truth, rel=0.1)
    assert found.parameters["B"].std < 0.002 * TRUTH["B"]


@pytest.mark.long
def test_intervals_of_heavy_presses_cover_the_truth():
    told, wrong = 0, 0
    for seed in range(20):
        parameters = identify(heavy(ramp=0.15, seed=seed)).parameters
        told += sum(p.verdict is Verdict.IDENTIFIED for p in parameters.values())
        wrong += sum(contradicts(parameters[name], truth) for name, truth in TRUTH.items())
    assert told >= 40
    assert wrong <= 0.1 * told


@pytest.mark.parametrize("b", [5.0, 40.0, 100.0])
@pytest.mark.parametrize("ramp", [0.06, 0.1, 0.2])
def test_a_lag_that_may_be_longer_is_in_the_stiffness(b, ramp):
    found = identify(heavy(m=0.0, b=b, lag=0.008, ramp=ramp))
    assert "force-lags-position" in found.codes
    assert found.parameters["K"].verdict is Verdict.IDENTIFIED
    assert not contradicts(found.parameters["K"], TRUTH["K"])


def test_a_lag_that_is_only_a_bound_widens_the_stiffness():
    log = heavy(m=0.0, b=5.0, lag=0.008, ramp=0.06)
    bound = identify(log)
    assert any("at least" in w.text for w in bound.warnings)
    calibrated = identify(log, lag=0.008)
    assert bound.parameters["K"].std > 3 * calibrated.parameters["K"].std


@pytest.mark.parametrize("series", [100.0, 3000.0, 4500.0])
def test_a_stiffness_in_series_below_the_logs_own_is_refused(series):
    with pytest.raises(
        InputError, match=rf"{series:.4g} N/m is softer than the log's own [45]\d+ N/m"
    ) as caught:
        identify(pressed(), series_stiffness=series)
    assert "\n" not in str(caught.value)
    assert "leave it out" in str(caught.value)


@pytest.mark.parametrize(("force", "position"), [(1, 1), (-1, 1), (1, -1), (-1, -1)])
def test_a_stiffness_in_series_is_taken_out_whichever_way_the_channels_count(force, position):
    log = pressed(b=5.0, noise=0.01)
    x = log["position"] + log["force"] / 8000
    found = identify(record(log["time"], position * x, force * log["force"]), series_stiffness=8000.0)
    assert found.parameters["K"].value == pytest.approx(5000, rel=0.02)
