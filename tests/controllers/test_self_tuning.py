"""A network tunes a PID: within its bounds, down the gradient, and not from noise."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from controllers.ideal_arm import ARM, START, task
from palpate._vector import ZERO3, Vec3
from palpate.controllers.self_tuning import SelfTuning, gradient
from palpate.networks import network, random_layers
from palpate.signals.types import Sense

TICK, MIDDLE = 0.001, (0.25, 5.0, 0.004)
GAINS = Vec3(400.0, 400.0, 400.0), Vec3(80.0, 80.0, 80.0)
Q = ARM.inverse(START, 1.0)
MODEL = ARM.model(Q, ZERO3)


def tuner(layers, rate=1e-3, dead_zone=0.0):
    net = network(list(layers), MIDDLE, rate)
    return SelfTuning(*GAINS, Vec3(*MIDDLE), Vec3(10.0, 5.0, 100.0), dead_zone, 0.01, TICK, net)


def feel(controller, forces, state=None):
    """The force commands [N] and the states of ticks at which these forces are measured."""
    state = controller.start() if state is None else state
    commands, states = [], []
    for f in forces:
        sense = Sense(Q, ZERO3, ARM.pose(Q), ZERO3, Vec3(f, 0.0, 0.0))
        torque, state = controller.step(state, sense, task(20.0), MODEL)
        commands.append(torque.y / MODEL.J.r1.y - 20.0)  # J^T (20 + u_f) in x alone
        states.append(state)
    return np.array(commands), states


def test_a_network_of_zeros_leaves_a_plain_pid():
    zeros = [np.zeros((4, 4)), np.zeros((3, 5))]
    forces = np.array([5.0, 6.0, 8.0, 8.0])
    commands, _ = feel(tuner(zeros, rate=1e-12), forces)
    error, rate, integral = 20.0 - forces, 0.0, 0.0
    before, expected = 0.0, []
    for f, e in zip(forces, error, strict=True):
        integral += TICK * 5.0 * e
        rate += (f - before - TICK * rate) / 0.01
        before = f
        expected.append(0.25 * e + integral - 0.004 * rate)
    assert commands == pytest.approx(expected, rel=1e-6)


@given(st.lists(st.floats(-200.0, 200.0), min_size=1, max_size=40), st.floats(1e-6, 10.0))
def test_the_gains_stay_between_nothing_and_twice_their_middle(forces, rate):
    _, states = feel(tuner(random_layers((3, 6, 3), 0, 1.0), rate), forces)
    gains = np.array([s.gains for s in states])
    assert (gains >= 0.0).all()
    assert (gains <= 2.0 * np.array(MIDDLE)).all()


def closed(kf, ki, kd, ticks):
    """Force errors when the force answers the command at once, less a friction of 5 N, and the gains are constant."""
    zeros = [np.zeros((4, 4)), np.zeros((3, 5))]
    controller = SelfTuning(
        *GAINS,
        Vec3(kf, ki, kd),
        Vec3(10.0, 5.0, 100.0),
        0.0,
        0.01,
        TICK,
        network(zeros, (kf, ki, kd), 1e-300),
    )
    state, integral, rate, f, errors = controller.start(), 0.0, 0.0, 0.0, []
    for _ in range(ticks):
        # f = 20 + kf (20 - f) + integral - kd rate - 5, solved for f: the command that the controller will give
        before = integral - kd * (rate - (f + TICK * rate) / 0.01) - 5.0
        f_before, f = f, (20.0 + 20.0 * kf + TICK * ki * 20.0 + before) / (1.0 + kf + TICK * ki + kd / 0.01)
        rate += (f - f_before - TICK * rate) / 0.01
        integral += TICK * ki * (20.0 - f)
        (command,), states = feel(controller, [f], state)
        state = states[-1]
        assert command == pytest.approx(f - 15.0, abs=1e-9)
        errors.append(20.0 - f)
    return np.array(errors), state


@pytest.mark.parametrize("ticks", [20, 200, 600])
def test_it_knows_what_the_force_owes_to_the_integral_gain(ticks):
    """Against finite differences of the whole closed loop."""
    kf, ki, h = 0.25, 5.0, 1e-5
    _, state = closed(kf, ki, 1e-9, ticks)
    more, less = closed(kf, ki + h, 1e-9, ticks)[0], closed(kf, ki - h, 1e-9, ticks)[0]
    assert state.by_ki.x == pytest.approx(-(more[-1] - less[-1]) / (2 * h), rel=0.02)


def test_it_knows_what_the_force_owes_to_the_proportional_gain():
    kf, ki, h, ticks = 0.25, 5.0, 1e-5, 300
    errors, _ = closed(kf, ki, 1e-9, ticks)
    _, before = closed(kf, ki, 1e-9, ticks - 1)
    more, less = closed(kf + h, ki, 1e-9, ticks)[0], closed(kf - h, ki, 1e-9, ticks)[0]
    by_kf = gradient(errors[-1], before.by_ki.x, kf, ki)
    assert by_kf == pytest.approx(-(more[-1] - less[-1]) / (2 * h), rel=0.02)


def test_learning_goes_down_the_gradient_of_the_squared_error():
    """dE/dw = -e sum(df/dgain dgain/dw). dgain/dw by finite differences, for every weight."""
    rate, h, force = 1e-9, 1e-6, 7.0
    controller = tuner(random_layers((3, 4, 3), 1, 0.5), rate)
    _, states = feel(controller, [5.0])
    state = states[-1]
    before = state.network.weights.copy()
    _, after = feel(controller, [force], state)
    change = (after[-1].network.weights - before) / rate
    e, (kf, ki, _) = 20.0 - force, after[-1].gains
    by_kf, by_kd = gradient(e, state.by_ki.x, kf, ki), gradient(-after[-1].rate.x, state.by_kd.x, kf, ki)
    debts = np.array([by_kf, after[-1].by_ki.x, by_kd])

    def gains(weights):
        state.network.weights[:] = weights
        return np.array(feel(controller, [force], state)[1][0].gains)

    for step in h * np.eye(before.size):
        slope = (gains(before + step) - gains(before - step)) / (2 * h)
        assert change @ step / h == pytest.approx(e * (debts @ slope), rel=1e-4, abs=1e-6)


def test_it_does_not_learn_from_an_error_inside_the_dead_zone():
    controller = tuner(random_layers((3, 6, 3), 0, 0.3), dead_zone=1.0)
    _, states = feel(controller, [19.2, 20.7, 20.0])
    assert np.array_equal(states[-1].network.weights, controller.network.weights)
    _, states = feel(controller, [18.5])
    assert not np.array_equal(states[-1].network.weights, controller.network.weights)


def test_what_was_learned_outlives_a_lost_contact():
    controller = tuner(random_layers((3, 6, 3), 0, 0.3))
    _, states = feel(controller, [5.0] * 50)
    learned = states[-1].network.weights.copy()
    rested = controller.rest(states[-1], Sense(Q, ZERO3, ARM.pose(Q), ZERO3, Vec3(-0.3, 0.0, 0.0)))
    assert np.array_equal(rested.network.weights, learned)
    assert rested.integral == ZERO3
    assert rested.f == Vec3(-0.3, 0.0, 0.0)
