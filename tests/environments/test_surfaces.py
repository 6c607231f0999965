"""The laws that every surface obeys, whatever its model: one suite over all of them."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate._jit import kernel
from palpate.environments import (
    HuntCrossley,
    KelvinVoigt,
    StandardLinearSolid,
    SurfaceState,
    contact_force,
    impact,
    join,
    part_from,
    touch,
)
from palpate.environments.surface import alone, members

DT = 50e-6
SURFACES = {
    "foam, solid": StandardLinearSolid(5600, 13, 0.02, 6900, 0.23),
    "foam, Kelvin-Voigt": KelvinVoigt(5200, 200, 0.10),
    "rubber": KelvinVoigt(34500, 480, 0.05),
    "sphere": HuntCrossley(5e5, 2e6, 1.5, 0.01),
    "massless Kelvin-Voigt": KelvinVoigt(5200, 200, 0),
    "massless solid": StandardLinearSolid(5600, 13, 0, 6900, 0.23),
    "massless sphere": HuntCrossley(5e5, 2e6, 1.5, 0),
    "undamped spring": KelvinVoigt(5200, 0, 0),
    "undamped solid": StandardLinearSolid(5600, 0, 0, 6900, 0.23),
    "almost massless": KelvinVoigt(5200, 200, 1e-9),
}
each = pytest.mark.parametrize("surface", SURFACES.values(), ids=SURFACES.keys())


def test_every_surface_that_an_experiment_can_ask_for_is_here():
    assert set(map(type, members())) == set(map(type, SURFACES.values()))


HEAVY = {name: surface for name, surface in SURFACES.items() if surface.mass > 1e-6}
with_mass = pytest.mark.parametrize("surface", HEAVY.values(), ids=HEAVY.keys())


@kernel
def follow(surface, p, v, a, dt, out):
    """A tip in contact on a given path: force [N] and stored energy [J] at each sample."""
    state = surface.start()
    for k in range(p.size):
        state = surface.relax(state, p[k], v[k], dt)
        out[k, 0] = surface.force(state, p[k], v[k]) + surface.mass * a[k]
        out[k, 1] = surface.stored(state)


@kernel
def recover(surface, state, dt, out):
    """A free surface: deflection, rate and stored energy after each step."""
    for k in range(out.shape[0]):
        state = surface.free(state, dt)
        out[k, 0] = state.deflection
        out[k, 1] = state.rate
        out[k, 2] = surface.stored(state)


@kernel
def press(surface, tip_mass, p, v, push, dt, out):
    """A tip of some mass under a push: penetration, rate, contact force, energy given to the surface."""
    state = surface.start()
    given = 0.0
    for k in range(push.size):
        force = 0.0
        if state.contact == 1.0:
            own = surface.force(state, p, v)
            force = contact_force(own, surface.mass, tip_mass, push[k] / tip_mass)
            if force < 0.0:
                force = 0.0
                state = part_from(state)
        before = v
        v += dt * (push[k] - force) / tip_mass
        p += dt * v
        given += dt * force * 0.5 * (before + v)
        if state.contact == 1.0:
            state = surface.relax(state, p, v, dt)
        else:
            state = surface.free(state, dt)
            if p >= state.deflection and v > state.rate:
                common, impulse = impact(tip_mass, surface.mass, v, state.rate)
                given += impulse * 0.5 * (v + common)
                v = common
                state = touch(state, common)
        out[k, 0], out[k, 1], out[k, 2], out[k, 3] = p, v, force, given
    return state


def path(amplitudes, frequencies, depth, steps, dt):
    """A smooth closed path, at rest at p = 0 at both ends, with rate and acceleration, each (steps,)."""
    time = np.arange(steps) * dt
    length = time[-1]
    window, p = np.sin(np.pi * time / length) ** 4, np.zeros(steps)
    for amplitude, frequency in zip(amplitudes, frequencies, strict=True):
        p += amplitude * np.sin(2 * np.pi * frequency * time)
    p = depth * window * (1.0 + p)
    v = np.gradient(p, dt, edge_order=2)
    return p, v, np.gradient(v, dt, edge_order=2)


def work(force, p):
    """Energy given up to each sample [J]."""
    return np.concatenate(([0.0], np.cumsum(0.5 * (force[1:] + force[:-1]) * np.diff(p))))


@each
@given(
    amplitudes=st.lists(st.floats(-0.5, 0.5), min_size=3, max_size=3),
    frequencies=st.lists(st.floats(0.3, 40.0), min_size=3, max_size=3),
    depth=st.floats(1e-4, 5e-3),
)
@settings(max_examples=30)
def test_it_gives_back_no_more_than_it_was_given(surface, amplitudes, frequencies, depth):
    p, v, a = path(amplitudes, frequencies, depth, 10000, DT)
    out = np.empty((p.size, 2))
    follow(join(surface), p, v, a, DT, out)
    given_energy = work(out[:, 0], p)
    # What the trapezoidal sums of this test leave: they are second order in the step.
    slack = 2e-4 * np.max(np.abs(given_energy))
    assert np.all(given_energy - out[:, 1] >= -slack)
    assert given_energy[-1] >= -slack


@each
@given(s=st.floats(-5e-3, 5e-3), v=st.floats(-0.5, 0.5), z=st.floats(-5e-3, 5e-3))
@settings(max_examples=30)
def test_a_free_surface_never_gains_energy(surface, s, v, z):
    linear = not isinstance(surface, HuntCrossley)
    z = z if isinstance(surface, StandardLinearSolid) else 0.0
    v = v if surface.mass > 0 else 0.0
    state = SurfaceState(s, v, z, 0.0)
    for dt in (DT, 1e-3, 0.1) if linear else (DT,):
        out = np.empty((2000, 3))
        recover(join(surface), state, dt, out)
        energy = np.concatenate(([join(surface).stored(state)], out[:, 2]))
        # The sphere's stiffness is taken at the middle of the step, which is energy's to third order only.
        slack = (1e-12 if linear else 1e-4) * energy[0] + 1e-30
        assert np.all(np.diff(energy) <= slack)


@each
def test_a_free_surface_comes_to_rest_at_zero(surface):
    state = SurfaceState(2e-3, 0.0, 0.0, 0.0)
    out = np.empty((200000, 3))
    recover(join(surface), state, DT, out)
    # A sphere with a skin swings on where its own damping vanishes, ever slower.
    assert abs(out[-1, 0]) < (1e-4 if isinstance(surface, HuntCrossley) and surface.mass else 1e-8)
    assert out[-1, 2] < 0.01 * out[0, 2] + 1e-20


@each
@pytest.mark.parametrize("dt", [1e-3, 1.0, 1e3])
def test_no_step_is_too_long_for_a_free_surface(surface, dt):
    out = np.empty((200, 3))
    recover(join(surface), SurfaceState(1e-3, 0.0, 0.0, 0.0), dt, out)
    assert np.all(np.isfinite(out))
    assert np.max(np.abs(out[:, 0])) <= 1e-3 * (1 + 1e-9)


@each
@given(
    tip_mass=st.floats(0.3, 10.0),
    speed=st.floats(0.0, 0.3),
    pushes=st.lists(st.floats(-30.0, 30.0), min_size=8, max_size=8),
)
@settings(max_examples=20)
def test_it_never_pulls_and_gives_no_energy(surface, tip_mass, speed, pushes):
    push = np.interp(np.arange(8000) * DT, np.arange(8) * 0.05, pushes)
    out = np.empty((push.size, 4))
    press(join(surface), tip_mass, -1e-4, speed, push, DT, out)
    force, given_energy = out[:, 2], out[:, 3]
    assert np.all(np.isfinite(out))
    assert np.all(force >= 0.0)
    # The loop's own integration is first order: its error is a part of the energy that went through.
    through = 0.5 * tip_mass * np.max(out[:, 1] ** 2) + np.max(np.abs(given_energy))
    assert np.all(given_energy >= -0.02 * through)


@each
@pytest.mark.parametrize("speed", [0.01, 0.2])
def test_a_thrown_tip_comes_back_slower(surface, speed):
    out = np.empty((20000, 4))
    press(join(surface), 1.0, -1e-6, speed, np.zeros(20000), DT, out)
    assert out[-1, 1] < 0.0
    assert abs(out[-1, 1]) <= speed * (1 + 2e-3)
    assert out[-1, 0] < 0.0
    assert np.max(out[:, 2]) > 0.0


@each
@pytest.mark.parametrize("v", [0.0, 1e-3, 0.1, 1.0])
def test_at_touch_the_force_is_what_the_model_says(surface, v):
    state = touch(surface.start(), v)
    at_touch = surface.force(state, 1e-12, v)
    jump = 0.0 if isinstance(surface, HuntCrossley) else surface.damping * v
    assert at_touch == pytest.approx(jump, abs=1e-6)


@each
def test_it_stays_at_rest_untouched(surface):
    state = surface.start()
    for _ in range(5):
        state = surface.free(state, DT)
    assert tuple(state) == (0.0, 0.0, 0.0, 0.0)


@with_mass
def test_a_free_step_is_second_order(surface):
    start = SurfaceState(2e-3, 0.0, 1e-3 if isinstance(surface, StandardLinearSolid) else 0.0, 0.0)

    def after(steps):
        out = np.empty((steps, 3))
        recover(join(surface), start, 2e-3 / steps, out)
        return out[-1, 0]

    errors = [after(n) - after(2 * n) for n in (100, 200, 400)]
    orders = np.log2(np.abs(errors[:-1]) / np.abs(errors[1:]))
    np.testing.assert_allclose(orders, 2.0, atol=0.2)


@each
def test_pressing_converges_with_the_step(surface):
    """The loop is semi-implicit Euler: first order, while the surface is held."""

    def settled(dt):
        steps = round(0.1 / dt)
        push = 20.0 * np.sin(0.5 * np.pi * np.arange(steps) * dt / 0.1) ** 2
        out = np.empty((steps, 4))
        press(join(surface), 2.0, 0.0, 1e-3, push, dt, out)
        assert np.min(out[2:, 2]) > 0.0
        return out[-1, 0]

    errors = [settled(dt) - settled(dt / 2) for dt in (1e-4, 5e-5, 2.5e-5)]
    orders = np.log2(np.abs(errors[:-1]) / np.abs(errors[1:]))
    assert np.all(orders > 0.8)
    assert abs(errors[1]) < 1e-5


@each
def test_compiled_is_plain_bit_for_bit(surface):
    push = 15.0 * np.sin(np.arange(3000) * 0.004)
    for part in (surface, join(surface)):
        plain, compiled = np.empty((3000, 4)), np.empty((3000, 4))
        press.plain(part, 1.5, -1e-4, 0.1, push, DT, plain)
        press(part, 1.5, -1e-4, 0.1, push, DT, compiled)
        np.testing.assert_array_equal(plain, compiled)


@each
def test_joined_it_is_the_same(surface):
    push = 15.0 * np.sin(np.arange(3000) * 0.004)
    single, joined = np.empty((3000, 4)), np.empty((3000, 4))
    press.plain(surface, 1.5, -1e-4, 0.1, push, DT, single)
    press.plain(join(surface), 1.5, -1e-4, 0.1, push, DT, joined)
    np.testing.assert_array_equal(single, joined)
    assert alone(join(surface)) is surface
    assert join(surface).truth() == surface.truth()
    assert join(surface).mass == surface.mass


@each
def test_truth_names_values_and_units(surface):
    truth = surface.truth()
    assert {"K", "M"} <= truth.keys()
    assert truth["M"] == (surface.mass, "kg")
    assert all(math.isfinite(value) and unit for value, unit in truth.values())
