"""Metrics of records that are made by hand, where each number is known, and of a short run."""

import numpy as np
import pytest

from palpate.bench.force_input import COLUMNS
from palpate.bench.summary import APPROACH, CONTACT, LOST
from palpate.records import Record
from palpate.studies.metrics import METRICS, Window

TICK = 1e-3


def record(force, desired=20.0, *, phase=None, end="done", period=2.5, before=100, **columns):
    """A record of contact after `before` ticks of approach; force and desired from there on."""
    n = len(force)
    filled = {name: np.zeros(before + n) for name in COLUMNS}
    filled["t"] = np.arange(before + n) * TICK
    filled["phase"][:before] = APPROACH
    filled["phase"][before:] = CONTACT if phase is None else phase
    for name, values in {
        "force": force,
        "force_measured": force,
        "force_desired": desired,
        **columns,
    }.items():
        filled[name][before:] = values
    truth = {"K": {"value": 5000.0, "unit": "N/m"}, "B": {"value": 0.0, "unit": "N s/m"}}
    meta = {"experiment": {"force": {"period": period}}, "end": end, "why": "", "seed": 0, "truth": truth}
    return Record(filled, COLUMNS, meta)


def of(name, one, window=None):
    return METRICS[name].value_in(Window(one, window))


def test_errors_of_a_force_that_is_one_newton_off_for_half_of_the_time():
    one = record(np.concatenate([np.full(2000, 20.0), np.full(2000, 21.0)]))
    assert of("force_rms", one) == pytest.approx(np.sqrt(0.5))
    assert of("force_std", one) == pytest.approx(0.5)
    assert of("peak_force", one) == 21.0


def test_a_window_counts_from_the_first_contact():
    one = record(np.concatenate([np.full(2000, 20.0), np.full(2000, 22.0)]))
    assert of("force_rms", one, (0.0, 2.0)) == 0.0
    assert of("force_rms", one, (2.0, 4.0)) == 2.0
    assert of("force_rms", one, (1.0, 3.0)) == pytest.approx(np.sqrt(2.0))


def test_steps_are_left_out_where_it_is_said():
    error = np.zeros(5000)
    error[2500:3000] = -10.0  # the half second after the step
    desired = np.concatenate([np.full(2500, 20.0), np.full(2500, 10.0)])
    one = record(desired + error, desired)
    assert of("force_rms_settled", one) == 0.0
    assert of("force_rms", one) == pytest.approx(np.sqrt(10.0))
    assert of("interval_error", one) == 0.0
    error[4500:] = 3.0  # half of the last second: 1.5 N of 10 N on average
    assert of("interval_error", record(desired + error, desired)) == pytest.approx(0.15)


def test_follows_slow_and_rings():
    desired = np.full(5000, 20.0)
    shaking = 3.0 * np.where(np.arange(5000) % 2, 1.0, -1.0)
    told = {}
    for name, error in {"follows": 0.5, "slow": -2.5, "rings": shaking}.items():
        one = record(desired + error, desired)
        told[name] = METRICS["outcome"].words[int(of("outcome", one))]
        assert of("follows", one) == float(name == "follows")
        assert of("steady", one) == float(name != "rings")
    assert told == {name: name for name in told}


def test_adaptation_ends_with_the_last_interval_that_is_off():
    error = np.zeros(10000)
    error[:5000] = -4.0
    assert of("adaptation_time", record(20.0 + error)) == 5.0
    assert of("adaptation_time", record(np.full(10000, 20.0))) == 0.0
    error[9000:] = -4.0
    assert of("adaptation_time", record(20.0 + error)) is None
    error[5000:7500], error[7500:] = (
        -4.0,
        0.0,
    )  # three intervals are off; the last, of the lower force, is not
    assert of("adaptation_time", record(20.0 + error)) is None


def test_loss_of_contact():
    phase = np.full(3000, CONTACT)
    phase[1000:2000] = LOST
    one = record(np.full(3000, 20.0), phase=phase)
    assert of("time_in_contact", one) == 1.0
    assert of("contacts_lost", one) == 1.0
    assert of("follows", one) == 0.0
    kept = record(np.full(3000, 20.0))
    assert of("time_in_contact", kept) == pytest.approx(2.999)
    assert of("time_in_contact", record(np.full(3000, 20.0), end="diverged")) == pytest.approx(2.999)


def test_a_window_that_a_lost_run_did_not_reach_has_no_numbers():
    lost = record(np.full(3000, 20.0), end="lost contact")
    assert of("force_rms", lost, (2.0, 4.0)) is None
    assert of("force_rms", lost, (1.0, 2.0)) == 0.0
    assert of("outcome", lost, (2.0, 4.0)) is None
    assert of("follows", lost, (2.0, 4.0)) == 0.0  # it surely does not
    assert of("follows", record(np.full(3000, 20.0)), (5.0, 6.0)) is None  # never asked


def test_no_contact_has_no_numbers_but_some_zeros():
    one = record(np.zeros(100), phase=np.full(100, APPROACH), end="no contact")
    for name, metric in METRICS.items():
        value = metric.value_in(Window(one))
        assert value is None or (value == 0.0 and name in {"contacts_lost", "time_in_contact"}), name


def test_estimates_and_their_errors():
    one = record(np.full(100, 20.0), K_thesis=5490.0, M_thesis=-0.2, B_thesis=3.0, displacement=0.004)
    assert of("K_thesis", one) == 5490.0
    assert of("K_error_thesis", one) == pytest.approx(0.098)
    assert of("K_error_quotient", one) == pytest.approx(0.0)
    assert of("B_error_thesis", one) is None  # a truth of zero has no share
    assert of("M_error_thesis", one) is None  # no truth
    assert of("M_negative_thesis", one) == 1.0
    assert of("K_agrees", one) == 1.0
    assert of("K_agrees", record(np.full(100, 20.0), K_thesis=5600.0, displacement=0.004)) == 0.0


def test_saturation_is_that_of_the_worst_motor():
    limited = np.zeros(1000)
    limited[:250] = 1.0
    one = record(np.full(1000, 20.0), saturated2=limited)
    assert of("saturation", one) == 0.25


def test_the_integral_gain_of_an_integrator():
    error = 1.0 + np.sin(np.arange(2000) * TICK)
    memory = np.concatenate([[0.0], 7.0 * TICK * np.cumsum(error)[:-1]])
    one = record(20.0 - error, memory_fx=memory)
    assert of("integral_gain", one) == pytest.approx(7.0, rel=1e-9)


def test_numbers_that_are_none_are_no_metrics():
    assert of("force_rms", record(np.full(10, np.nan))) is None
    assert of("force_rms", record(np.full(10, 1e200))) is None


def test_a_ring_that_the_rms_passes_is_an_outcome_of_its_own():
    """1.7 N at 40 Hz about 20 N: an RMS of 1.2 N, less than what follows may have."""
    one = record(20.0 + 1.7 * np.sin(2 * np.pi * 40.0 * np.arange(5000) * TICK))
    assert METRICS["outcome"].words[int(of("outcome", one))] == "rings"
