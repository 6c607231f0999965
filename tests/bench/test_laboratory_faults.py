"""What an arm may do beside what the thesis says of its own: give way, rub unevenly, and shake its sensor."""

import math

import numpy as np
import pytest

from palpate._vector import Vec3
from palpate.bench import build, load, with_values
from palpate.bench.plant import RIGID, Plant, elastic_mode
from palpate.bench.summary import CONTACT
from palpate.environments import KelvinVoigt, StickSlip, join
from palpate.errors import InputError
from palpate.friction import LuGre
from palpate.robots.arm3 import Arm3

SHORT = {"robot.start": (0.462, 0.0, 0.0), "approach.first": 0.467, "approach.hold": 0.3, "run.press": 2.0}
"""An approach of a few steps, and a short press."""
FOAM = with_values(load("foam-hybrid"), SHORT)
DT = 5e-5


def test_a_mode_under_a_constant_force_gives_way_by_force_over_stiffness():
    mode, state = elastic_mode(2e4, 50.0, 0.5), RIGID.start()
    for _ in range(4000):
        state = mode.step(state, mode.acceleration(state) - mode.mobility * 10.0, DT)
    assert state.bend == pytest.approx(-10.0 / 2e4, rel=1e-6)


def test_a_struck_mode_swings_at_its_frequency_and_dies_away_by_its_damping():
    f, zeta, impulse = 40.0, 0.05, 0.01
    mode = elastic_mode(1e5, f, zeta)
    state, bends = mode.after_impulse(mode.start(), impulse), []
    for _ in range(4000):
        state = mode.step(state, mode.acceleration(state), DT)
        bends.append(state.bend)
    w = 2.0 * math.pi * f
    t, damped = DT * np.arange(1, 4001), w * math.sqrt(1.0 - zeta**2)
    exact = -mode.mobility * impulse / damped * np.exp(-zeta * w * t) * np.sin(damped * t)
    # Semi-implicit Euler is of first order: off by about w dt / 2 of the amplitude.
    assert np.max(np.abs(bends - exact)) < w * DT * np.max(np.abs(exact))


def test_the_tip_of_an_arm_that_gives_way_lies_behind_what_its_joints_say():
    stiffness = 4e4
    record = build(
        with_values(FOAM, {"elastic": {"stiffness": stiffness, "frequency": 60.0, "damping": 0.3}})
    ).run(30.0, press=2.0)
    late = (record["phase"] == CONTACT) & (record["t"] > record["t"][-1] - 0.2)
    behind = record["x"][late] - FOAM.wall.x - record["penetration"][late]
    assert behind.mean() == pytest.approx(record["force"][late].mean() / stiffness, rel=0.02)


def test_a_mode_that_the_physics_cannot_resolve_is_refused():
    with pytest.raises(InputError, match=r"frequency in \[elastic\] must be at most 1000 Hz"):
        build(with_values(FOAM, {"elastic": {"stiffness": 1e5, "frequency": 1500.0}}))


def test_friction_is_higher_forward_than_backward_by_its_asymmetry():
    uneven = LuGre(asymmetry=0.25)
    v = Vec3(0.5, 0.5, 0.5)
    assert tuple(uneven.steady(v)) == pytest.approx([1.25 * x for x in LuGre().steady(v)])
    assert tuple(uneven.steady(-v)) == pytest.approx([-0.75 * x for x in LuGre().steady(v)])
    with pytest.raises(InputError, match="asymmetry"):
        LuGre(asymmetry=1.0).validate()


def test_what_lies_beyond_the_sensor_is_read_as_its_mass_times_its_acceleration():
    arm = Arm3().with_rotors()
    surface, side = join(KelvinVoigt(5200.0, 200.0, 0.1)), StickSlip(5000.0, 20.0, 0.7)
    plant = Plant(arm, LuGre(), surface, side, 1.0, RIGID, 0.4)
    state = plant.start_at(arm.inverse(Vec3(0.45, 0.0, 0.0), 1.0))
    rates = [0.0]
    for _ in range(200):
        state, felt = plant.advance(state, Vec3(5.0, 1.0, 0.1), DT)
        rates.append(felt.rate)
    # The rate that the last step began with was half a step older than its Jacobian: first order in dt.
    assert felt.inertial == pytest.approx(0.4 * (rates[-1] - rates[-2]) / DT, rel=1e-2)
    assert abs(felt.inertial) > 0.1


def test_rough_noise_is_that_of_before_at_rest_and_larger_in_motion():
    plain, rough = (
        build(with_values(FOAM, {"force_sensor.roughness": r})).run(30.0, 5, press=1.0) for r in (0.0, 200.0)
    )
    n = min(len(plain), len(rough))
    plain_force, rough_force, t = plain["force_sampled"][:n], rough["force_sampled"][:n], plain["t"][:n]
    assert np.array_equal(plain_force[t < 0.25], rough_force[t < 0.25])
    free = (plain["phase"][:n] != CONTACT) & (rough["phase"][:n] != CONTACT) & (t > 0.35)
    assert not np.array_equal(plain_force[free], rough_force[free])
    assert rough_force[free].std() > plain_force[free].std()
