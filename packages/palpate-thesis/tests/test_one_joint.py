"""The bench of one joint: its physics against closed forms, and a network that alone learns to press."""

import math

import numpy as np
import pytest

from palpate.environments import KelvinVoigt, join
from palpate.friction import LuGre
from palpate.references import ForceSchedule
from palpate_thesis.one_joint import (
    COLUMNS,
    DirectIntegral,
    Joint,
    direct_neural,
    one_joint,
)

FOAM, RUBBER = KelvinVoigt(5200, 200, 0.10), KelvinVoigt(34500, 480, 0.05)
STEPS = ForceSchedule(20.0, 10.0, 2.5, 0.0, 0.5, 0.0)
CONSTANT = ForceSchedule(15.0, 15.0, 2.5, 0.0, 0.5, 0.0)
FRICTIONLESS = LuGre(0.0, 0.0, 0.0, 1.0, 1.0, 1.0)
surfaces = pytest.mark.parametrize("surface", [FOAM, RUBBER], ids=["foam", "rubber"])


def pressed(surface, torque, duration, dt=5e-5):
    """Penetration of a frictionless joint under a constant torque, step by step."""
    joint = Joint(0.126, 0.113, FRICTIONLESS, join(surface))
    state, path = joint.start(), []
    for _ in range(round(duration / dt)):
        state, _ = joint.advance(state, torque, dt)
        path.append(joint.lever * state.q)
    return np.array(path)


def test_the_lever_divides_torque_by_stiffness():
    assert pressed(FOAM, 1.13, 1.0)[-1] == pytest.approx(1.13 / 0.113 / 5200.0, rel=1e-4)


def test_it_swings_at_the_frequency_of_tip_and_surface():
    spring, dt = KelvinVoigt(5200, 0, 0.10), 5e-5
    path = pressed(spring, 1.13, 1.0, dt)
    still = 1.13 / 0.113 / 5200.0
    rising = np.flatnonzero((path[:-1] < still) & (path[1:] >= still))
    period = dt * np.diff(rising).mean()
    assert 2 * math.pi / period == pytest.approx(math.sqrt(5200.0 / (0.126 / 0.113**2 + 0.10)), rel=1e-3)


@surfaces
@pytest.mark.parametrize("dt", [4e-4, 5e-5])
def test_the_surfaces_law_holds_in_central_differences(surface, dt):
    """Of a lever they are exact, at any step: what an identifier finds is B and M themselves."""
    joint = Joint(0.126, 0.113, FRICTIONLESS, join(surface))
    state, rows = joint.start(), []
    for k in range(round(0.3 / dt)):
        p = joint.lever * state.q
        state, felt = joint.advance(state, 1.5 + 0.8 * math.sin(200.0 * k * dt), dt)
        rows.append((p, felt.force))
    p, f = np.array(rows[len(rows) // 3 :]).T
    rate, second = (p[2:] - p[:-2]) / (2 * dt), (p[2:] - 2 * p[1:-1] + p[:-2]) / dt**2
    law = surface.stiffness * p[1:-1] + surface.damping * rate + surface.mass * second
    assert f.min() > 0.0
    # Double precision of p, two differences later: 1e-19/dt^2.
    np.testing.assert_allclose(f[1:-1], law, rtol=0, atol=1e-9)


@surfaces
def test_an_integral_leaves_no_error(surface):
    record = one_joint(surface, DirectIntegral(1.4e-3), CONSTANT).run(10.0)
    assert record.columns["force"][-2000:].mean() == pytest.approx(15.0, abs=0.3)


@surfaces
def test_the_network_alone_learns_to_follow(surface):
    record = one_joint(surface, direct_neural(), STEPS).run(15.0)
    c = record.columns
    settled = (c["t"] % 2.5 > 2.0) & (c["t"] > 5.0)
    assert np.abs(c["force"] - c["force_desired"])[settled].mean() < 0.6
    assert record.meta["end"] == "done"


@surfaces
def test_to_first_order_it_is_an_integral_controller(surface):
    """The same error, step for step, as an integral of the gain that the network has: both follow as slowly."""
    neural = one_joint(surface, direct_neural(2e-5), STEPS).run(15.0).columns
    integral = one_joint(surface, DirectIntegral(float(neural["gain"].mean())), STEPS).run(15.0).columns

    def rms(c):
        return math.sqrt(((c["force_desired"] - c["force"])[5000:] ** 2).mean())

    assert rms(neural) == pytest.approx(rms(integral), rel=0.05)
    untaught = one_joint(surface, direct_neural(1e-9), STEPS).run(15.0).columns
    assert rms(untaught) > 3 * rms(neural)


def test_the_angle_is_what_the_rates_add_up_to():
    c = one_joint(FOAM, DirectIntegral(1.4e-3), STEPS).run(2.0).columns
    assert np.trapezoid(c["rate"], c["t"]) == pytest.approx(c["angle"][-1], rel=1e-3)
    assert c["penetration"] == pytest.approx(0.113 * c["angle"])


def test_the_torque_stays_within_the_motor():
    record = one_joint(FOAM, direct_neural(), ForceSchedule(40.0, 40.0, 2.5, 0.0, 0.5, 0.0)).run(5.0)
    assert np.abs(record.columns["torque"]).max() == 2.5
    assert record.columns["saturated"][-100:].all()


def test_compiled_and_plain_are_the_same_to_the_last_bit():
    bench = one_joint(FOAM, direct_neural(), STEPS)
    compiled, plain = bench.run(0.15, seed=3), bench.run(0.15, seed=3, compiled=False)
    for name in COLUMNS:
        assert np.array_equal(compiled.columns[name], plain.columns[name]), name


def test_a_run_leaves_the_next_one_as_it_was():
    bench = one_joint(FOAM, direct_neural(), STEPS)
    one, other = bench.run(0.5, seed=1), bench.run(0.5, seed=1)
    assert np.array_equal(one.columns["force"], other.columns["force"])
    assert not np.array_equal(one.columns["force_sampled"], bench.run(0.5, seed=2).columns["force_sampled"])
