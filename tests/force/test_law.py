"""The cautious law: one text compiled and plain, and what it does on surfaces that it was not told of."""

from __future__ import annotations

import numpy as np
import pytest

from force.gained import gains_of
from palpate._vector import Mat3, Vec3
from palpate.force.contact_estimate import AXIS_K, PRIOR, Fit, fit_through, without_offset
from palpate.force.guard import STATE, flatten, law_in, put_state, state_in
from palpate.force.simulated_press import pressed, surface, world_of
from palpate.force.stage import LOCKED, Stage
from palpate.force.stiffness_bound import Bound, next_bound
from palpate.force.touching import touch


def run(name, K, B=0.0, force=20.0, noise=0.1, seconds=2.0, seed=0, desired=None, **others):
    gains = gains_of(name, force, noise=noise)
    world = world_of(gains.arm, noise=noise)
    wanted = np.full(round(seconds * gains.arm.rate), force) if desired is None else desired
    return pressed(world, surface(K, B, **others), gains.cautious(), 0.1 * gains.approach, wanted, seed)


@pytest.mark.parametrize("name", ["ur5e", "fr3"])
@pytest.mark.parametrize("K", [300.0, 3e3, 3e4, 1e6])
def test_it_settles_on_what_it_meets_without_retuning(name, K):
    force = run(name, K, 2.0 * 0.1 * np.sqrt(K))[:, 0]
    assert abs(force[-50:].mean() - 20.0) < 0.2  # 1 %: noise of 0.1 N, averaged
    assert force.max() < 1.1 * 20.0
    firm = int(np.argmax(force > 10.0))
    assert (force[firm:] > 0.0).all()


def test_compiled_and_plain_are_one_law():
    gains = gains_of("ur5e")
    world, desired = world_of(gains.arm, noise=0.1), np.full(150, 20.0)
    noise = np.random.default_rng(3).standard_normal(8 * 151)
    outs = []
    compiled = pressed(world, surface(5e3, 20.0), gains.cautious(), 1e-4, desired, 3)
    plain = np.zeros((150, 5))
    touch(
        world, surface(5e3, 20.0), gains.cautious(), -1e-4, desired, noise, np.zeros(150),
        np.zeros(world.delay + 1), plain,
    )  # fmt: skip
    outs += [compiled, plain]
    # Sums may be taken in another order: the last digits, through a loop that forgets.
    np.testing.assert_allclose(compiled, plain, rtol=1e-8, atol=1e-10)
    assert plain[-1, 1] < gains.seen_cap  # it has learned, so that all of the law was run


def test_the_bound_stays_above_the_stiffness():
    seen, below, least = gains_of("ur5e").arm.seen(5e3), [], []
    for seed in range(20):
        rows = run("ur5e", 5e3, 30.0, seed=seed)
        pressing = rows[rows[:, 0] > 5.0, 1]
        below.append(pressing[:100] < seen)
        least.append(pressing.min() / seen)
        assert rows[-200:, 1].min() > seen
    assert min(least) > 0.5  # what the proof asks for
    assert np.mean(below) < 1.0 / 15.0  # 1.5 standard deviations, while there is something to learn


def test_in_the_air_it_approaches_and_learns_nothing():
    gains = gains_of("ur5e")
    rows = pressed(
        world_of(gains.arm, noise=0.1), surface(1e5), gains.cautious(), 1.0, np.full(3000, 20.0), 1
    )
    assert (rows[:, 1] == gains.seen_cap).all()
    assert rows[:, 3].max() <= gains.approach
    assert rows[500:, 3].mean() == pytest.approx(gains.approach, rel=0.02)


def test_a_tip_that_lies_on_the_surface_at_the_start_does_not_jump():
    gains = gains_of("ur5e")
    rows = pressed(
        world_of(gains.arm, noise=0.1), surface(1e5), gains.cautious(), -1e-4, np.full(800, 20.0), 1
    )
    assert rows[:, 0].max() < 1.15 * 20.0


def test_a_surface_that_begins_where_noise_looked_like_one_is_not_taken_for_soft():
    # Noise of the air has raised the evidence when the tip meets 235 kN/m: what it had taken for a slope is refuted.
    desired = np.full(1200, 39.0)
    gains = gains_of("fr3", 39.0, noise=0.13)
    world, stiff = world_of(gains.arm, noise=0.13), surface(2.35e5, 500.0)
    peaks = [
        pressed(world, stiff, gains.cautious(), gap, desired, seed)[:, 0].max()
        for seed in range(20) for gap in (1e-3, 4e-3)
    ]  # fmt: skip
    assert max(peaks) < 1.1 * 39.0


def test_evidence_of_a_contact_is_rare_in_the_air_whatever_the_noise():
    # A hundred seconds; the noise told is a third too small.
    gains = gains_of("ur5e", noise=0.1)
    far = np.full(50_000, 20.0)
    rows = pressed(world_of(gains.arm, noise=0.13), surface(1e5), gains.cautious(), 10.0, far, 7)
    assert (rows[:, 1] > 0.999 * gains.seen_cap).all()


def test_a_rise_as_slow_as_noise_is_found_before_the_force_asked_for():
    # 0.45 N in a second: the mean in free motion follows it, and what it does not follow counts as noise.
    gains = gains_of("ur5e", noise=0.15)
    slow = gains.cautious()._replace(approach=0.0015)
    rows = pressed(world_of(gains.arm, noise=0.15), surface(300.0), slow, 1e-3, np.full(6000, 20.0), 1)
    learned = int(np.argmax(rows[:, 1] < gains.seen_cap))
    assert rows[learned, 0] < 10.0 * 0.15  # `EDGE` of twice the deviation told, and a rest that is one off
    assert abs(rows[-100:, 0].mean() - 20.0) < 0.3


@pytest.mark.parametrize("exponent", [1.5, 2.0])
def test_a_surface_that_stiffens_is_one_whose_tangent_is_within_the_proof(exponent):
    depth = 20.0 / 5e3
    force = run(
        "ur5e", 20.0 / depth**exponent, 10.0 / depth ** (exponent - 1.0), seconds=3.0, exponent=exponent
    )
    assert abs(force[-200:, 0].mean() - 20.0) < 0.3  # it settles, though not without overshoot
    tangent = exponent * 5e3 * (force[-1, 0] / 20.0) ** (1.0 - 1.0 / exponent)
    assert force[-200:, 1].min() > 0.5 * gains_of("ur5e").arm.seen(tangent)  # what the proof asks of K_u


def test_a_stiffer_surface_in_mid_press_is_found_at_once():
    rows = run("ur5e", 7e3, 8.0, seconds=4.0, later=62e3, change=2.0, depth=20.0 / 7e3)
    force = rows[1000:, 0]
    assert force.max() < 1.05 * 20.0
    assert abs(force[-100:].mean() - 20.0) < 0.3


def test_a_step_after_it_was_locked_is_followed():
    desired = np.concatenate([np.full(1000, 20.0), np.full(1000, 30.0)])
    force = run("ur5e", 2e3, 10.0, desired=desired)[:, 0]
    assert abs(force[900:1000].mean() - 20.0) < 0.3
    assert abs(force[-100:].mean() - 30.0) < 0.3
    assert force.max() < 1.1 * 30.0


def evident(law, stiffness, std):
    """What the last theta alone shows: a stiffness with its standard deviation, in caps, and no damping."""
    start = law.start().estimate
    N = Mat3(Vec3(1.0 / std**2, 0.0, 0.0), Vec3(0.0, 1e12, 0.0), Vec3(0.0, 0.0, 1e12))
    return start._replace(fast=Fit(N, Vec3(stiffness / std**2, 0.0, 0.0)), since=1e3)


def test_a_rise_on_suspicion_is_taken_back_and_one_on_evidence_stays():
    law = gains_of().cautious()
    locked, known = Stage(LOCKED, 1e3, 1e3, 1e3), 0.01 * law.cap
    start = law.start()
    watch, follow = start.watch, start.follow
    held = Bound(known, known, law.cap, 0.0, 1e3, start.bound.sure)
    suspected = next_bound(law, held, locked, evident(law, 0.05, 0.01), watch, follow)  # by 3.7 deviations
    assert suspected.used > 0.05 * law.cap
    assert suspected.held == known
    later = suspected
    for _ in range(round(3.0 * law.theta / law.tick) + 1):
        later = next_bound(law, later, locked, evident(law, 0.01, 0.01), watch, follow)
    assert later.used == later.held == known
    shown = next_bound(law, held, locked, evident(law, 0.05, 0.005), watch, follow)  # by 7.4
    assert shown.used == shown.held > 0.05 * law.cap


def test_the_flat_state_is_the_state():
    gains = gains_of()
    law = gains.cautious()
    numbers = flatten(law)
    assert flatten(law_in(numbers)).tolist() == numbers.tolist()
    state, rng = law.start(), np.random.default_rng(0)
    for k in range(300):
        _, state = law.step(state, 20.0, 0.02 * k + 0.1 * rng.normal(), 1e-5 * k)
    flat = flatten(state)
    assert len(flat) == STATE
    again = np.zeros(STATE)
    put_state(again, state_in(flat))
    assert again.tolist() == flat.tolist()
    assert state.stage.phase != LOCKED


def test_the_fit_is_least_squares_with_its_prior():
    rng = np.random.default_rng(0)
    phi = rng.normal(size=(200, 3))
    force = phi @ [0.4, 0.1, 2.0] + 0.01 * rng.normal(size=200)
    fit = fit_through(0.0, 1.0, 10.0)
    for row, f in zip(phi, force, strict=True):
        fit = fit.with_reading(Vec3(*row), f, 1e4, 1.0)
    N = 1e4 * phi.T @ phi + np.array(PRIOR) + np.diag([0.0, 0.0, 0.01])
    r = 1e4 * phi.T @ force + np.array([0.0, 0.0, 0.01])
    np.testing.assert_allclose(fit.solution(), np.linalg.solve(N, r), rtol=1e-9)
    assert fit.std(AXIS_K) == pytest.approx(np.sqrt(np.linalg.inv(N)[0, 0]))


def test_dropping_the_offset_keeps_what_is_known_of_the_slopes():
    rng = np.random.default_rng(1)
    fit = fit_through(0.0, 0.0, 100.0)
    for _ in range(50):
        phi = rng.normal(size=3)
        fit = fit.with_reading(Vec3(*phi), float(phi @ [0.5, 0.2, 3.0]), 1e6, 1.0)
    kept = without_offset(fit, 1.0)
    assert kept.std(AXIS_K) == pytest.approx(fit.std(AXIS_K), rel=1e-3)  # the prior is added once more
    assert kept.solution().x == pytest.approx(0.5, rel=1e-4)
    assert without_offset(fit, 0.25).std(AXIS_K) == pytest.approx(2.0 * fit.std(AXIS_K), rel=1e-3)


def test_no_information_is_no_certainty():
    even = Fit(PRIOR, Vec3(0.0, 0.0, 0.0))
    for _ in range(20_000):
        even = even.with_reading(
            Vec3(0.0, 8.0, 1.0), 0.3, 100.0, 0.999
        )  # the tip moves evenly in free motion
    assert even.std(Vec3(1.0, 0.0, 0.0)) > 0.9
    assert np.isfinite(list(even.solution())).all()


@pytest.mark.parametrize("name", ["ur5e", "fr3"])
def test_a_surface_of_little_mass_is_one_without(name):
    light, none = (run(name, 2e3, 20.0, noise=0.0, mass=mass)[:, 0] for mass in (0.02, 0.0))
    assert np.abs(light - none).max() < 0.5
    heavy = run(name, 2e3, 20.0, noise=0.0, mass=0.3)[:, 0]
    assert np.abs(heavy - none).max() > 0.5
    assert abs(heavy[-50:].mean() - 20.0) < 0.2
