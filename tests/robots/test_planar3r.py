"""The arm against MuJoCo, against itself, and against bad input."""

import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate._vector import Vec3
from palpate.errors import InputError
from palpate.robots import Arm3, Planar3R
from robots.mujoco_arm import Oracle

THESIS = Planar3R()
OTHER = Planar3R(
    Arm3(
        length=Vec3(0.31, 0.47, 0.12),
        mass=Vec3(3.1, 7.7, 0.9),
        com=Vec3(-0.11, 0.05, -0.2),
        moment=Vec3(0.02, 0.3, 0.004),
    )
)
ARMS = pytest.mark.parametrize(
    "robot", [THESIS, OTHER, THESIS.with_rotors()], ids=["thesis", "other", "rotors"]
)

RNG = np.random.default_rng(3)
STATES = RNG.uniform(-4.0, 4.0, (12, 4, 3))

angles = st.floats(-np.pi, np.pi)


@ARMS
def test_the_rate_of_the_jacobian_is_its_derivative(robot):
    """Along a motion, by central differences; the Jacobian itself, the pose's angle aside, is MuJoCo's below."""
    q, qd, step = STATES[:, 0], STATES[:, 1], 1e-6
    slope = (robot.jacobian(q + step * qd) - robot.jacobian(q - step * qd)) / (2.0 * step)
    np.testing.assert_allclose(robot.jacobian_dot(q, qd), slope, atol=1e-8)
    np.testing.assert_allclose(robot.forward_kinematics(q)[:, 2], q.sum(axis=1), atol=1e-12)


@ARMS
@pytest.mark.parametrize("state", STATES)
def test_mujoco_agrees(robot, state):
    q, qd, qdd, _ = state
    oracle = Oracle(robot.arm, q, qd, qdd)
    pairs = {
        "position": (robot.forward_kinematics(q)[:2], oracle.position),
        "J": (robot.jacobian(q), oracle.jacobian),
        "M": (robot.mass_matrix(q), oracle.mass_matrix),
        "h": (robot.bias_torque(q, qd), oracle.bias),
        "tau": (robot.inverse_dynamics(q, qd, qdd), oracle.torque),
    }
    for name, (value, expected) in pairs.items():
        np.testing.assert_allclose(value, expected, rtol=0.0, atol=1e-11, err_msg=name)


@ARMS
def test_the_recursion_and_the_closed_form_agree_under_a_wrench(robot):
    q, qd, qdd, w = RNG.uniform(-4.0, 4.0, (4, 200, 3))
    closed = (
        np.einsum("nij,nj->ni", robot.mass_matrix(q), qdd)
        + robot.bias_torque(q, qd)
        + np.einsum("nji,nj->ni", robot.jacobian(q), w)
    )
    np.testing.assert_allclose(robot.inverse_dynamics(q, qd, qdd, w), closed, atol=1e-11)
    np.testing.assert_allclose(robot.forward_dynamics(q, qd, closed, w), qdd, atol=1e-9)


def test_inverse_jacobian():
    q = RNG.uniform(-3.0, 3.0, (200, 3))
    q[:, 1] = np.where(np.abs(np.sin(q[:, 1])) < 1e-2, 1.0, q[:, 1])
    np.testing.assert_allclose(
        THESIS.jacobian_inverse(q) @ THESIS.jacobian(q), np.tile(np.eye(3), (200, 1, 1)), atol=1e-11
    )


def test_work_of_the_motors_and_of_the_wrench_is_the_change_of_kinetic_energy():
    from scipy.integrate import solve_ivp

    tau, w = np.array([0.3, -0.1, 0.02]), np.array([1.0, -2.0, 0.1])

    def slope(_, state):
        q, qd = state[:3], state[3:6]
        power = tau @ qd - w @ THESIS.jacobian(q) @ qd
        return np.concatenate([qd, THESIS.forward_dynamics(q, qd, tau, w), [power]])

    start = np.array([0.3, 1.0, -0.5, 0.4, -0.2, 1.0, 0.0])
    end = solve_ivp(slope, (0.0, 1.0), start, rtol=1e-10, atol=1e-12).y[:, -1]
    gained = THESIS.kinetic_energy(end[:3], end[3:6]) - THESIS.kinetic_energy(start[:3], start[3:6])
    assert abs(gained) > 0.1
    assert gained == pytest.approx(end[6], rel=1e-7)


@given(q1=angles, q2=angles, q3=st.floats(-10.0, 10.0))
def test_both_elbows_come_back_to_the_pose(q1, q2, q3):
    pose = THESIS.forward_kinematics([q1, q2, q3])
    for elbow in (+1, -1):
        q = THESIS.inverse_kinematics(pose, elbow)
        np.testing.assert_allclose(THESIS.forward_kinematics(q), pose, atol=1e-9)
        assert elbow * q[1] >= 0.0
        assert np.abs(q[:2]).max() <= np.pi


@given(q1=angles, q2=st.floats(0.01, np.pi - 0.01), q3=st.floats(-10.0, 10.0), elbow=st.sampled_from([1, -1]))
def test_the_joint_angles_come_back_with_all_turns_of_phi(q1, q2, q3, elbow):
    q = np.array([q1, elbow * q2, q3])
    found = THESIS.inverse_kinematics(THESIS.forward_kinematics(q), elbow) - q
    turns = 2.0 * np.pi * np.round(found[0] / (2.0 * np.pi))  # q1 = pi may come back as -pi
    np.testing.assert_allclose(found, [turns, 0.0, -turns], atol=1e-9)


def test_where_the_listing_starts():
    q = [-0.5377671, 1.3205011, -0.7827340]
    np.testing.assert_allclose(THESIS.forward_kinematics(q), [0.454, 0.0, 0.0], atol=1e-7)
    np.testing.assert_allclose(THESIS.inverse_kinematics([0.454, 0.0, 0.0]), q, atol=1e-6)


@pytest.mark.parametrize("q2", [0.0, np.pi, 1e-9])
def test_stretched_and_folded_poses_are_within_reach(q2):
    pose = THESIS.forward_kinematics([0.4, q2, -0.2])
    np.testing.assert_allclose(THESIS.forward_kinematics(THESIS.inverse_kinematics(pose)), pose, atol=1e-8)


@pytest.mark.parametrize(("x", "beyond"), [(0.6318, "100 mm"), (0.1508 + 0.0504, "10 mm")])
def test_out_of_reach_says_by_how_much(x, beyond):
    with pytest.raises(InputError, match=rf"out of reach by {beyond}: joint 3 can be 60\.4 to 381\.0 mm"):
        THESIS.inverse_kinematics([x, 0.0, 0.0])


def test_out_of_reach_names_the_worst_of_a_batch():
    poses = np.tile([0.454, 0.0, 0.0], (2, 3, 1))
    poses[1, 2, 0] = 0.6318
    poses[0, 1, 0] = 0.5319
    with pytest.raises(InputError, match=re.escape("(index (1, 2)) is out of reach by 100 mm")):
        THESIS.inverse_kinematics(poses)


@pytest.mark.parametrize("q2", [0.0, np.pi, -1e-8])
def test_singular_names_the_determinant(q2):
    with pytest.raises(InputError, match=r"singular at q: \|det J\| = .* m\^2, at least 3\.54e-08 is needed"):
        THESIS.jacobian_inverse([0.3, q2, 0.1])
    with pytest.raises(InputError, match=r"singular at q \(index \(1,\)\)"):
        THESIS.jacobian_inverse([[0.3, 1.0, 0.1], [0.3, q2, 0.1]])


@pytest.mark.parametrize("shape", [(), (2,), (4,), (3, 2), (3, 1)])
def test_wrong_shapes_are_named(shape):
    bad, good = np.zeros(shape), np.zeros(3)
    calls = {
        "q": [
            lambda: THESIS.forward_kinematics(bad),
            lambda: THESIS.jacobian(bad),
            lambda: THESIS.jacobian_inverse(bad),
            lambda: THESIS.mass_matrix(bad),
            lambda: THESIS.bias_torque(bad, good),
        ],
        "qd": [lambda: THESIS.jacobian_dot(good, bad), lambda: THESIS.bias_torque(good, bad)],
        "qdd": [lambda: THESIS.inverse_dynamics(good, good, bad)],
        "torque": [lambda: THESIS.forward_dynamics(good, good, bad)],
        "pose": [lambda: THESIS.inverse_kinematics(bad)],
    }
    for name, attempts in calls.items():
        for attempt in attempts:
            with pytest.raises(InputError, match=re.escape(f"{name} must have shape (..., 3), got {shape}")):
                attempt()


def test_shapes_that_do_not_broadcast_are_named():
    with pytest.raises(InputError, match=re.escape("{'q': (4, 3), 'qd': (5, 3)}")):
        THESIS.bias_torque(np.zeros((4, 3)), np.zeros((5, 3)))


def test_a_wrench_that_is_one_number_other_than_zero_is_refused():
    with pytest.raises(InputError, match="tip_wrench must be 0 or have shape"):
        THESIS.inverse_dynamics([0, 1, 0], [0, 0, 0], [0, 0, 0], 5.0)


@pytest.mark.parametrize("elbow", [0, 2, -0.5, np.nan])
def test_elbow_is_a_sign(elbow):
    with pytest.raises(InputError, match=r"elbow must be \+1 or -1, got"):
        THESIS.inverse_kinematics([0.454, 0.0, 0.0], elbow)


@pytest.mark.parametrize("name", ["length", "mass", "moment", "limits"])
@pytest.mark.parametrize("value", [0.0, -1.0, np.nan, np.inf])
def test_an_arm_of_impossible_numbers_is_refused(name, value):
    with pytest.raises(InputError, match=f"{name} of an arm must be positive and finite"):
        Planar3R(Arm3(**{name: Vec3(1.0, value, 1.0)}))


def test_batches_of_any_shape_and_elbows_as_arrays():
    q = RNG.uniform(-2.0, 2.0, (2, 4, 3))
    for found, one in (
        (THESIS.jacobian(q), THESIS.jacobian),
        (THESIS.mass_matrix(q), THESIS.mass_matrix),
        (THESIS.forward_kinematics(q), THESIS.forward_kinematics),
        (THESIS.jacobian_inverse(q), THESIS.jacobian_inverse),
    ):
        np.testing.assert_allclose(found[1, 2], one(q[1, 2]), rtol=1e-12, atol=1e-13)
    tau = THESIS.inverse_dynamics(q, np.ones(3), np.zeros((4, 1)) + np.ones(3), [1.0, 0.0, 0.0])
    expected = THESIS.inverse_dynamics(q[1, 2], np.ones(3), np.ones(3), [1.0, 0.0, 0.0])
    np.testing.assert_allclose(tau[1, 2], expected, rtol=1e-12)
    assert THESIS.jacobian(np.zeros((0, 3))).shape == (0, 3, 3)
    assert THESIS.kinetic_energy(q, q).shape == (2, 4)
    sides = np.array([1, -1])
    both = THESIS.inverse_kinematics(np.tile([0.454, 0.0, 0.0], (2, 1)), sides)
    assert np.array_equal(np.sign(both[:, 1]), sides)
