"""Each model against what its own book says of it."""

import numpy as np
import pytest

from palpate.environments import (
    HuntCrossley,
    KelvinVoigt,
    StandardLinearSolid,
    SurfaceState,
    join,
    part_from,
    touch,
)
from palpate.errors import InputError

DT = 50e-6
FOAM = StandardLinearSolid(5600, 13, 0.02, 6900, 0.23)


def held(surface, p, seconds, dt):
    """The state after a step to penetration p, held for so long."""
    state = surface.relax(surface.start(), p, 0.0, 1e-12)
    for _ in range(round(seconds / dt)):
        state = surface.relax(state, p, 0.0, dt)
    return state


@pytest.mark.parametrize("dt", [DT, 1e-3])
@pytest.mark.parametrize("seconds", [0.0, 0.05, 0.23, 2.0])
def test_a_solid_relaxes_as_its_closed_form(seconds, dt):
    p = 2e-3
    force = FOAM.force(held(FOAM, p, seconds, dt), p, 0.0)
    assert force == pytest.approx(p * (5600 + 6900 * np.exp(-seconds / 0.23)), rel=3e-6 if dt == DT else 1e-4)


def test_a_solids_branch_is_second_order():
    """Along p = sin(w t) the stretch is tau w/(1 + w^2 tau^2) (cos w t + w tau sin w t - exp(-t/tau))."""
    tau, w, end = FOAM.branch_time, 30.0, 0.3
    factor = tau * w / (1 + (w * tau) ** 2)
    exact = factor * (np.cos(w * end) + w * tau * np.sin(w * end) - np.exp(-end / tau))

    def error(steps):
        state = FOAM.start()
        for t in np.arange(1, steps + 1) * (end / steps):
            state = FOAM.relax(state, np.sin(w * t), w * np.cos(w * t), end / steps)
        return abs(state.internal - exact)

    errors = np.array([error(n) for n in (50, 100, 200)])
    np.testing.assert_allclose(np.log2(errors[:-1] / errors[1:]), 2.0, atol=0.1)


@pytest.mark.parametrize("dt", [0.5, 100.0])
def test_a_branch_does_not_ring_however_long_the_step(dt):
    state = SurfaceState(2e-3, 0.0, 2e-3, 1.0)
    for _ in range(20):
        before, state = state, FOAM.relax(state, 2e-3, 0.0, dt)
        assert 0.0 <= state.internal <= before.internal


def test_pressed_at_once_a_solid_is_as_stiff_as_both_its_springs():
    state = held(FOAM, 1e-3, 5.0, 1e-3)
    more = FOAM.force(state, 1.1e-3, 0.0) - FOAM.force(state, 1.0e-3, 0.0)
    assert more == pytest.approx(12500 * 1e-4, rel=1e-9)


def test_touched_again_a_solid_remembers_its_branch():
    state = SurfaceState(1e-3, 0.0, -3e-4, 0.0)
    assert FOAM.force(touch(state, 0.0), 1e-3, 0.0) == FOAM.force(state, 1e-3, 0.0)
    assert part_from(touch(state, 0.0)) == state


@pytest.mark.parametrize("mass", [0.0, 1e-9, 1e-4])
def test_a_light_skins_rate_does_not_ring(mass):
    surface = KelvinVoigt(5200, 200, mass)
    state = SurfaceState(1e-3, 0.0, 0.0, 0.0)
    for _ in range(300):
        state = surface.free(state, DT)
        # From the slow way back, v = -K s/B, it strays by the step's own error only.
        assert -30.0 * state.deflection <= state.rate <= 0.0


@pytest.mark.parametrize("damping", [200.0, 20.0])
def test_a_massless_surface_creeps_back(damping):
    """B s' + K s = 0: first order, so that halving the step halves the error."""
    surface = KelvinVoigt(5200, damping, 0)

    def error(dt):
        state = SurfaceState(1e-3, 0.0, 0.0, 0.0)
        for _ in range(round(0.01 / dt)):
            state = surface.free(state, dt)
        return state.deflection - 1e-3 * np.exp(-0.01 * 5200 / damping)

    assert error(1e-4) / error(5e-5) == pytest.approx(2.0, abs=0.1)
    assert abs(error(DT)) < 5e-6


def test_a_free_skin_swings_at_its_own_frequency():
    mass, stiffness, damping = 0.02, 5600.0, 2.0
    surface = KelvinVoigt(stiffness, damping, mass)
    decay, natural = damping / (2 * mass), stiffness / mass
    w = np.sqrt(natural - decay**2)
    state, out = SurfaceState(1e-3, 0.0, 0.0, 0.0), []
    for _ in range(600):
        state = surface.free(state, DT)
        out.append(state.deflection)
    time = np.arange(1, 601) * DT
    exact = 1e-3 * np.exp(-decay * time) * (np.cos(w * time) + decay / w * np.sin(w * time))
    np.testing.assert_allclose(out, exact, atol=3e-6)


def test_a_sphere_neither_jumps_nor_pulls_at_slow_parting():
    sphere = HuntCrossley(5e5, 2e6, 1.5, 0)
    for p in (1e-9, 1e-12):
        assert abs(sphere.force(sphere.start(), p, 1.0)) < 1e2 * p
    assert sphere.force(sphere.start(), 1e-3, -0.2) > 0.0
    assert sphere.force(sphere.start(), 1e-3, -0.3) < 0.0


def test_a_massless_sphere_comes_back_at_constant_speed():
    """K p^n + lambda p^n v = 0 has v = -K/lambda whatever p."""
    sphere = HuntCrossley(5e5, 2e6, 1.5, 0)
    state = sphere.free(SurfaceState(0.1, 0.0, 0.0, 0.0), 1e-4)
    assert state.rate == pytest.approx(-0.25, rel=1e-3)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: KelvinVoigt(0, 1, 1), "stiffness must be above 0 N/m, got 0.0"),
        (lambda: KelvinVoigt(float("nan"), 1, 1), "stiffness"),
        (lambda: KelvinVoigt(1, -1, 1), "damping must be at least 0 N s/m, got -1.0"),
        (lambda: KelvinVoigt(1, 1, -1), "mass must be at least 0 kg"),
        (lambda: StandardLinearSolid(1, 1, 1, -1, 1), "branch stiffness"),
        (lambda: StandardLinearSolid(1, 1, 1, 1, 0), "branch time must be above 0 s"),
        (lambda: HuntCrossley(1, 1, 0.5, 1), "exponent must be at least 1, got 0.5"),
        (
            lambda: join("foam"),
            "cannot join a str; there are: HuntCrossley, KelvinVoigt, StandardLinearSolid",
        ),
    ],
)
def test_bad_parameters_are_refused_with_their_limit(make, words):
    with pytest.raises(InputError, match=words):
        make()
