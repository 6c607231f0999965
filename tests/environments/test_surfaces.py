"""The laws that every surface obeys, whatever its model: one suite over all of them."""

import numpy as np
import pytest

from palpate.environments import HuntCrossley, KelvinVoigt, StandardLinearSolid, SurfaceState, join, touch
from palpate.environments.surface import alone, members
from palpate.testing import surfaces as laws
from palpate.testing.surfaces import DT, press, recover

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


@each
def test_a_free_surface_comes_to_rest_at_zero(surface):
    state = SurfaceState(2e-3, 0.0, 0.0, 0.0)
    out = np.empty((200000, 3))
    recover(join(surface), state, DT, out)
    # A sphere with a skin swings on where its own damping vanishes, ever slower.
    assert abs(out[-1, 0]) < (1e-4 if isinstance(surface, HuntCrossley) and surface.mass else 1e-8)
    first, last = (surface.stored_energy(SurfaceState(*row, 0.0)) for row in (out[0], out[-1]))
    assert last < 0.01 * first + 1e-20


@each
@pytest.mark.parametrize("law", laws.LAWS, ids=lambda law: law.__name__)
def test_it_obeys_the_laws_that_users_run_on_theirs(surface, law):
    law(join(surface))


@each
@pytest.mark.parametrize("v", [0.0, 1e-3, 0.1, 1.0])
def test_at_touch_the_force_is_what_the_model_says(surface, v):
    state = touch(surface.start(), v)
    at_touch = surface.force(state, 1e-12, v)
    jump = 0.0 if isinstance(surface, HuntCrossley) else surface.damping * v
    assert at_touch == pytest.approx(jump, abs=1e-6)


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
def test_joined_it_is_the_same(surface):
    push = 15.0 * np.sin(np.arange(3000) * 0.004)
    single, joined = np.empty((3000, 4)), np.empty((3000, 4))
    press.plain(surface, 1.5, -1e-4, 0.1, push, DT, single)
    press.plain(join(surface), 1.5, -1e-4, 0.1, push, DT, joined)
    np.testing.assert_array_equal(single, joined)
    assert alone(join(surface)) is surface
    assert join(surface).truth() == surface.truth()
    assert join(surface).mass == surface.mass
