"""The neural controller: one tick against matrices, and in the loop."""

import msgspec
import numpy as np
import pytest

from palpate._vector import ZERO3, Mat3, Vec3
from palpate.bench import build, load
from palpate.controllers import Hybrid, Neural
from palpate.errors import InputError
from palpate.networks import Perceptron, layers_of, network, random_layers
from palpate.robots.arm3 import Arm3
from palpate.signals.types import Sense, Task, alike

ALONG_X = Vec3(1.0, 0.0, 0.0)
replaced = msgspec.structs.replace


@pytest.fixture(scope="module")
def quick():
    """In contact after a fifth of a second: the wall is near, and rubber pushes back at once."""
    e = load("rubber-neural")
    approach = replaced(e.approach, hold=0.02, first=0.457, period=0.1)
    return replaced(e, wall=replaced(e.wall, x=0.4545), approach=approach, run=replaced(e.run, steps=4))


def situation(y=0.002):
    arm = Arm3(limits=Vec3(16.0, 2.5, 0.6), rotor=ZERO3)
    x = Vec3(0.467, y, -0.01)
    q = arm.inverse(x, 1.0)
    qd = Vec3(0.01, -0.02, 0.03)
    sense = Sense(q, qd, x, Vec3(0.001, 0.0, 0.02), Vec3(14.0, 0.0, 0.0))
    task = Task(Vec3(0.466, 0.0, 0.0), ZERO3, ZERO3, Vec3(20.0, 0.0, 0.0), ALONG_X)
    return sense, task, arm.model(q, qd)


def array(v):
    return np.array([array(r) for r in v]) if isinstance(v, Mat3) else np.array(tuple(v))


def test_one_tick_against_hybrid_control_and_a_perceptron():
    """Its two halves, each tested on its own, put together by hand: inputs, J^T, errors."""
    sense, task, model = situation()
    before = Vec3(0.4669, 0.0019, -0.0101)
    neural = Neural.thesis(1e-3)
    state = neural.start()._replace(x=before)
    torque, after = neural.step(state, sense, task, model)

    hybrid = Hybrid(alike(400.0), alike(80.0), alike(0.25), ZERO3)
    own, _ = hybrid.step(hybrid.start(), sense, task, model)
    net = Perceptron.thesis(1e-3)
    offset = np.array([0.0, 0.01, 0.01])
    command = net.forward(np.concatenate([array(sense.x) + offset, array(before) + offset, array(own)]))
    np.testing.assert_allclose(array(torque), array(own) + array(model.J).T @ command, rtol=1e-13)
    np.testing.assert_allclose(array(after.command), command, rtol=1e-13)

    net.learn([20.0 - 14.0, 0.0 - 0.002, 0.0 + 0.01])
    for learned, expected in zip(
        layers_of(neural.network.sizes, after.network.weights), net.layers, strict=True
    ):
        np.testing.assert_allclose(learned, expected, rtol=1e-12, atol=1e-16)
    assert after.x == sense.x


def test_without_contact_it_neither_learns_nor_forgets():
    sense, task, model = situation()
    neural = Neural.thesis(1e-2)
    state = neural.start()
    _, state = neural.step(state, sense, task, model)
    learned = state.network.weights.copy()
    away = sense._replace(x=Vec3(0.45, 0.0, 0.0))
    rested = neural.rest(state, away)
    np.testing.assert_array_equal(rested.network.weights, learned)
    assert rested.x == away.x
    assert rested.command == ZERO3
    assert not np.array_equal(learned, neural.network.weights)


def test_at_the_start_it_is_an_integrator():
    """Integral gain eta (A/2)^2 per sample: 5 per second at 5e-5 and 1 kHz."""
    sense, task, model = situation()
    neural = Neural.thesis(5e-5)
    _, state = neural.step(neural.start(), sense, task, model)
    command, (_, _, gain) = neural.report(state)
    assert gain == pytest.approx(5e-5 * 10.0**2, rel=0.01)
    _, second = neural.step(state, sense, task, model)
    step = second.command.x - command.x
    assert step == pytest.approx(gain * (20.0 - 14.0), rel=0.01)


def test_a_network_that_does_not_fit_is_refused():
    with pytest.raises(InputError, match="9 inputs"):
        Neural(*Neural.thesis()[:-1], network(random_layers((8, 12, 3), 0, 0.1), 1.0, 0.1))


def test_a_saturated_network_says_so():
    sense, task, model = situation()
    neural = Neural.thesis(5e-5)
    _, state = neural.step(neural.start(), sense, task, model)
    assert neural.trouble(state) == ""
    layers_of(neural.network.sizes, state.network.weights)[-1][0, 0] = 30.0
    _, state = neural.step(state, sense, task, model)
    assert "saturated at 20 N" in neural.trouble(state)


def test_a_rate_that_ends_in_no_numbers_ends_the_run_there(quick):
    wild = replaced(quick, controller=replaced(quick.controller, learning_rate=1e300))
    record = build(wild).run(1.0, seed=1)
    assert record.meta["end"] == "diverged"
    assert "not a finite number" in record.meta["why"]
    assert 0 < len(record) < 1000
    assert all(np.isfinite(column).all() for column in record.columns.values())


def test_a_rate_too_large_ends_the_run_and_says_why(quick):
    fast = replaced(quick, controller=replaced(quick.controller, learning_rate=0.1))
    record = build(fast).run(20.0, seed=1)
    assert record.meta["end"] == "diverged"
    assert "no longer learns; lower the learning rate, 0.1" in record.meta["why"]
    watched = build(replaced(fast, run=replaced(fast.run, losses=0))).run(5.0, seed=1)
    assert watched.meta["end"] == "done"


def test_left_to_learn_on_foam_that_relaxes_it_loses_the_contact():
    """Measured: after 30.3 s of contact at 5e-5, after 18 to 20 s at twice that; its hidden weights have grown."""
    e = load("foam-neural-minutes")
    when = {}
    for rate in (5e-5, 1e-4):
        record = build(replaced(e, controller=replaced(e.controller, learning_rate=rate))).run(60.0, seed=2)
        assert record.meta["end"] == "lost contact"
        pressing = record["phase"] == 1.0
        when[rate] = float(pressing.sum()) * 1e-3
        assert record["adapted1"][pressing][-1] > 5.0 * record["adapted1"][pressing][0]
    assert 10.0 < when[1e-4] < when[5e-5] < 60.0
