"""Schemes that learn a surface implicitly: each law against an independent computation, and as parts of the bench."""

import numpy as np
import pytest

from palpate._vector import ZERO3, Vec3
from palpate.controllers.hybrid import hybrid
from palpate.controllers.resolved_acceleration import position_command
from palpate_checks.controllers import IN_PLAIN, a_moment, it_runs_in_the_loop
from palpate_thesis.implicit_schemes import (
    FuzzyCompensation,
    feedback_error_learning,
    impedance_search,
    one_loop,
    rule,
)

SCHEMES = [FuzzyCompensation(), feedback_error_learning(), impedance_search(0.48)]
by_kind = pytest.mark.parametrize("scheme", SCHEMES, ids=lambda one: type(one).__name__)


def fuzzy(error, rate):
    """Degrees of seven triangular labels, 49 rules by the product, and the centroid of their singletons."""
    labels = np.arange(-3, 4)
    degree = [np.maximum(0.0, 1.0 - abs(np.clip(3.0 * x, -3, 3) - labels)) for x in (error, rate)]
    output = np.clip(labels[:, None] + labels, -3, 3) / 3.0
    weight = np.outer(*degree)
    return (weight * output).sum() / weight.sum()


def test_the_rule_is_the_centroid_of_49_rules():
    for error, rate in np.random.default_rng(0).uniform(-1.3, 1.3, (200, 2)):
        assert rule(error, rate) == pytest.approx(fuzzy(error, rate), abs=1e-14)


def test_near_the_desired_force_the_rules_are_an_integral():
    """A third of the first label apart, output = error/10 N + rate/100 N/s: 5 per second of the error, times 50 N/s."""
    assert rule(0.1, -0.05) == pytest.approx(0.05, abs=1e-15)


def test_a_step_of_learning_takes_the_feedbacks_torque_for_the_error():
    """The network by itself, told the hybrid law's torque without what is fed forward, moves its outputs as much."""
    scheme, (sense, task, model) = feedback_error_learning(), a_moment()
    first, state = scheme.step(scheme.start(), sense, task, model)
    after, _ = scheme.step(state, sense, task, model)
    u_x = position_command(scheme.kp, scheme.kv, sense.x, sense.xd, task.x, task.xd, task.xdd)
    laws = [
        hybrid(model.J, model.Jdqd, model.M, model.h, task.s, *them)
        for them in ((u_x, task.f, scheme.kf * (task.f - sense.f)), (ZERO3, task.f, ZERO3))
    ]
    net, memory = scheme.network, scheme.network.start()
    memory.signals[:4] = 1.0, *sense.q
    before = [net.forward(memory)] + [net.output(memory, k) for k in range(3)]
    for k, error in enumerate(laws[0] - laws[1]):
        net.want(memory, k, error)
    net.learn(memory)
    net.forward(memory)
    changes = [net.output(memory, k) - before[1 + k] for k in range(3)]
    assert list(after - first) == pytest.approx(changes, rel=1e-9)


def test_the_search_finds_the_impedance_of_each_desired_force():
    """Of two springs in series, f = d k K/(k + K): each context learns the k of its force, told only errors."""
    scheme = impedance_search(0.0138)._replace(period=3e-3, after=1e-3)
    surface, depth, state = 5200.0, 0.0138, scheme.start()
    _, task, model = a_moment()
    sense, _, _ = a_moment()
    for trial in range(1600):
        desired = 20.0 if trial % 2 else 10.0
        for _ in range(3):
            k = 2000.0 * np.exp(state.stiffness @ scheme.context(desired) + state.tried.x)
            f = Vec3(depth * k * surface / (k + surface), 0.0, 0.0)
            _, state = scheme.step(
                state, sense._replace(f=f), task._replace(f=Vec3(desired, 0.0, 0.0)), model
            )
    for desired in (10.0, 20.0):
        k = 2000.0 * np.exp(state.stiffness @ scheme.context(desired))
        assert depth * k * surface / (k + surface) == pytest.approx(desired, rel=0.05)
    assert state.expected @ scheme.context(10.0) < 0.3


@by_kind
def test_each_is_a_part(scheme):
    for law in IN_PLAIN:
        law(one_loop(scheme))
    assert one_loop(scheme).start()[0 if scheme is SCHEMES[0] else 1] is not None
    assert scheme.rest(scheme.start(), a_moment()[0]) is not None
    assert (
        one_loop(scheme).step(one_loop(scheme).start(), *a_moment())[0]
        == scheme.step(scheme.start(), *a_moment())[0]
    )
    assert scheme.report(scheme.start())[0] == ZERO3


@pytest.mark.long
@by_kind
def test_each_runs_in_the_loop(scheme):
    it_runs_in_the_loop(one_loop(scheme))
