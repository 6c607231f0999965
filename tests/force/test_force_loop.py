"""The law in a user's loop: each thing that can go wrong has its stated answer, and nothing grows."""

from __future__ import annotations

import math
import pickle
import tracemalloc

import numpy as np
import pytest

from force.gained import gains_of
from palpate.errors import InputError
from palpate.force import ForceLoop
from palpate.force.certificate import FORM, Certificate
from palpate.force.guard import BOUND


@pytest.fixture
def loop():
    return ForceLoop(gains_of())


def press(loop, ticks=1500, K=2e4, start=-2e-4, seed=0):
    """A tip that follows at once, on a spring, with noise: enough for the loop to learn."""
    rng, x, speeds = np.random.default_rng(seed), start, []
    for _ in range(ticks):
        force = max(K * x, 0.0) + 0.1 * rng.normal()
        speeds.append(loop.update(float(force), float(x)))
        x += loop.gains.arm.tick * speeds[-1]
    return speeds, K * x


def test_it_presses_with_the_force_asked_for(loop):
    assert loop.estimate is None
    assert loop.phase == "free motion"
    _, force = press(loop)
    assert force == pytest.approx(20.0, rel=0.02)
    assert loop.phase == "locked"
    found = loop.estimate
    assert found.stiffness == pytest.approx(2e4, abs=4.0 * found.stiffness_std + 1000.0)
    assert found.bound >= 0.95 * 2e4
    assert loop.trouble == ""


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_a_reading_that_is_none_holds_the_tip(loop, bad):
    press(loop, 400)
    before = loop.state
    assert loop.update(bad, 0.0) == 0.0
    assert "no number" in loop.trouble
    assert loop.update(5.0, bad) == 0.0
    assert loop.state[:BOUND] == before[:BOUND]  # nothing was learned from it
    loop.update(20.1, 1e-3)
    assert "missed" in loop.trouble


def test_readings_gone_for_longer_than_the_lag_start_it_anew(loop):
    press(loop, 1500)
    noise = loop.noise
    assert loop.phase == "locked"
    for _ in range(100):
        loop.update(math.nan, math.nan)
    loop.update(0.01, 0.0)
    assert loop.phase == "free motion"
    assert loop.state[BOUND] == loop.gains.seen_cap
    assert loop.noise == noise


def test_missed_ticks(loop):
    press(loop, 400)
    loop.update(19.9, 1e-3, 2)
    assert "missed" in loop.trouble
    loop.update(0.02, 1e-3, 1000)
    assert loop.phase == "free motion"


def test_a_stale_force_holds_the_tip(loop):
    speeds = [loop.update(0.03, 1e-6 * k) for k in range(200)]
    assert speeds[5] > 0.0
    assert speeds[-1] == 0.0
    assert "not changed" in loop.trouble


def test_saturation_and_the_force_limit_withdraw(loop):
    press(loop, 400)
    assert loop.update(61.0, 1e-3) <= -loop.gains.approach
    assert "limit" in loop.trouble
    assert loop.update(100.0, 1e-3) == -loop.gains.approach
    assert "scale" in loop.trouble
    assert (
        loop.update(-100.0, 1e-3) == 0.0
    )  # a reading that pulls with full scale says nothing of where to go


@pytest.mark.parametrize("force", [-3.0, -40.0])
def test_a_force_of_the_wrong_sign_or_untared_holds_the_tip(loop, force):
    for k in range(50):
        loop.update(0.01 * (k % 3), 1e-5 * k)
    speeds = [loop.update(force + 0.01 * (k % 3), 5e-4 + 1e-5 * k) for k in range(100)]
    assert "sign" in loop.trouble
    assert speeds[-60:] == [0.0] * 60
    loop.update(0.02, 1.5e-3)
    for k in range(100):
        loop.update(0.01 * (k % 3), 1.5e-3)
    assert loop.trouble == ""


def test_a_lost_contact_is_approached_anew(loop):
    press(loop, 1500)
    rng = np.random.default_rng(5)
    speeds = [loop.update(0.1 * float(rng.normal()), 1e-3) for _ in range(200)]
    assert loop.phase == "free motion"
    assert max(speeds[-50:]) <= loop.gains.approach


def test_a_motor_at_its_limit_is_told_and_the_command_does_not_wind_up(loop):
    rng, x, x_c, K, most = np.random.default_rng(4), -2e-4, -2e-4, 2e4, 13.0
    blocked = 0
    for k in range(4000):
        if k == 3000:
            most = 100.0
        force = max(K * x, 0.0) + 0.1 * rng.normal()
        x_c += loop.gains.arm.tick * loop.update(float(force), float(x))
        x = min(x_c, most / K)  # the motor cannot press harder
        blocked += "cannot be reached" in loop.trouble
    assert blocked > 500
    assert x_c < 6.0 * 20.0 / K
    assert loop.trouble == ""  # free again, it presses with what is asked
    assert K * x == pytest.approx(20.0, rel=0.03)


def test_it_goes_on_where_it_was_saved(loop):
    press(loop, 300)
    again, other = pickle.loads(pickle.dumps(loop)), ForceLoop(loop.gains)
    other.state = loop.state
    rng = np.random.default_rng(2)
    for _ in range(200):
        force, position = 10.0 + float(rng.normal()), 1e-3 * float(rng.normal())
        speed = loop.update(force, position)
        assert again.update(force, position) == speed == other.update(force, position)


@pytest.mark.parametrize("bad", [(), (1.0, 2.0), [math.nan] * 66, [9.0] * 61])
def test_a_state_of_something_else_is_refused(loop, bad):
    before = loop.state
    with pytest.raises(InputError, match="state"):
        loop.state = bad
    assert loop.state == before


@pytest.mark.parametrize("bad", [0.0, -5.0, 0.7, 60.0, math.nan, math.inf])
def test_a_force_that_cannot_be_kept_is_refused(loop, bad):
    with pytest.raises(InputError, match="desired force"):
        loop.desired = bad
    assert loop.desired == 20.0
    loop.desired = 25.0


def test_many_ticks_leave_no_memory_behind(loop):
    forces = (5.0 + 0.1 * np.random.default_rng(0).normal(size=20_000)).tolist()
    for f in forces:
        loop.update(f, 1e-3)
    tracemalloc.start()
    before = tracemalloc.get_traced_memory()[0]
    for f in forces:
        loop.update(f, 1e-3)
    grown = tracemalloc.get_traced_memory()[0] - before
    tracemalloc.stop()
    assert grown < 2000  # the last speed and the iterator


def test_files(loop, tmp_path):
    loop.save(tmp_path / "gains.toml")
    assert ForceLoop.load(tmp_path / "gains.toml").gains == loop.gains
    Certificate(form=FORM, gains=gains_of("fr3"), claims=()).save(tmp_path / "other.json")
    with pytest.raises(InputError, match="another rate"):
        ForceLoop.load(tmp_path / "gains.toml", tmp_path / "other.json")
    with pytest.raises(InputError, match="folder"):
        loop.save(tmp_path / "nowhere" / "gains.toml")


def steady_press(arm="ur5e", bad=None, count=1, seconds=3.5, seed=0):
    """A loop whose tip follows at once and presses a spring of 5 kN/m with 10 N; from 1.5 s on `count` bad readings."""
    loop, rng, x = ForceLoop(gains_of(arm, force=10.0, cap=1e5)), np.random.default_rng(seed), -2e-4
    tick, speeds, states = loop.gains.arm.tick, [], []
    begin, every = round(1.5 / tick), max(round(1.0 / loop.gains.arm.sensor.sampling / tick), 1)
    for k in range(round(seconds / tick)):
        if k % every == 0:
            reading = max(5e3 * x, 0.0) + 0.1 * rng.normal()
        shown = reading
        if bad is not None and begin <= k < begin + count * every:
            shown = bad + 1e-3 * ((k - begin) // every % 5)  # equal ones would be one reading
        speeds.append(loop.update(shown, x))
        states.append((loop.phase, loop.trouble))
        x += tick * speeds[-1]
    return loop, np.array(speeds), states, begin


@pytest.mark.parametrize("arm", ["ur5e", "fr3"])
@pytest.mark.parametrize("bad", [0.0, 100.0, 1000.0, -1000.0])
def test_one_bad_sample_in_a_steady_press_leaves_no_trace(arm, bad):
    for count, seed in ((1, 0), (1, 1), (2, 2)):
        clean, *_ = steady_press(arm, seed=seed)
        loop, _, states, begin = steady_press(arm, bad, count, seed=seed)
        assert states[begin - 1] == ("locked", "")
        assert loop.trouble == ""
        assert loop.estimate.stiffness == pytest.approx(5e3, rel=0.05)
        assert loop.estimate.stiffness == clean.estimate.stiffness
        assert loop.estimate.bound == pytest.approx(clean.estimate.bound, rel=0.01)


def test_a_bad_sample_that_is_a_large_force_is_reacted_to_at_once():
    for bad, words in ((1000.0, "end of its scale"), (70.0, "above its limit"), (-50.0, "negative beyond")):
        loop, speeds, states, begin = steady_press(bad=bad)
        assert words in states[begin][1]
        assert speeds[begin] == 0.0 if bad < 0.0 else speeds[begin] <= -loop.gains.approach


def test_a_force_that_departs_for_three_readings_is_believed():
    gone, *_ = steady_press(bad=0.0, count=10_000)
    assert gone.phase == "free motion"
    bounds = [steady_press(bad=0.0, count=count)[0].estimate.bound for count in (2, 3)]
    assert bounds[0] < 1.1 * 5e3 < 2.0 * 5e3 < bounds[1]
