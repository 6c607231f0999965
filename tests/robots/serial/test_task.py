"""An arm told in its task's axes: six directions served by the controllers that were written for three."""

import numpy as np
import pytest

from palpate._jit import kernel
from palpate._vector import Mat3, Vec3, Vec6
from palpate.controllers import (
    DecoupledHybrid,
    Hybrid,
    Impedance,
    ProportionalIntegral,
    ResolvedAcceleration,
)
from palpate.press.tip_controller import task_room_for
from palpate.robots import SerialArm
from palpate.robots.serial.chain import chain_model, room_for
from palpate.robots.serial.task import joint_torque, task_model
from palpate.signals.types import Sense, Task


def six(value):
    return Vec6(Vec3(value, value, value), Vec3(value, value, value))


#: The makers of test_laws_in_three_settings, for six directions.
MAKERS = {
    "hybrid": Hybrid(six(400.0), six(80.0), six(1.0), six(0.003)),
    "resolved acceleration": ResolvedAcceleration(six(400.0), six(80.0)),
    "proportional-integral": ProportionalIntegral(six(400.0), six(80.0), six(0.25), six(5.0), 0.001),
    "decoupled": DecoupledHybrid.corrected(six(400.0), six(80.0), six(3000.0), six(110.0), 5200.0),
    "impedance": Impedance(six(5.0), six(600.0), six(2000.0), six(0.47)),
}
DAMPING = 3.0


def walk(chain, axes, controller, sense, task, q, qd, room, own, torques):
    """Some ticks under the same senses: the joints' torque at each, the wrench after it."""
    tip = chain_model(chain, q, qd, room)
    state = controller.start()
    for k in range(len(torques)):
        model = task_model(axes, room, tip, own)
        F, state = controller.step(state, sense, task, model)
        joint_torque(axes, room, model, own, F, DAMPING, qd, torques[k])


compiled_walk = kernel(walk)
compiled_arm_alone = kernel(chain_model)


def pair(values):
    return Vec6(Vec3(*map(float, values[:3])), Vec3(*map(float, values[3:])))


def inputs(arm, seed=0):
    g = np.random.default_rng(seed)
    axes = np.linalg.qr(g.normal(size=(3, 3)))[0]
    axes[0] *= np.linalg.det(axes)
    s = np.array([1.0, 0, 0, 0, 0, 0])
    sense = [g.normal(size=6) for _ in range(3)]
    task = [*(g.normal(size=6) for _ in range(3)), s * 20.0, s]
    return axes, sense, task, arm.home + 0.3, 0.5 * g.normal(size=arm.joints)


def by_value(arm, axes, sense, task, q, qd):
    rows = Mat3(*(Vec3(*map(float, row)) for row in axes))
    senses = Sense(q, qd, *map(pair, sense))
    return rows, senses, Task(*map(pair, task))


def room(arm, ticks=3):
    n = arm.joints
    return room_for(n), task_room_for(n), np.zeros((ticks, n))


def told(arm, axes, q, qd):
    """J, Jdot qd, M, h in the task's axes, as arrays."""
    turn = np.kron(np.eye(2), axes)
    return (
        turn @ arm.jacobian(q),
        turn @ arm.jacobian_dot_qd(q, qd),
        arm.mass_matrix(q),
        arm.bias_torque(q, qd),
    )


@pytest.mark.long  # seconds to compile, each; short is the same of three directions
@pytest.mark.parametrize("name", ["hybrid", "decoupled"])  # all others have their laws
@pytest.mark.parametrize("arm", ["ur5e", "panda"])
def test_plain_and_compiled_are_the_same(name, arm):
    arm = SerialArm.named(arm)
    given = inputs(arm)
    axes, sense, task = by_value(arm, *given)
    *_, q, qd = given
    results = []
    for run in (walk, compiled_walk):
        *rooms, torques = room(arm)
        run(arm.chain, axes, MAKERS[name], sense, task, q, qd, *rooms, torques)
        results.append(torques)
    # Compiled, sums of products round once instead of twice.
    assert results[0] == pytest.approx(results[1], rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("arm", ["ur5e", "panda", "fr3", "iiwa14"])
@pytest.mark.parametrize("name", ["resolved acceleration", "decoupled", "impedance"])
def test_the_tip_accelerates_as_it_was_told(name, arm):
    """These compensate all of the dynamics; the arm's own accelerations come from the joints, by arrays."""
    arm = SerialArm.named(arm)
    given = inputs(arm, 2)
    axes, sense, task, q, qd = given
    by = by_value(arm, *given)
    *rooms, torques = room(arm, 1)
    walk(arm.chain, by[0], MAKERS[name], *by[1:], q, qd, *rooms, torques)
    J, Jdqd, M, h = told(arm, axes, q, qd)
    outside = 0.0 * sense[2] if name == "resolved acceleration" else sense[2]
    xdd = J @ np.linalg.solve(M, torques[0] - h - J.T @ outside) + Jdqd
    x, xd, f = sense
    wanted = task[2] + 80.0 * (task[1] - xd) + 400.0 * (task[0] - x)
    if name == "impedance":
        towards = (1.0 - task[4]) * task[0] + task[4] * 0.47
        wanted = task[2] + (600.0 * (task[1] - xd) + 2000.0 * (towards - x) - f) / 5.0
    if name == "decoupled":
        pressed = 3000.0 / 5200.0 * (task[3] - f) + 110.0 * (task[1] - xd)
        wanted = (1.0 - task[4]) * wanted + task[4] * pressed
    assert xdd == pytest.approx(wanted, rel=1e-8, abs=1e-7)


@pytest.mark.long
def test_one_compiled_version_serves_every_arm():
    for name in ("ur5e", "panda"):
        arm = SerialArm.named(name)
        given = inputs(arm)
        compiled_arm_alone(arm.chain, given[3], given[4], room_for(arm.joints))
    assert len(compiled_arm_alone.compiled.signatures) == 1


def test_joints_to_spare_slow_down_and_the_tip_does_not_notice():
    arm = SerialArm.named("panda")
    axes, sense, task, q, _ = inputs(arm, 3)
    J = arm.jacobian(q)
    spare = np.linalg.svd(J)[2][-1]  # moves the joints and not the tip
    by = by_value(arm, axes, sense, task, q, spare)
    *rooms, torques = room(arm, 1)
    walk(arm.chain, by[0], MAKERS["resolved acceleration"], *by[1:], q, spare, *rooms, torques)
    qdd = np.linalg.solve(arm.mass_matrix(q), torques[0] - arm.bias_torque(q, spare))
    M = arm.mass_matrix(q)
    # Along the spare direction kinetic energy falls at the rate of the damping.
    assert spare @ M @ qdd == pytest.approx(-DAMPING * spare @ M @ spare, rel=1e-6)
