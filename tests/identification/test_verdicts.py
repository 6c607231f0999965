"""What may be called identified, rule by rule; and what holds whatever the units, signs and clocks."""

from __future__ import annotations

import json
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from identification.synthetic_contacts import coloured, pressed, record, shaken
from palpate.errors import InputError
from palpate.identification import Verdict, identify

TIME = np.arange(4000) / 1000


def noise(std, seed=0, pole=0.9):
    return coloured(len(TIME), std, pole, np.random.default_rng(seed))


def identified(found):
    return {name for name, p in found.parameters.items() if p.verdict is Verdict.IDENTIFIED}


def test_a_force_that_no_model_explains_widens_the_interval_as_much():
    """A force of its own, half as large as the contact's, beside a motion that a model follows."""
    log = shaken(noise=0.05)
    for frequency in (2.1, 3.3, 6.0):
        for phase in (0.0, 1.6):
            own = np.sin(2 * np.pi * frequency * log["time"] + phase)
            other = 0.5 * np.std(log["force"]) * np.sqrt(2) * own
            found = identify(record(log["time"], log["position"], log["force"] + other), lag=0.0, bonded=True)
            for name in identified(found):
                low, high = found.parameters[name].ci95
                assert low < {"K": 5000.0, "B": 40.0, "M": 0.5}[name] < high, (name, frequency, phase)
            assert next(iter(found.parameters["K"].budget)) == "unexplained"


@pytest.mark.parametrize("frequency", [1.0, 5.0])
def test_one_frequency_tells_the_dynamic_stiffness_and_not_stiffness_and_mass(frequency):
    omega = 2 * np.pi * frequency
    x = 1e-3 * np.sin(omega * TIME)
    force = (5000 - 0.5 * omega**2) * x + 40e-3 * omega * np.cos(omega * TIME) + noise(0.02)
    found = identify(record(TIME, x, force + 10), lag=0.0, bonded=True, model="kelvin-voigt-mass")
    assert not {"K", "M"} <= identified(found)
    point = found.working_point.stiffness
    assert point.verdict is Verdict.IDENTIFIED
    assert abs(point.value - (5000 - 0.5 * omega**2)) < 2 * (point.ci95[1] - point.value)
    assert found.working_point.frequency_Hz == pytest.approx(frequency, rel=0.1)


@pytest.mark.parametrize("twisted", [0.0, 0.8])
def test_a_mass_below_zero_leaves_a_damping_that_is_as_wide_as_that_force(twisted):
    """An inertia that was compensated twice, or some other force, of which as much may be in the damping."""
    x = 1e-3 * (np.sin(2 * np.pi * 1.3 * TIME) + 0.2 * np.sin(2 * np.pi * 5 * TIME))
    v, a = np.gradient(x, 1e-3), np.gradient(np.gradient(x, 1e-3), 1e-3)
    force = 5000 * x + (80 + twisted * 0.5 * np.std(a) / np.std(v)) * v - 0.5 * a + noise(0.005)
    found = identify(record(TIME, x, force), lag=0.0, bonded=True).parameters
    assert found["M"].verdict is Verdict.REJECTED
    assert found["B"].verdict is Verdict.IDENTIFIED
    assert found["B"].ci95[0] < 80 < found["B"].ci95[1]
    assert next(iter(found["B"].budget)) == "missing force"


def test_a_step_made_within_contact_identifies_nothing_of_what_rests():
    """The position never moves while it counts: whatever is dropped has no small deviation."""
    x = np.where(TIME < 2.0, 1e-3, 1.0001e-3)
    found = identify(record(TIME, x, 1000 * x + noise(0.05)), lag=0.0, bonded=True)
    for p in found.parameters.values():
        assert p.verdict is not Verdict.IDENTIFIED or p.ci95[0] <= 1000 <= p.ci95[1]


@pytest.mark.parametrize("factor", [1e300, 1e-300, 1e150])
@pytest.mark.parametrize("channel", ["position", "force"])
def test_numbers_out_of_this_world_are_an_error_of_one_line(factor, channel):
    log = pressed()
    columns = {"time": log["time"], "position": log["position"], "force": log["force"]}
    with pytest.raises(InputError, match=f"the {channel} reaches .* beyond any sensor") as caught:
        identify(record(**(columns | {channel: factor * columns[channel]})), lag=0.0)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("leap", [1e5, 1e9])
def test_a_log_that_is_little_else_than_a_gap_does_not_fill_the_memory(leap):
    """A clock that is set while it records, or a night between two presses."""
    log = pressed()
    time = log["time"] + leap * (np.arange(len(log)) >= len(log) // 2)
    with pytest.raises(InputError, match=r"jumps by 1.* s at row 1501.*--start and --end"):
        identify(record(time=time, position=log["position"], force=log["force"]), lag=0.0)


def test_a_time_that_is_counted_in_another_unit_does_not_take_for_ever():
    log = pressed()
    with pytest.raises(InputError, match="rows a second, faster than any sensor"):
        identify(record(time=1e-6 * log["time"], position=log["position"], force=log["force"]))


@pytest.mark.parametrize(
    "bad", [{"lag": np.nan}, {"lag": np.inf}, {"lag": 5.0}, {"lag_std": np.nan, "lag": 0.0}]
)
def test_a_lag_that_is_none_is_an_error_of_one_line(bad):
    with pytest.raises(InputError, match="lag") as caught:
        identify(pressed(), **bad)
    assert "\n" not in str(caught.value)


LOG = pressed(noise=0.02, n=2500)


@cache
def plain():
    """The log as it is, identified by the first test that compares with it."""
    return identify(LOG, lag=0.0)


def same(one, other, scales):
    for name, scale in scales.items():
        a, b = one.parameters[name], other.parameters[name]
        assert b.verdict is a.verdict, name
        if a.value is not None:
            assert b.value == pytest.approx(scale * a.value, rel=1e-3), name
            assert b.ci95 == pytest.approx([scale * end for end in a.ci95], rel=0.02), name


@pytest.mark.long
@settings(max_examples=6, deadline=None)
@given(st.floats(-2, 2))
def test_a_force_in_another_unit_scales_every_parameter(size):
    c = 10.0**size
    found = identify(record(LOG["time"], LOG["position"], c * LOG["force"]), lag=0.0)
    same(plain(), found, dict.fromkeys("KBM", c))


def test_where_position_and_clock_begin_does_not_count():
    found = identify(record(LOG["time"] - 7.3e3, LOG["position"] + 1.7, LOG["force"]), lag=0.0)
    same(plain(), found, dict.fromkeys("KBM", 1.0))


@pytest.mark.parametrize(("force", "position"), [(-1, 1), (1, -1)])
def test_channels_that_count_the_other_way_say_the_same(force, position):
    found = identify(record(LOG["time"], position * LOG["position"], force * LOG["force"]), lag=0.0)
    same(plain(), found, dict.fromkeys("KBM", 1.0))
    assert ("force-sign-reversed" in found.codes) == (force < 0)
    assert ("position-sign-reversed" in found.codes) == (position < 0)


def test_a_force_sign_that_is_told_wrong_is_contradicted():
    assert "K" not in identified(identify(LOG, lag=0.0, force_sign=-1))


NUMBER = (int, float)


def test_the_json_is_the_contract():
    """One object of plain values: every key there, of its type."""
    said = json.loads(json.dumps(plain().to_json()))
    assert {
        "model", "parameters", "contacts", "lag_s", "fit", "warnings", "working_point", "dynamic_stiffness",
        "press", "models", "options",
    } <= set(said)  # fmt: skip
    for p in said["parameters"].values():
        assert set(p) == {"value", "std", "ci95", "budget", "unit", "verdict", "reason"}
        assert p["verdict"] in {"identified", "not identifiable", "rejected"}
        assert p["reason"]
        assert all(isinstance(half, NUMBER) and half >= 0 for half in p["budget"].values())
        assert list(p["budget"].values()) == sorted(p["budget"].values(), reverse=True)
        assert p["ci95"] is None or p["ci95"][0] <= p["ci95"][1]
        if p["verdict"] == "identified":
            assert p["ci95"][0] < p["value"] < p["ci95"][1]
            assert p["ci95"][1] - p["value"] <= 0.25 * abs(p["value"]) * (1 + 1e-9)
    assert all(set(span) == {"start_s", "end_s"} for span in said["contacts"])
    assert set(said["fit"]) == {"r2", "rmse_N", "n"}
    assert all(set(w) == {"code", "text"} for w in said["warnings"])
    point = said["working_point"]
    assert set(point) == {"stiffness", "force_N", "depth_m", "frequency_Hz", "source", "each"}
    assert set(point["stiffness"]) == set(said["parameters"]["K"]) | {"prediction95"}
    assert point["source"] in {"octave", "press"}
    octaves = {"Hz", "storage", "storage_half", "loss", "loss_half", "blocks"}
    assert all(set(octave) == octaves for octave in said["dynamic_stiffness"])
    assert set(said["press"]) == {"tangent", "hysteresis_loss", "pull_off_N", "relaxation"}
    assert all(set(slope) == {"force_N", "stiffness", "half"} for slope in said["press"]["tangent"])
    assert all({"model", "r2", "note"} <= set(compared) for compared in said["models"])
    assert [compared["model"] for compared in said["models"] if compared["chosen"]] == [said["model"]]
    assert said["options"]["tolerance"] == 0.25
    assert said["lag_s"] is None


def test_the_lag_says_what_it_is():
    said = identify(LOG).to_json()["lag_s"]
    assert set(said) == {"value", "std", "bound", "kind"}
    assert said["kind"] in {"measured", "prior"}
