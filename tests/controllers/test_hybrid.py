"""Hybrid control: the force where the surface is, the position where it leaves the robot free."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.signal import StateSpace, lsim

from controllers.ideal_arm import ARM, START, press, task
from palpate._vector import ZERO3, Vec3, solve
from palpate.controllers import Hybrid, ResolvedAcceleration
from palpate.controllers.hybrid import hybrid
from palpate.signals.types import Sense

KP, KV = Vec3(400.0, 400.0, 400.0), Vec3(80.0, 80.0, 80.0)
angles = st.floats(-3.0, 3.0)
joints = st.builds(Vec3, angles, angles, angles)


def alike(value):
    return Vec3(value, value, value)


def controller(kf=1.0, ki=0.003):
    return Hybrid(KP, KV, alike(kf), alike(ki))


@given(joints, joints, joints, joints, joints)
def test_with_all_directions_in_force_it_is_the_transposed_jacobian(q, qd, u_x, f_d, u_f):
    """(4.13) with s = 1: no position command, the bias compensated, J^T (f_d + u_f)."""
    assume(abs(np.sin(q.y)) > 0.1)
    model = ARM.model(q, qd)
    ones = Vec3(1.0, 1.0, 1.0)
    torque = hybrid(model.J, model.Jdqd, model.M, model.h, ones, u_x, f_d, u_f)
    drift = model.M @ solve(model.J, -model.Jdqd)
    np.testing.assert_allclose(
        np.array(torque), np.array(model.h + drift + model.J.T @ (f_d + u_f)), rtol=1e-9, atol=1e-9
    )


@given(joints, joints, joints, joints)
def test_with_all_directions_in_position_it_is_resolved_acceleration(q, qd, x, f):
    assume(abs(np.sin(q.y)) > 0.1)
    model = ARM.model(q, qd)
    sense = Sense(q, qd, x, model.J @ qd, f)
    asked = task(20.0, selection=ZERO3)
    torque, _ = controller().step(ZERO3, sense, asked, model)
    plain, _ = ResolvedAcceleration(KP, KV).step(0.0, sense, asked, model)
    np.testing.assert_allclose(np.array(torque), np.array(plain), rtol=1e-9, atol=1e-9)


@given(joints, joints, st.floats(-1.0, 1.0), st.floats(-100.0, 100.0))
def test_each_error_stays_on_its_own_side_of_the_selection(q, qd, way, push):
    """In x a position error changes nothing; in y and phi neither does a force error."""
    assume(abs(np.sin(q.y)) > 0.1)
    model, pose = ARM.model(q, qd), ARM.pose(q)
    asked = task(20.0)
    sense = Sense(q, qd, pose, model.J @ qd, Vec3(5.0, 0.0, 0.0))
    torque, state = controller().step(ZERO3, sense, asked, model)
    moved = sense._replace(x=pose._replace(x=pose.x + way))
    pushed = sense._replace(f=Vec3(5.0, push, push))
    for other in (moved, pushed):
        again, same = controller().step(ZERO3, other, asked, model)
        np.testing.assert_allclose(np.array(again), np.array(torque), rtol=1e-9, atol=1e-9)
        assert same == state


def test_the_integral_gathers_the_error_of_each_sample():
    """K_fi is per sample: after n ticks at an error of 4 N it is n K_fi 4 N, and u_f has the present error too."""
    law, asked = controller(kf=0.0, ki=0.003), task(20.0)
    q = ARM.inverse(START, 1.0)
    model = ARM.model(q, ZERO3)
    sense = Sense(q, ZERO3, START, ZERO3, Vec3(16.0, 0.0, 0.0))
    state = law.start()
    for n in range(1, 6):
        torque, state = law.step(state, sense, asked, model)
        assert state.x == pytest.approx(n * 0.003 * 4.0, rel=1e-12)
        wrench = solve(model.J.T, torque)
        assert wrench.x == pytest.approx(20.0 + state.x, rel=1e-12)
    assert state.y == state.z == 0.0


def test_with_the_feed_forward_the_gain_of_the_loop_is_one_more():
    """At rest the wrench is f_d + K_fp (f_d - f): pressing (1 + K_fp) f_d - K_fp f."""
    q = ARM.inverse(START, 1.0)
    model = ARM.model(q, ZERO3)
    for kf, f in ((1.0, 0.0), (1.0, 12.0), (0.25, 30.0)):
        sense = Sense(q, ZERO3, START, ZERO3, Vec3(f, 0.0, 0.0))
        torque, _ = controller(kf, 0.0).step(ZERO3, sense, task(20.0), model)
        assert solve(model.J.T, torque).x == pytest.approx((1.0 + kf) * 20.0 - kf * f, rel=1e-12)


def test_on_a_spring_it_swings_about_the_desired_force():
    """Proportional only, perfect senses: Lambda x'' = (1 + K_fp)(f_d - f), undamped, whatever the spring."""
    kf, force, spring = 1.0, 1.0, 5200.0
    t, _, _, f = press(controller(kf, 0.0), task(force), spring, duration=0.2, samples=201)
    J, M = np.array(ARM.jac(ARM.inverse(START, 1.0))), np.array(ARM.inertia(ARM.inverse(START, 1.0)))
    # x'' is element (1, 1) of J M^-1 J^T times the net force, for a small motion.
    mobility = (J @ np.linalg.inv(M) @ J.T)[0, 0]
    w2 = mobility * (1.0 + kf) * spring
    linear = StateSpace([[0, 1], [-w2, 0]], [[0], [w2 / spring]], [[spring, 0]], [[0]])
    _, expected, _ = lsim(linear, np.full(t.size, force), t)
    np.testing.assert_allclose(f, expected, atol=0.02 * force)
    assert f.max() == pytest.approx(2.0 * force, rel=0.02)
