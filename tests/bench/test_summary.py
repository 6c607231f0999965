"""The numbers of a summary, each from a record made by hand whose answer is known."""

import numpy as np
import pytest

from bench.quick import quick
from palpate.bench import build, summarise
from palpate.bench.force_input import COLUMNS
from palpate.bench.summary import settling_time
from palpate.records import Record

TICKS = 4000


def record(**columns):
    """One second of approach, three of contact: a first-order rise to 20 N, and what is given."""
    t = np.arange(TICKS) * 1e-3
    phase = np.where(t < 1.0, 0.0, 1.0)
    force = np.where(phase == 1.0, 20.0 * (1.0 - np.exp(-(t - 1.0) / 0.1)), 0.0)
    table = dict.fromkeys(COLUMNS, np.zeros(TICKS)) | {
        "t": t,
        "phase": phase,
        "force": force,
        "force_measured": force,
        "force_desired": 20.0 * phase,
        "displacement": 4e-3 * phase,
        "K_matched": np.full(TICKS, 5000.0),
        "K_matched_std": np.full(TICKS, 10.0),
    }
    meta = {"end": "done", "why": "as asked for", "seed": 1, "truth": {"K": {"value": 5200.0, "unit": "N/m"}}}
    return Record(table | columns, COLUMNS, meta)


def test_settling_is_the_last_time_outside_five_percent():
    summary = summarise(record())
    assert summary["contact_at_s"] == 1.0
    assert summary["force"]["settling_s"] == pytest.approx(0.1 * np.log(20.0), abs=1e-3)
    assert summary["force"]["overshoot_N"] == 0.0
    assert summary["force"]["error_N"] == pytest.approx(0.0, abs=1e-6)


def test_overshoot_is_beyond_the_first_level():
    force = record()["force"].copy()
    force[1500] = 23.5
    summary = summarise(record(force=force))
    assert summary["force"]["overshoot_N"] == pytest.approx(3.5)
    assert summary["force"]["settling_s"] == pytest.approx(0.501)


def test_what_never_settles_says_so():
    summary = summarise(record(force=15.0 * record()["phase"]))
    assert summary["force"]["settling_s"] is None
    assert summary["force"]["error_N"] == pytest.approx(-5.0)
    assert summary["force"]["rms_error_N"] == pytest.approx(5.0)


def test_only_the_first_level_counts_for_settling():
    desired = np.where(record()["t"] < 2.5, 20.0, 10.0) * record()["phase"]
    summary = summarise(record(force_desired=desired))
    assert summary["force"]["settling_s"] == pytest.approx(0.1 * np.log(20.0), abs=1e-3)
    assert summary["force"]["desired_N"] == 10.0


def test_a_sine_has_neither_settling_nor_overshoot():
    r = record()
    desired = (20.0 + 2.0 * np.sin(6.28 * (r["t"] - 1.0))) * r["phase"]
    force = summarise(record(force_desired=desired))["force"]
    assert force["settling_s"] is None
    assert force["overshoot_N"] is None
    assert force["rms_error_N"] > 0.0


def test_losses_and_saturation_are_counted():
    phase = record()["phase"].copy()
    phase[2000:2100] = 2.0
    phase[3000:3100] = 2.0
    saturated = np.zeros(TICKS)
    saturated[:1000] = 1.0
    summary = summarise(record(phase=phase, saturated2=saturated))
    assert summary["contacts_lost"] == 2
    assert summary["saturated"] == {"joint1": 0.0, "joint2": 0.25, "joint3": 0.0}


def test_the_quotient():
    found = summarise(record())["identified"]
    assert found["force_over_displacement"]["K"] == pytest.approx(5000.0, rel=1e-3)
    assert found["matched"]["K"] == 5000.0


def test_without_contact_there_is_no_force_to_tell():
    summary = summarise(record(phase=np.zeros(TICKS)))
    assert summary["contact_at_s"] is None
    assert summary["force"] is summary["tip"] is summary["identified"] is None


def test_a_record_of_no_rows():
    empty = Record({name: np.empty(0) for name in COLUMNS}, COLUMNS, record().meta)
    summary = summarise(empty)
    assert summary["duration_s"] == 0.0
    assert summary["force"] is None


def test_y_and_angle_are_held_where_the_arm_starts():
    """A start beside the axis is a place to press at, not an error to be removed."""
    bench = build(quick("foam-hybrid", robot={"start": (0.4635, 0.03, 0.05)}))
    r = bench.run(1.5, press=0.5)
    assert np.all(r["y_desired"] == 0.03)
    assert np.all(r["phi_desired"] == 0.05)
    tip = summarise(r)["tip"]
    assert abs(tip["y_error_mm"]) < 4.0
    assert abs(tip["phi_error_deg"]) < 2.0
    assert (r["phase"] == 1.0).any()


def swinging(amplitude, hertz, *, decay=0.0):
    t = record()["t"]
    since = np.clip(t - 1.0, 0.0, None)
    return record()["force"] + amplitude * np.exp(-decay * since) * np.sin(2 * np.pi * hertz * t) * (t >= 1.0)


@pytest.mark.parametrize(("amplitude", "hertz"), [(1.7, 40.0), (3.0, 7.0), (0.8, 120.0)])
def test_a_ringing_force_is_called_ringing_with_its_amplitude_and_frequency(amplitude, hertz):
    force = summarise(record(force=swinging(amplitude, hertz)))["force"]
    assert force["ringing"]["amplitude_N"] == pytest.approx(
        amplitude, rel=0.05
    )  # of seven periods a part looks like a trend
    assert force["ringing"]["frequency_Hz"] == pytest.approx(hertz, abs=0.5)
    assert (force["settling_s"] is None) == (amplitude > 1.0)  # 5 % of 20 N


def test_a_decayed_swing_a_slow_rise_and_noise_do_not_ring():
    assert summarise(record(force=swinging(5.0, 20.0, decay=5.0)))["force"]["ringing"] is None
    t, phase = record()["t"], record()["phase"]
    assert summarise(record(force=(15.0 + 2.0 * (t - 1.0)) * phase))["force"]["ringing"] is None
    noise = np.random.default_rng(0).normal(0.0, 2.0, TICKS)
    assert summarise(record(force=(20.0 + noise) * phase))["force"]["ringing"] is None


def test_a_force_that_is_inside_only_at_the_end_by_chance_did_not_settle():
    """It leaves the band 0.4 s before the end of 3 s; 0.6 s before is long enough."""
    for before, settles in ((0.4, False), (0.6, True)):
        force = record()["force"].copy()
        force[TICKS - round(1e3 * before)] = 22.0
        assert (summarise(record(force=force))["force"]["settling_s"] is not None) == settles


def test_of_a_long_press_a_tenth_is_asked():
    since = np.arange(20_000) * 1e-3
    for left, settles in ((1.0, False), (3.0, True)):
        outside = since < 20.0 - left
        assert (settling_time(since, outside) is not None) == settles
