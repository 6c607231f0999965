"""Resolved acceleration: with a perfect model each direction is the linear system of (4.12), whatever the arm does."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.signal import StateSpace, lsim

from controllers.ideal_arm import ARM, START, press, task
from palpate._vector import ZERO3, Vec3, solve
from palpate.controllers import ResolvedAcceleration
from palpate.controllers.hybrid import resolved_acceleration

angles = st.floats(-3.0, 3.0)
joints = st.builds(Vec3, angles, angles, angles)
GAINS = Vec3(400.0, 400.0, 400.0), Vec3(80.0, 80.0, 80.0)


@given(joints, joints, joints)
def test_the_torque_gives_the_acceleration_that_was_asked_for(q, qd, u_x):
    assume(abs(np.sin(q.y)) > 0.1)
    model = ARM.model(q, qd)
    torque = resolved_acceleration(model.J, model.Jdqd, model.M, model.h, u_x)
    qdd = solve(model.M, torque - model.h)
    np.testing.assert_allclose(np.array(model.J @ qdd + model.Jdqd), np.array(u_x), atol=1e-8)


@given(joints, joints)
def test_it_is_inverse_dynamics_by_newton_and_euler(q, qd):
    """Another way to the same torque: App. D's recursion at the joint acceleration that is wanted."""
    assume(abs(np.sin(q.y)) > 0.1)
    model, u_x = ARM.model(q, qd), Vec3(1.0, -2.0, 3.0)
    qdd = solve(model.J, u_x - model.Jdqd)
    torque = resolved_acceleration(model.J, model.Jdqd, model.M, model.h, u_x)
    np.testing.assert_allclose(
        np.array(torque), np.array(ARM.newton_euler(q, qd, qdd, ZERO3)), rtol=1e-9, atol=1e-9
    )


def test_the_error_decays_as_the_gains_say():
    """(4.12): e'' + K_pv e' + K_pp e = 0 in y and phi at once; kv = 2 sqrt(kp) does not overshoot."""
    kp, kv = Vec3(400.0, 400.0, 100.0), Vec3(40.0, 12.0, 20.0)
    asked = task(0.0, y=0.004)._replace(s=ZERO3)
    t, x, _, _ = press(ResolvedAcceleration(kp, kv), asked, stiffness=0.0)
    linear = StateSpace([[0, 1], [-400.0, -12.0]], [[0], [400.0]], [[1, 0]], [[0]])
    _, expected, _ = lsim(linear, np.full(t.size, 0.004), t)
    np.testing.assert_allclose(x[:, 1], expected, atol=1e-8)
    np.testing.assert_allclose(x[:, 0], START.x, atol=1e-8)
    np.testing.assert_allclose(x[:, 2], 0.0, atol=1e-8)
    assert x[:, 1].max() > 0.004, "kv 12 overshoots"
    critical = press(ResolvedAcceleration(*GAINS), asked, stiffness=0.0)[1]
    assert critical[:, 1].max() <= 0.004


@pytest.mark.parametrize("n", [3, 5])
def test_on_arrays_it_serves_any_arm(n):
    """Five joints for three directions: the task's acceleration is met, with the least kinetic energy."""
    g = np.random.default_rng(n)
    J, root = g.normal(size=(3, n)), g.normal(size=(n, n))
    M, h, Jdqd, u_x = root @ root.T + np.eye(n), g.normal(size=n), g.normal(size=3), g.normal(size=3)
    qdd = np.linalg.solve(M, resolved_acceleration(J, Jdqd, M, h, u_x) - h)
    np.testing.assert_allclose(J @ qdd + Jdqd, u_x, atol=1e-10)
    null = np.eye(n) - np.linalg.pinv(J) @ J
    np.testing.assert_allclose(null.T @ M @ qdd, 0.0, atol=1e-9)
