"""The loop's matrix against the differential equations, and its boundaries against a brute search."""

from __future__ import annotations

from math import pi

import msgspec
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from palpate.errors import InputError
from palpate.force.arm import load_arm, names, parse_arm
from palpate.force.boundary import radius, stable_between
from palpate.force.lag import lag_of, sum_of_lags, ultimate_gain
from palpate.force.sampled_loop import Law, SampledLoop


@pytest.mark.parametrize("name", ["ur5e", "fr3"])
def test_a_tick_is_what_the_differential_equations_make_of_it(name):
    loop = SampledLoop(load_arm(name))
    K, B, g = 8e3, 90.0, 1e-4
    Phi = loop.phi(K, B, Law(g))
    A, b = loop.rates(K, B)
    p = len(b)
    x = np.random.default_rng(0).normal(size=loop.size)
    readings, delay = loop.lines[0], loop.arm.delay_ticks
    command = p + readings + 1
    acting = x[command + delay - 1] if loop.arm.kind == "position" else x[command + delay]
    flow = solve_ivp(lambda t, z: A @ z + b * acting, (0, loop.arm.tick), x[:p], rtol=1e-11, atol=1e-13)
    after = Phi @ x
    np.testing.assert_allclose(after[:p], flow.y[:, -1], rtol=1e-7, atol=1e-9)
    assert after[p] == pytest.approx(loop.force_gain(K, B) @ x[:p])  # this tick's reading joins the line
    speed = -g * loop.force_unit * x[p + readings - 1]
    assert after[p + readings] == pytest.approx(speed)
    assert after[command] == pytest.approx(x[command] + loop.arm.tick * speed)


def test_a_position_arm_is_affine_in_the_surface():
    loop = SampledLoop(load_arm("ur5e"))
    law = Law(1e-4, 0.3)
    a, b = loop.phi(1e3, 5.0, law), loop.phi(4e4, 700.0, law)
    np.testing.assert_allclose(loop.phi(2.05e4, 352.5, law), 0.5 * (a + b), rtol=1e-12, atol=1e-15)


def test_every_crossing_is_found_islands_too():
    # z^2 - (2 r cos w) z + r^2 at s = 0 grows; a lead makes it stable between two gains only, by root locus.
    start = np.array([[2.0 * 1.01 * np.cos(0.3), -(1.01**2)], [1.0, 0.0]])
    b, c = np.array([1.0, 0.0]), np.array([-0.5, 0.45])
    found = stable_between(start, start + np.outer(b, c), 20.0)
    grid = np.linspace(1e-3, 20.0, 40_001)
    stable = np.array([radius(start + s * np.outer(b, c)) < 1.0 for s in grid])
    edges = grid[1:][stable[1:] != stable[:-1]]
    assert len(found) == 1
    np.testing.assert_allclose(found[0], edges, atol=1e-3)  # the grid's step


def test_the_ultimate_gain_is_where_the_radius_is_one():
    loop = SampledLoop(load_arm("fr3"))
    most = ultimate_gain(loop, 2e4)
    for factor, grows in ((0.999, False), (1.001, True)):
        g = factor * most / loop.arm.seen(2e4)
        assert (radius(loop.phi(2e4, 0.0, Law(g))) >= 1.0) == grows


def test_the_lag_of_an_arm_that_is_nothing_but_late_is_its_delay():
    arm = load_arm("ur5e")
    quick = msgspec.structs.replace(
        arm,
        rate=5000.0,
        inner=msgspec.structs.replace(arm.inner, bandwidth=1000.0, damping=1.0, delay=0.02),
        sensor=msgspec.structs.replace(arm.sensor, low_pass="none", sampling=5000.0),
    )
    # 1 % : of what is not delay, 2 z/w = 0.3 ms, the ultimate gain sees a little more or less.
    assert lag_of(quick) == pytest.approx(sum_of_lags(quick), rel=0.01)


def test_a_tip_that_swings_on_a_position_arm_lengthens_the_lag():
    """Well below the swing its gain is 1/(1 - (w/w_swing)^2), and the loop turns its phase at pi/(2 theta) or below."""
    arm = load_arm("ur5e")
    own = lag_of(arm)

    def times(mass):
        return lag_of(msgspec.structs.replace(arm, inner=msgspec.structs.replace(arm.inner, mass=mass))) / own

    assert times(0.01) == pytest.approx(1.0, rel=1e-3)
    for mass in (1.0, 3.0, 6.0):
        most = (pi / 2.0 / own) ** 2 * mass / arm.series
        assert 1.0 / (1.0 - most / 4.0) < times(mass) < 1.0 / (1.0 - most)


def test_arms_that_come_with_it():
    assert {"ur5e", "fr3", "panda", "iiwa14"} <= set(names())
    for name in names():
        assert 0.01 < lag_of(load_arm(name)) < 0.06
    assert 2.0 * pi * load_arm("ur5e").inner.bandwidth > 0.0


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (("rate = 500", "rate = inf"), "finite"),
        (("rate = 500", "rate = 1"), "rate"),
        (('kind = "position"', 'kind = "hydraulic"'), "hydraulic"),
        (("stiffness = 5e4", "# stiffness"), "stiffness"),
        (("noise = 0.1", "noise = 0"), "noise"),
        (("noise = 0.1", "# noise"), "noise"),
        (("delay = 0.01", "delay = 1"), "ticks"),
        (("butterworth3:120", "butterworth5:120"), "order"),
        (("[sensor]", "[sensors]"), "sensor"),
        (("rate = 500", "rate = 500\nrobot = 1"), "robot"),
        (("rate = 500", "rate = = 500"), "TOML"),
    ],
)
def test_bad_arms_are_refused_in_one_line(root, change, says):
    text = (root / "src/palpate/force/arms/ur5e.toml").read_text(encoding="utf-8")
    assert change[0] in text
    with pytest.raises(InputError, match=says) as caught:
        parse_arm(text.replace(*change), "mine.toml")
    assert "\n" not in str(caught.value)
    assert "mine.toml" in str(caught.value) or says in ("ticks", "order")


def test_an_unknown_arm_names_those_there_are():
    with pytest.raises(InputError, match="ur5e"):
        load_arm("ur5")
