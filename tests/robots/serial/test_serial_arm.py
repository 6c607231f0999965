"""Serial arms against two engines, and against themselves."""

import numpy as np
import pytest

from palpate.errors import InputError
from palpate.robots import SerialArm
from palpate.robots.serial.chain import chain_model, jacobian_rate, room_for
from robots.serial.oracles import NAMES, URDF, ByMuJoCo, ByPinocchio, every_arm, states

ARMS = every_arm()
each = pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS.keys())
#: Sums of some ten products in another order: a hundred roundings, with room.
TOLERANCE = 1e-12


def told(arm, q, qd):
    """Tip, J, Jdot qd, M, h, as an oracle has them."""
    return (
        arm.forward_kinematics(q),
        arm.jacobian(q),
        arm.jacobian_dot_qd(q, qd),
        arm.mass_matrix(q),
        arm.bias_torque(q, qd),
    )


def assert_same(arm, oracle, count=50):
    for q, qd in states(arm, count):
        for name, ours, theirs in zip(
            ("pose", "J", "Jdot qd", "M", "h"), told(arm, q, qd), oracle(q, qd), strict=True
        ):
            assert np.abs(ours - theirs).max() <= TOLERANCE * np.abs(theirs).max(), name


@each
def test_as_mujoco_has_it(arm):
    assert_same(arm, ByMuJoCo(arm))


@pytest.mark.parametrize("name", NAMES)
def test_as_pinocchio_has_it(name):
    assert_same(ARMS[name], ByPinocchio(ARMS[name]))


def test_urdf_as_pinocchio_reads_it():
    arm = ARMS["gantry"]
    assert arm.names == ("slide", "swing", "push", "roll")
    assert arm.chain.slide.tolist() == [1.0, 0.0, 1.0, 0.0]
    assert arm.torque.tolist() == [400.0, 90.0, 200.0, 30.0]
    assert arm.speed.tolist() == [1.5, 2.0, 0.5, 3.0]
    assert_same(arm, ByPinocchio(arm, URDF, "probe"))


@each
def test_plain_laws_are_the_compiled_ones(arm):
    (q, qd), room, Jdot = next(states(arm, 1)), room_for(arm.joints), np.zeros((6, arm.joints))
    tip = chain_model(arm.chain, q, qd, room)
    jacobian_rate(qd, room, tip, Jdot)
    # Compiled, a product and a sum may be one rounding instead of two.
    assert pytest.approx(arm.mass_matrix(q), rel=1e-13, abs=1e-14) == room.M
    assert room.h == pytest.approx(arm.bias_torque(q, qd), rel=1e-13, abs=1e-13)
    assert Jdot == pytest.approx(arm.jacobian_dot(q, qd), rel=1e-13, abs=1e-14)
    assert [*tip.a, *tip.dw] == pytest.approx(arm.jacobian_dot_qd(q, qd), rel=1e-13, abs=1e-14)


@each
def test_its_rate_is_that_of_the_jacobian(arm):
    (q, qd), step = next(states(arm, 1, seed=4)), 1e-6
    measured = (arm.jacobian(q + step * qd) - arm.jacobian(q - step * qd)) / (2 * step)
    assert arm.jacobian_dot(q, qd) == pytest.approx(measured, abs=1e-8)
    assert arm.jacobian_dot(q, qd) @ qd == pytest.approx(arm.jacobian_dot_qd(q, qd), abs=1e-12)


@each
def test_dynamics_forward_and_back(arm):
    q, qd = next(states(arm, 1, seed=5))
    torque, wrench = np.linspace(-3.0, 4.0, arm.joints), np.arange(1.0, 7.0)
    qdd = arm.forward_dynamics(q, qd, torque, wrench)
    assert arm.inverse_dynamics(q, qd, qdd, wrench) == pytest.approx(torque, abs=1e-9)


@each
def test_energy_only_changes_by_the_power_of_the_torques(arm):
    """Of kinetic and potential energy, without knowing the latter: dT/dt = qd^T (tau - g)."""
    (q, qd), torque = next(states(arm, 1, seed=6)), np.linspace(1.0, 2.0, arm.joints)
    qdd, step = arm.forward_dynamics(q, qd, torque), 1e-6

    def kinetic(sign):
        later, rate = q + sign * step * qd + 0.5 * step**2 * qdd, qd + sign * step * qdd
        return 0.5 * rate @ arm.mass_matrix(later) @ rate

    power = qd @ (torque - arm.gravity_torque(q))
    assert (kinetic(1) - kinetic(-1)) / (2 * step) == pytest.approx(power, rel=1e-5)


@pytest.mark.parametrize("name", NAMES)
def test_inverse_kinematics_comes_back(name):
    arm, g = ARMS[name], np.random.default_rng(7)
    for _ in range(3):
        q = arm.lower + (arm.upper - arm.lower) * g.uniform(0.2, 0.8, arm.joints)
        found = arm.inverse_kinematics(arm.forward_kinematics(q))
        assert arm.forward_kinematics(found) == pytest.approx(arm.forward_kinematics(q), abs=2e-9)
        assert (found >= arm.lower).all()
        assert (found <= arm.upper).all()


@pytest.mark.parametrize("name", NAMES)
def test_from_near_the_goal_it_stays_near(name):
    arm = ARMS[name]
    q = arm.home + 0.05
    assert arm.inverse_kinematics(arm.forward_kinematics(q), near=arm.home) == pytest.approx(q, abs=0.2)


def test_out_of_reach_says_by_how_much():
    arm = ARMS["ur5e"]
    goal = arm.forward_kinematics(arm.home)
    goal[0, 3] = 3.0
    with pytest.raises(InputError, match=r"out of reach of Universal Robots UR5e by \d\S* mm"):
        arm.inverse_kinematics(goal)


@pytest.mark.parametrize(
    ("pose", "what"),
    [
        (np.eye(3), r"shape \(4, 4\)"),
        (np.full((4, 4), np.nan), "finite"),
        (2.0 * np.eye(4), "orthonormal"),
        (np.diag([1.0, 1.0, -1.0, 1.0]), "right-handed"),
    ],
)
def test_what_is_no_pose(pose, what):
    with pytest.raises(InputError, match=what):
        ARMS["ur5e"].inverse_kinematics(pose)


def test_a_singular_pose_has_a_singular_value_of_zero():
    stretched = np.array([0.0, -1.2, 0.0, 0.3, 0.4, 0.0])
    assert ARMS["ur5e"].singular_values(stretched)[-1] < 1e-12
    assert ARMS["ur5e"].singular_values(ARMS["ur5e"].home)[-1] > 0.05


@pytest.mark.parametrize(
    ("call", "what"),
    [
        (
            lambda arm: arm.forward_kinematics([0.0, 1.0]),
            "q of Universal Robots UR5e must be 6 finite numbers",
        ),
        (lambda arm: arm.jacobian([np.nan] * 6), "must be finite"),
        (lambda arm: arm.bias_torque(arm.home, np.zeros((2, 6))), r"qd of .* got shape \(2, 6\)"),
        (lambda arm: arm.inverse_dynamics(*[arm.home] * 3, tip_wrench=[1.0]), "tip_wrench must have shape"),
        (lambda arm: SerialArm.named("ur5"), "did you mean 'ur5e'"),
    ],
)
def test_what_is_no_state(call, what):
    with pytest.raises(InputError, match=what):
        call(ARMS["ur5e"])
