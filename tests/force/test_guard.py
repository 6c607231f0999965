"""The guard: no reading and no history makes a speed that is not finite or beyond the limit, or that runs away."""

from __future__ import annotations

import numpy as np
import pytest

from force.gained import gains_of
from palpate.force import ForceLoop
from palpate.force.contact_evidence import FREE_MOTION
from palpate.force.guard import BEYOND, BLIND, BOUNCED, DRIFTS, SWINGS, TROUBLES, UNTARED, Guarded, state_in
from palpate.force.simulated_press import pressed, surface, world_of

HOSTILE = [0.0, -0.0, 1e-300, 1e77, -1e77, 1e154, 1e300, np.nan, np.inf, -np.inf]
HOSTILE += [5.0, 99.5, 101.0, 999.0, -999.0]


def troubles(control, rows):
    """The trouble of each tick of a run, from its readings and positions."""
    state, codes = control.start(), []
    for k in range(len(rows)):
        _, state = control.step(state, 20.0, rows[k, 4], rows[k - 1, 2] if k else -1e-3)
        codes.append(state.guard.trouble)
    return codes


def travel(name, error, seconds=1.5, noise=0.1, force=20.0):
    """Rows of an approach in free motion alone, with the sensor's error [N] as a function of time."""
    gains = gains_of(name, force)
    n = round(seconds * gains.arm.rate)
    wrong = error(np.arange(n) * gains.arm.tick)
    world = world_of(gains.arm, noise=noise)
    return gains, pressed(
        world, surface(1e5), Guarded(gains.cautious()), 10.0, np.full(n, force), 3, error=wrong
    )


@pytest.mark.parametrize("name", ["ur5e", "fr3"])
@pytest.mark.parametrize(
    "error",
    [
        lambda t: 0.6 + 0.0 * t,
        lambda t: 0.3 * t,
        lambda t: 0.3 * np.sin(2.0 * np.pi * 15.0 * t),
        lambda t: 0.5 * (t > 0.4) + 0.5 * (t > 0.9),
        lambda t: 4.0 + 0.0 * t,
    ],
    ids=["bias", "drift", "hum", "steps", "untared"],
)
def test_no_error_of_the_sensor_makes_the_tip_faster_than_its_approach(name, error):
    gains, rows = travel(name, error)
    assert rows[:, 3].max() <= gains.approach * (1.0 + 1e-12)


@pytest.mark.parametrize("name", ["ur5e", "fr3"])
def test_a_step_is_whole_within_half_of_the_lag(name):
    control = Guarded(gains_of(name).cautious())
    for late in range(12):
        state, rise = control.start(), 0.0
        before, sensor = 0.0, np.zeros(200)
        for k in range(150 + late, 200):  # a low-pass of 120 Hz
            before += (1.0 - np.exp(-2.0 * np.pi * 120.0 * control.law.tick)) * (1.0 - before)
            sensor[k] = before
        for k, force in enumerate(sensor):
            _, state = control.step(state, 20.0, force + 1e-3 * (k % 3), 0.0)
            rise = max(rise, state.law.watch.steepest.rise)
        assert 0.9 < rise < 1.01


@pytest.mark.parametrize("name", ["ur5e", "fr3", "iiwa14"])
def test_two_steps_of_a_cable_in_one_direction_are_no_surface(name):
    for seed in range(40):
        rng = np.random.default_rng(seed)
        times, sizes = rng.uniform(0.5, 0.8, 2), rng.uniform(0.2, 1.0, 2)
        gains, rows = travel(name, lambda t, a=times, h=sizes: (h[:, None] * (t >= a[:, None])).sum(axis=0))
        assert rows[:, 3].max() <= gains.approach * (1.0 + 1e-12)


@pytest.mark.parametrize("name", ["ur5e", "fr3"])
def test_any_signal_below_the_level_leaves_the_approach(name):
    gains = gains_of(name)
    for seed in range(10):
        rng = np.random.default_rng(seed)
        walk = np.cumsum(rng.standard_normal(20_000)) * rng.uniform(0.005, 0.05)
        level = gains.level - 4.0 * 0.02
        _, rows = travel(name, lambda t, w=walk, a=level: a * np.sin(w[: len(t)]), noise=0.02)
        assert rows[:, 3].max() <= gains.approach * (1.0 + 1e-12)


def test_a_bias_that_does_not_follow_the_tip_is_taken_out_and_a_drift_is_said():
    gains = gains_of("ur5e")
    loop, rng, x = ForceLoop(gains), np.random.default_rng(0), 0.0
    said = set()
    for k in range(3000):
        t = k * gains.arm.tick
        x += gains.arm.tick * loop.update(0.6 + 0.05 * t + 0.1 * rng.standard_normal(), x)
        said.add(loop.trouble)
    assert loop.bias == pytest.approx(0.6 + 0.05 * t, abs=0.15)
    assert loop.drift == pytest.approx(0.05, abs=0.03)
    assert TROUBLES[DRIFTS] in said
    assert loop.phase == "free motion"


def test_white_noise_is_no_drift_however_short_the_free_motion():
    gains = gains_of("ur5e")
    for seed in range(200):
        loop, rng, x = ForceLoop(gains), np.random.default_rng(seed), 0.0
        for _ in range(400):
            x += gains.arm.tick * loop.update(0.1 * rng.standard_normal(), x)
            assert loop.trouble != TROUBLES[DRIFTS]


def test_an_offset_beyond_the_bias_holds_the_tip():
    gains = gains_of("ur5e")
    loop, rng, x = ForceLoop(gains), np.random.default_rng(0), 0.0
    for _ in range(1500):
        x += gains.arm.tick * loop.update(4.0 + 0.1 * rng.standard_normal(), x)
    assert loop.trouble == TROUBLES[UNTARED]
    assert loop.update(4.0, x) == 0.0


@pytest.mark.parametrize("name", ["ur5e", "fr3"])
@pytest.mark.parametrize("seed", range(4))
def test_hostile_streams_leave_only_finite_speeds_within_the_limit(name, seed):
    gains, rng = gains_of(name), np.random.default_rng(seed)
    loop = ForceLoop(gains)
    for _ in range(20_000):
        force = rng.choice(HOSTILE) if rng.random() < 0.1 else rng.normal(10.0, 30.0)
        place = rng.choice(HOSTILE) if rng.random() < 0.05 else rng.normal(0.0, 0.01)
        missed = rng.choice([0.0, 0.0, 0.0, 1.0, 50.0, np.nan, -1.0])
        speed = loop.update(float(force), float(place), float(missed))
        assert abs(speed) <= gains.arm.limits.speed
    assert np.isfinite(loop.state).all()


@pytest.mark.parametrize("reading", [(1e77, 0.0), (5.0, 1e4), (np.nan, 0.0), (5.0, -np.inf)])
def test_what_no_sensor_can_show_is_no_reading(reading):
    loop = ForceLoop(gains_of("ur5e"))
    loop.update(0.1, 0.0)
    assert loop.update(*reading) == 0.0
    assert loop.trouble == TROUBLES[BLIND]
    assert np.isfinite(loop.update(0.1, 0.0))
    assert loop.trouble != TROUBLES[BLIND]


@pytest.mark.parametrize("times", [5.0, 50.0])
def test_a_cap_that_is_far_too_low_ends_within_three_bounces(times):
    gains = gains_of("ur5e", cap=1e5 / times)
    world = world_of(gains.arm, noise=0.1)
    rows = pressed(world, surface(1e5, 10.0), Guarded(gains.cautious()), 1e-3, np.full(2000, 20.0), 1)
    force = rows[:, 0]
    first = int(np.argmax(force > 0.0))
    assert ((force[first:-1] > 0.0) & (force[first + 1 :] <= 0.0)).sum() <= 3
    assert np.abs(force[-200:] - 20.0).max() < 0.05 * 20.0


def test_a_cap_that_is_refuted_is_said():
    gains = gains_of("ur5e", cap=2e3)
    world, control = world_of(gains.arm, noise=0.1), Guarded(gains.cautious())
    rows = pressed(world, surface(4e4, 10.0), control, 1e-3, np.full(1000, 20.0), 1)
    assert BEYOND in troubles(control, rows)


@pytest.mark.parametrize("mass", [1.0, 3.0])
def test_a_heavy_surface_that_swings_off_the_tip_is_said_within_a_second_and_met_at_the_approach(mass):
    gains = gains_of("ur5e")
    world, control = world_of(gains.arm, noise=0.1), Guarded(gains.cautious())
    rows = pressed(world, surface(650.0, 0.5, mass=mass), control, 1e-3, np.full(1000, 20.0), 1)
    assert rows[:, 0].max() < 20.0
    codes = troubles(control, rows)
    assert codes.index(SWINGS) * gains.arm.tick < 1.2
    assert rows[[code == SWINGS for code in codes], 3].max() <= gains.approach * (1.0 + 1e-12)


@pytest.mark.parametrize("mass", [0.0, 0.1])
def test_a_surface_that_stays_at_the_tip_is_not_said_to_swing(mass):
    gains = gains_of("ur5e")
    world, control = world_of(gains.arm, noise=0.1), Guarded(gains.cautious())
    rows = pressed(world, surface(2e4, 20.0, mass=mass), control, 1e-3, np.full(1000, 20.0), 1)
    assert SWINGS not in troubles(control, rows)


def test_bounces_that_do_not_end_stop_the_tip():
    gains = gains_of("ur5e")
    loop, rng, x = ForceLoop(gains), np.random.default_rng(0), 0.0
    for k in range(2000):
        force = 60.0 if k % 100 < 20 and k > 100 else 0.0
        x += gains.arm.tick * loop.update(force + 0.1 * rng.standard_normal(), x)
    assert state_in(np.array(loop.state)).stage.phase == FREE_MOTION
    assert loop.trouble == TROUBLES[BOUNCED]
    loop.reset()
    assert loop.update(0.0, x) == pytest.approx(gains.approach)


def test_a_sensor_of_coarse_steps_presses_if_its_step_is_given():
    quiet = {"noise": 0.3, "resolution": 1.0}
    gains = gains_of("ur5e", **quiet)
    world = world_of(gains.arm, noise=0.01, resolution=1.0)
    rows = pressed(world, surface(5e3, 10.0), Guarded(gains.cautious()), 2e-3, np.full(1500, 20.0), 1)
    assert np.abs(rows[-200:, 0] - 20.0).max() < 1.0
    assert rows[:, 0].max() < 1.1 * 20.0
