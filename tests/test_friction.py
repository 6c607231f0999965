"""Friction: what it holds, how it breaks away, and that it never gives work away."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate._jit import kernel
from palpate._vector import Vec3
from palpate.errors import InputError
from palpate.friction import Coulomb, LuGre

JOINTS = LuGre()
ONE = LuGre(sigma0=1250.0, sigma1=11.0, sigma2=0.4, coulomb=0.25, static=0.3, stribeck=0.01)
DT = 50e-6

motions = st.lists(st.floats(-50.0, 50.0), min_size=1, max_size=200)


def slide(friction, velocities, dt=DT):
    """Torques and deflections along a motion."""
    z, torques, deflections = friction.start(), [], []
    for v in velocities:
        torque, z = friction.step(z, v, dt)
        torques.append(torque)
        deflections.append(z)
    return np.array(torques), np.array(deflections)


@pytest.mark.parametrize("v", [pytest.param(1e-4, marks=pytest.mark.long), 1e-3, 0.01, 0.03, 1.0, 40.0])
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_steady_sliding_follows_the_stribeck_curve(v, way):
    v *= way
    torques, _ = slide(ONE, [v] * int(40 * 0.3 / (1250.0 * abs(v) * DT) + 200))
    level = 0.25 + 0.05 * np.exp(-((v / 0.01) ** 2))
    assert torques[-1] == pytest.approx(way * level + 0.4 * v, rel=1e-9)
    assert torques[-1] == pytest.approx(ONE.steady(v), rel=1e-9)


def test_presliding_is_a_spring_and_spans_a_fifth_of_a_milliradian():
    small = 1e-6
    torques, _ = slide(ONE, [small / (1000 * DT)] * 1000 + [0.0])
    assert torques[-1] == pytest.approx(1250.0 * small, rel=0.01)
    np.testing.assert_allclose(JOINTS.coulomb / JOINTS.sigma0, [2e-4] * 3, rtol=1e-12)


def test_at_rest_the_bristles_hold_their_load_for_ever():
    _, deflections = slide(ONE, [1e-3] * 2000 + [0.0] * 5000)
    assert deflections[1999] > 0.0
    assert np.ptp(deflections[2000:]) == 0.0


def pulled(friction, inertia, spring, speed, seconds):
    """An inertia with friction, pulled through a spring at a steady speed: rates and the spring's torques."""
    n = round(seconds / DT)
    q = v = 0.0
    z, rates, pulls = friction.start(), np.empty(n), np.empty(n)
    for k in range(n):
        pull = spring * (speed * k * DT - q)
        torque, z = friction.step(z, v, DT)
        v += DT * (pull - torque) / inertia
        q += DT * v
        rates[k], pulls[k] = v, pull
    return rates, pulls


DRY = ONE._replace(sigma2=0.0)


@pytest.mark.long
def test_pulled_slowly_through_a_soft_spring_it_sticks_and_slips():
    rates, pulls = pulled(DRY, inertia=0.1, spring=2.0, speed=2e-3, seconds=120.0)
    later = slice(len(rates) // 2, None)
    assert (np.abs(rates[later]) < 2e-4).mean() > 0.5
    assert rates[later].max() > 10 * 2e-3
    assert 0.28 < pulls[later].max() < 0.301
    assert pulls[later].min() < 0.25


@pytest.mark.parametrize("load", [0.29, -0.29, 0.31, -0.31])
def test_loaded_slowly_it_holds_up_to_its_static_level_and_then_breaks_away(load):
    q, v, z, dt = 0.0, 0.0, DRY.start(), 1e-3
    for k in range(40000):
        torque, z = DRY.step(z, v, dt)
        v += dt * (min(k / 20000, 1.0) * load - torque) / 0.1
        q += dt * v
    assert (abs(q) < 1e-3) == (abs(load) < 0.3)
    assert q * load > 0.0


@given(
    motion=motions, dt=st.sampled_from([1e-6, DT, 1e-3, 0.1]), sigma1=st.sampled_from([0.0, 11.0, 1e3, 1e6])
)
def test_no_motion_gets_more_work_out_than_was_put_in(motion, dt, sigma1):
    friction = ONE._replace(sigma1=sigma1, sigma2=0.0)
    z = friction.start()
    for v in motion:
        torque, new = friction.step(z, v, dt)
        gained = friction.stored_energy(new) - friction.stored_energy(z)
        # Rounding: each part of the torque and each deflection by some last bits. Below 1e-300 there are no more bits.
        forces = 1250.0 * (abs(z) + abs(new)) + abs(torque - 1250.0 * new)
        rounding = 16 * np.finfo(float).eps * forces * (abs(z) + abs(new) + abs(v) * dt) + 1e-300
        assert torque * v * dt >= gained - rounding
        z = new


def test_the_papers_constant_damping_would_give_work_away():
    """Why sigma1 fades: bristles relaxing from stiction at speed dissipate torque v - sigma0 z z' < 0."""
    v, level = 5.0, 0.25
    z = np.linspace(level, 0.3, 101)[1:] / 1250.0
    rate = v - 1250.0 * v * z / level
    assert ((1250.0 * z + 11.0 * rate) * v - 1250.0 * z * rate).min() < -10.0
    torque, new = DRY.step(z[-1], v, 1e-9)
    assert torque * v * 1e-9 > DRY.stored_energy(new) - DRY.stored_energy(z[-1])


@pytest.mark.parametrize("v", [0.5, -5.0, 500.0])
def test_the_damping_is_as_strong_as_passivity_allows(v):
    """At the worst deflection, twice that of steady sliding, strong damping leaves just nothing over."""
    friction = ONE._replace(sigma1=1e9, sigma2=0.0, static=0.6)
    z, dt = np.sign(v) * 2.0 * 0.25 / 1250.0, 1e-9
    torque, new = friction.step(z, v, dt)
    spare = torque * v - (friction.stored_energy(new) - friction.stored_energy(z)) / dt
    assert -1e-6 * abs(v) < spare < 1e-3 * abs(v)


@given(motion=motions, dt=st.sampled_from([1e-6, DT, 1e-3, 1.0, 100.0]))
def test_bristles_never_bear_more_than_the_static_level(motion, dt):
    _, deflections = slide(ONE, motion, dt)
    assert np.abs(1250.0 * deflections).max() <= 0.3 * (1.0 + 1e-12)


@given(motion=motions)
def test_friction_is_odd(motion):
    there, _ = slide(ONE, motion)
    back, _ = slide(ONE, [-v for v in motion])
    np.testing.assert_array_equal(there, -back)


def test_the_step_is_of_first_order():
    """The error of a smooth motion halves with the step."""

    def after(n):
        t = (np.arange(n) + 0.5) * 0.2 / n
        return slide(ONE, 0.02 * np.sin(10.0 * np.pi * t), 0.2 / n)[1][-1]

    exact = after(400_000)
    errors = [abs(after(n) - exact) for n in (2000, 4000, 8000)]
    assert errors[0] / errors[1] == pytest.approx(2.0, rel=0.1)
    assert errors[1] / errors[2] == pytest.approx(2.0, rel=0.1)


@kernel
def along(friction, compensator, v, n, dt):
    z, torque, helped = friction.start(), 0.0 * v, 0.0 * v
    for k in range(n):
        v = -0.999 * v + 1e-3 * v * k
        torque, z = friction.step(z, v, dt)
        helped = helped + compensator.torque(v)
    return torque, z, helped, friction.steady(v), friction.stored_energy(z)


@pytest.mark.parametrize(
    ("friction", "compensator", "v"),
    [(JOINTS, Coulomb(), Vec3(0.01, -0.02, 0.5)), (ONE, Coulomb(0.25, 0.002), 0.02)],
    ids=["three joints", "one joint"],
)
def test_compiled_is_plain_bit_for_bit(friction, compensator, v):
    for n in (1, 10, 500):
        assert along(friction, compensator, v, n, DT) == along.plain(friction, compensator, v, n, DT)


def test_arrays_are_joint_by_joint():
    v = np.linspace(-0.05, 0.05, 7)
    seven = LuGre(*(np.linspace(1.0, 2.0, 7) * p for p in ONE))
    z = np.linspace(-1e-4, 1e-4, 7)
    torque, new = seven.step(z, v, DT)
    comp = Coulomb(np.full(7, 0.25), np.full(7, 0.002)).torque(v)
    for i in range(7):
        one = LuGre(*(float(p[i]) for p in seven)).step(float(z[i]), float(v[i]), DT)
        np.testing.assert_allclose((torque[i], new[i]), one, rtol=1e-14)
        assert comp[i] == Coulomb(0.25, 0.002).torque(float(v[i]))


@pytest.mark.parametrize(("v", "share"), [(0.0, 0.0), (5e-4, 0.25), (-1e-3, -0.5), (2e-3, 1.0), (-7.0, -1.0)])
def test_coulomb_has_a_straight_line_through_zero(v, share):
    assert Coulomb(0.25, 0.002).torque(v) == pytest.approx(share * 0.25, rel=1e-15)
    np.testing.assert_allclose(Coulomb().torque(Vec3(v, v, v)), share * np.array([3.0, 0.25, 0.03]))


@pytest.mark.parametrize("name", ["coulomb", "static", "stribeck"])
@pytest.mark.parametrize("value", [0.0, -1.0, float("nan")])
def test_levels_must_be_positive(name, value):
    with pytest.raises(InputError, match=f"{name} of the friction must be positive, got"):
        JOINTS._replace(**{name: Vec3(1.0, value, 1.0)}).validate()


@pytest.mark.parametrize("name", ["sigma0", "sigma1", "sigma2"])
def test_sigmas_must_not_be_negative(name):
    with pytest.raises(InputError, match=f"{name} of the friction must be zero or positive, got -1"):
        ONE._replace(**{name: -1.0}).validate()


def test_static_must_not_lie_under_coulomb():
    with pytest.raises(InputError, match="static - coulomb of the friction must be zero or positive"):
        ONE._replace(static=0.2).validate()
    assert JOINTS.validate() is JOINTS
