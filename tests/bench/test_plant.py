"""The plant by itself: order of its integrator, energy, and contact that never pulls."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bench.quick import scaled
from palpate._jit import kernel
from palpate._vector import Vec3, solve
from palpate.bench.plant import Plant
from palpate.environments import HuntCrossley, KelvinVoigt, StandardLinearSolid, StickSlip, join
from palpate.environments.surface import SurfaceState, alone
from palpate.friction import LuGre
from palpate.robots.arm3 import Arm3

WALL = 0.465
FOAM = KelvinVoigt(5200.0, 200.0, 0.1)
SURFACES = {
    "kelvin-voigt": FOAM,
    "standard linear solid": StandardLinearSolid(5600.0, 13.0, 0.02, 6900.0, 0.23),
    "hunt-crossley": HuntCrossley(2e5, 4e5, 1.5, 0.05),
}


def plant_with(surface=FOAM, friction=None):
    side = StickSlip(5000.0, 20.0, 0.7)
    return Plant(Arm3().with_rotors(), friction or LuGre(), join(surface), side, WALL)


def at_rest(plant, x):
    return plant.start_at(plant.arm.inverse(Vec3(x, 0.0, 0.0), 1.0))


def pressed(plant, depth=1e-3):
    """In contact and at rest at a depth [m], the branch of a relaxing surface stretched with it."""
    state = at_rest(plant, plant.wall + depth)
    internal = depth if isinstance(alone(plant.surface), StandardLinearSolid) else 0.0
    return state._replace(surface=SurfaceState(depth, 0.0, internal, 1.0))


def push(plant, force, q):
    """The torque of a wrench [N, N, N m] at the tip."""
    return plant.arm.jac(q).T @ Vec3(*force)


def march(plant, state, torque, dt, steps, out):
    """Steps under constant torque; of each: work of motors, friction, normal and side force, touching, normal."""
    for k in range(steps):
        before = state.surface.contact
        state, felt = plant.advance(state, torque, dt)
        J = plant.arm.jac(state.q)
        out[k, 0] = dt * (torque @ state.qd)
        out[k, 1] = dt * (felt.friction @ state.qd)
        out[k, 2] = dt * felt.normal * (J.r1 @ state.qd)
        out[k, 3] = dt * felt.tangential * (J.r2 @ state.qd)
        out[k, 4] = state.surface.contact - before
        out[k, 5] = felt.normal
        out[k, 6] = state.surface.contact
    return state


compiled = kernel(march)


def after(plant, state, torque, dt, seconds):
    out = np.empty((round(seconds / dt), 7))
    return compiled(plant, state, torque, dt, len(out), out), out


def numbers(state):
    return np.array([*state.q, *state.qd])


@pytest.mark.parametrize("surface", SURFACES.values(), ids=SURFACES)
@pytest.mark.parametrize("where", ["in free motion", "in contact"])
def test_the_integrator_is_of_first_order(surface, where):
    """Each halving of the step halves the distance to a solution with steps 64 times finer."""
    plant = plant_with(surface)
    state = pressed(plant) if where == "in contact" else at_rest(plant, 0.42)
    torque = push(plant, (30.0, 3.0, 0.1), state.q)
    coarse, seconds = 1e-4, 0.02
    exact = numbers(after(plant, state, torque, coarse / 256, seconds)[0])
    errors = [
        np.abs(numbers(after(plant, state, torque, coarse / fine, seconds)[0]) - exact).max()
        for fine in (1, 2, 4)
    ]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    np.testing.assert_allclose(orders, 1.0, atol=0.15)


def shake(plant, state, base, swing, dt, out):
    """Steps under a torque that swings at 25 Hz; of each: penetration, the branch's stretch, normal force."""
    for k in range(len(out)):
        out[k, 0], out[k, 1] = plant.arm.pose(state.q).x - plant.wall, state.surface.internal
        state, felt = plant.advance(state, base + math.sin(50.0 * math.pi * k * dt) * swing, dt)
        out[k, 2] = felt.normal


compiled_shake = kernel(shake)


def misfit(surface, dt, depth=4e-3):
    """Normal force less what the surface's law gives in central differences of p; and what half a step does to it."""
    plant = plant_with(surface, scaled(LuGre(), 0.3))
    state = pressed(plant, depth)
    static = surface.force(state.surface, depth, 0.0)
    out = np.empty((round(0.2 / dt), 3))
    compiled_shake(
        plant,
        state,
        push(plant, (static, 0, 0), state.q),
        push(plant, (0.6 * static, 0, 0), state.q),
        dt,
        out,
    )
    p, z, f = out.T
    assert f.min() > 0.0, "in contact throughout"
    rate, second = (p[2:] - p[:-2]) / (2 * dt), (p[2:] - 2 * p[1:-1] + p[:-2]) / dt**2
    law = [
        surface.force(SurfaceState(at, 0.0, inside, 1.0), at, v)
        for at, inside, v in zip(p[1:-1], z[1:-1], rate, strict=True)
    ]
    late = 0.5 * dt * np.std(second) * (surface.force(state.surface, depth, 1.0) - static)
    return np.std(f[1:-1] - law - surface.mass * second), late


@pytest.mark.parametrize("surface", SURFACES.values(), ids=SURFACES)
def test_force_belongs_to_the_place_the_rate_and_the_acceleration_of_its_moment(surface):
    """An identifier that is exact must find B and M, not M less B times half a step."""
    for dt in (2e-4, 5e-5):
        misfits, late = misfit(surface, dt)
        assert misfits < 1e-3 * late, "the damping force would be late by half a step"
        assert misfits < 1e-5


def kinetic(plant, state):
    return plant.arm.kinetic_energy(state.q, state.qd)


def imbalance(dt, seconds=0.25):
    """Work of the motors over a press from the air, less what became of it, by account [J]."""
    plant = plant_with(friction=scaled(LuGre(), 0.3))
    state = at_rest(plant, WALL - 2e-3)
    torque = push(plant, (40.0, 4.0, 0.0), state.q)
    end, out = after(plant, state, torque, dt, seconds)
    landed = np.flatnonzero(out[:, 4] > 0.0)
    assert len(landed) == 1, "one touch"
    # The impact is inelastic: what it loses is in no force's work.
    before, work = after(plant, state, torque, dt, dt * landed[0])[0], out.sum(axis=0)
    tip_mass = 1.0 / (
        plant.arm.jac(before.q).r1 @ solve(plant.arm.inertia(before.q), plant.arm.jac(before.q).r1)
    )
    speed = plant.arm.jac(before.q).r1 @ before.qd
    lost = 0.5 * speed**2 * tip_mass * FOAM.mass / (tip_mass + FOAM.mass)
    stored = plant.surface.stored_energy(end.surface)
    elastic = 0.5 * FOAM.stiffness * end.surface.deflection**2
    assert stored >= elastic
    normal = out[landed[0] + 1 :, 2].sum()
    damped = normal - stored + 0.5 * FOAM.mass * at_common(speed, tip_mass) ** 2
    assert damped > 0.0
    gained = kinetic(plant, end) - kinetic(plant, state)
    accounts = {
        "motors": work[0],
        "kinetic": gained,
        "surface": stored,
        "damped": damped,
        "friction": work[1],
        "side": work[3],
        "impact": lost,
    }
    return accounts["motors"] - sum(v for k, v in accounts.items() if k != "motors"), accounts


def at_common(speed, tip_mass):
    return speed * tip_mass / (tip_mass + FOAM.mass)


def test_what_the_motors_give_is_found_again():
    coarse, accounts = imbalance(50e-6)
    fine, _ = imbalance(12.5e-6)
    assert all(value > 0.0 for value in accounts.values()), accounts
    assert abs(coarse) < 0.02 * accounts["motors"]
    assert abs(fine) < 0.4 * abs(coarse), "first order: a quarter"


def test_below_break_away_the_arm_creeps_and_stops():
    """Less torque than stiction: the joints move about as far as their bristles bend, and no further."""
    plant = plant_with()
    state = at_rest(plant, 0.454)
    torque = 0.3 * plant.friction.coulomb
    end, _ = after(plant, state, torque, 50e-6, 1.0)
    later, _ = after(plant, end, torque, 50e-6, 1.0)
    moved, crept = np.array(end.q) - np.array(state.q), np.array(later.q) - np.array(end.q)
    bristles = np.array(torque) / np.array(plant.friction.sigma0)
    assert np.all(moved >= 0.99 * bristles)
    assert np.all(moved < 2.0 * bristles)
    assert np.abs(crept).max() < 1e-3 * bristles.max()


wrenches = st.tuples(st.floats(-60, 60), st.floats(-20, 20), st.floats(-1, 1))


@settings(max_examples=40)
@given(wrenches, wrenches, st.sampled_from(sorted(SURFACES)))
def test_contact_never_pulls_and_nothing_blows_up(first, second, name):
    """Pushed and torn about at random, on any surface: one-sided, finite, passive."""
    plant = plant_with(SURFACES[name])
    state = at_rest(plant, WALL - 5e-4)
    for wrench in (first, second, first):
        torque = push(plant, wrench, state.q)
        before = energy(plant, state)
        state, out = after(plant, state, torque, 50e-6, 0.05)
        assert np.all(out[:, 5] >= 0.0)
        assert np.isfinite(numbers(state)).all()
        # The centripetal part is that of half a step before: at up to 20 rad/s, a thousandth of a radian.
        assert energy(plant, state) <= before + out[:, 0].sum() + 1e-3 * np.abs(out[:, 0]).sum() + 1e-9


def energy(plant, state):
    """All the energy there is [J]: of the arm, the surface, the joints' bristles and the one along the surface."""
    bristles = sum(plant.friction.stored_energy(state.bristles)) + plant.side.bending_energy(state.side)
    return kinetic(plant, state) + plant.surface.stored_energy(state.surface) + bristles


def test_compiled_is_plain_to_the_bit():
    plant = plant_with()
    state = at_rest(plant, WALL - 2e-4)
    torque = push(plant, (25.0, 2.0, 0.0), state.q)
    plain_out, out = np.empty((3000, 7)), np.empty((3000, 7))
    plain_end = march(plant, state, torque, 50e-6, 3000, plain_out)
    end = compiled(plant, state, torque, 50e-6, 3000, out)
    assert out[:, 6].any()
    np.testing.assert_array_equal(plain_out, out)
    assert plain_end == end
