"""Schemes that the thesis names and does not run: each against a derivation of its own."""

import numpy as np
import pytest

from palpate._vector import Vec3
from palpate.errors import InputError
from palpate.identifiers import RecursiveLeastSquares
from palpate.networks import network, random_layers
from palpate_checks import identifier_checks
from palpate_thesis.explanations import e7_continuous_least_squares as e7
from palpate_thesis.explanations import e8_contact_network as e8
from palpate_thesis.explanations import e9_model_tunes as e9
from palpate_thesis.explanations.e7_continuous_least_squares import ContinuousLeastSquares
from palpate_thesis.force_control.architectures import SIZES, radial_basis, recurrent

START, PRIOR = (0.0, 0.0, 2e4), np.diag([1.0, 1e4, 1e8])


def shaken(tick, seconds=0.5):
    """Acceleration, rate and depth of two tones, and the force of a foam with a cubic spring in it."""
    t = np.arange(round(seconds / tick) + 1)[:, None] * tick
    w, size = 2 * np.pi * np.array([2.0, 11.0]), np.array([1e-3, 1e-4])
    a, v, x = (
        -(size * w**2 * np.sin(w * t)).sum(1),
        (size * w * np.cos(w * t)).sum(1),
        (size * np.sin(w * t)).sum(1),
    )
    return np.column_stack([a, v, x + 3e-3]), 0.1 * a + 200.0 * v + 5200.0 * x + 1e8 * x**3


def continuous(tick):
    identifier = ContinuousLeastSquares(START, PRIOR, tick)
    identifier.update_many(*shaken(tick, 0.42))
    return identifier


@pytest.mark.parametrize("check", identifier_checks(ContinuousLeastSquares), ids=str)
def test_it_is_an_identifier_as_the_others(check):
    check()


@pytest.mark.parametrize("rate", [0.0, 3.0])
def test_it_solves_its_differential_equations(rate):
    """theta' = P phi e, P' = rate P - P phi (P phi)^T, by an integrator of variable step; phi in closed form."""
    from scipy.integrate import solve_ivp

    def flow(t, state):
        phi, f = (
            np.array([np.interp(t, grid, column) for column in signals.T]) for signals in (samples[0], force)
        )
        P = state[3:].reshape(3, 3)
        g = P @ phi
        return np.concatenate([g * (f[0] - phi @ state[:3]), (rate * P - np.outer(g, g)).ravel()])

    tick = 5e-3
    samples, force = shaken(tick, 0.05), shaken(tick, 0.05)[1][:, None]
    grid = tick * np.arange(len(force))
    start = np.concatenate([START, PRIOR.ravel()])
    solved = solve_ivp(flow, (0.0, grid[-1]), start, "LSODA", rtol=1e-9, atol=1e-9, max_step=tick / 4).y[
        :, -1
    ]
    identifier = ContinuousLeastSquares(START, PRIOR, tick, rate)
    identifier.update_many(*samples)
    exact = 1e-6 if rate == 0.0 else 1e-2  # what is forgotten within a tick is forgotten at its nodes
    assert identifier.theta == pytest.approx(solved[:3], rel=exact)
    assert identifier.covariance.ravel() == pytest.approx(solved[3:], rel=exact, abs=1e-6)


def test_it_is_the_limit_of_the_recursion():
    """Rectangles of a tenth of the width have a tenth of the error."""

    def apart(tick):
        recursive = RecursiveLeastSquares(START, tick * PRIOR)
        recursive.update_many(*shaken(tick, 0.42))
        return np.abs(recursive.theta - continuous(1e-4).theta)

    assert (apart(1e-4) < 0.2 * apart(1e-3)).all()


def test_explicit_steps_diverge_from_a_covariance_that_the_closed_form_bears():
    phi, _ = shaken(1e-3)
    force = phi @ np.array([0.1, 200.0, 5200.0])
    theta = e7.by_euler(phi, force, (1.0, 1e4, 1e8))[:, 2]
    assert np.isnan(theta[-1])
    assert np.isfinite(theta[0])
    assert e7.continuous(phi, force)[-1, 2] == pytest.approx(5200.0, rel=0.05)


def test_a_tick_that_is_none_is_refused():
    with pytest.raises(InputError, match="tick must be above 0"):
        ContinuousLeastSquares(START, PRIOR, 0.0)


INPUTS = np.array([0.468, 0.01, 0.012, 0.468, 0.01, 0.012, 0.5, 1.4, 0.02])
AMPLITUDE = np.array([20.0, 10.0, 1.0])


def started(architecture, seed=3):
    """A network with weights that matter, and signals of a tick before."""
    net = architecture(AMPLITUDE, 1e-3, seed)
    state = net.start()
    random = np.random.default_rng(seed)
    state.weights[:] = random.uniform(-1.0, 1.0, len(state.weights))
    state.signals[:] = random.uniform(-0.5, 0.5, len(state.signals))
    state.signals[: SIZES[0]] = INPUTS
    return net, state


def outputs(net, state, before):
    """The outputs from these weights and the signals of before."""
    state.signals[:] = before
    net.forward(state)
    return np.array([net.output(state, k) for k in range(3)])


@pytest.mark.parametrize("architecture", [radial_basis, recurrent], ids=["radial basis", "recurrent"])
def test_an_architecture_learns_down_the_gradient_of_its_squared_error(architecture):
    """Each weight by central differences of E = sum(error^2)/2; and its gain is the first-order effect of a step."""
    net, state = started(architecture)
    before, weights = state.signals.copy(), state.weights.copy()
    wanted = np.array([12.0, -3.0, 0.4])
    error = wanted - outputs(net, state, before)
    for k in range(3):
        net.want(state, k, error[k])
    net.learn(state)
    step, gradient = state.weights - weights, np.empty(len(weights))
    for i in range(len(weights)):
        sides = []
        for h in (1e-6, -1e-6):
            state.weights[:] = weights
            state.weights[i] += h
            sides.append(0.5 * np.sum((wanted - outputs(net, state, before)) ** 2))
        gradient[i] = (sides[0] - sides[1]) / 2e-6
    assert step == pytest.approx(-1e-3 * gradient, rel=1e-4, abs=1e-9)


@pytest.mark.parametrize("architecture", [radial_basis, recurrent], ids=["radial basis", "recurrent"])
def test_its_gain_is_the_effect_of_a_step_of_learning(architecture):
    net, state = started(architecture)
    before = state.signals.copy()
    first = outputs(net, state, before)[0]
    gain = net.gain(state, 0)
    state.signals[:] = before
    net.forward(state)
    for k in range(3):
        net.want(state, k, 1e-3 if k == 0 else 0.0)
    net.learn(state)
    assert outputs(net, state, before)[0] - first == pytest.approx(1e-3 * gain, rel=1e-2)


def test_radial_neurons_have_the_gain_of_thresholds_and_recurrent_ones_a_memory():
    net, state = started(radial_basis)
    state.weights[:] = 0.0
    net.forward(state)
    assert net.gain(state, 0) == pytest.approx(1e-3 * (AMPLITUDE[0] / 2) ** 2)
    net, state = started(recurrent)
    first = outputs(net, state, state.signals.copy())
    net.forward(state)
    again = np.array([net.output(state, k) for k in range(3)])
    assert np.abs(again - first).max() > 1e-3  # the same inputs, other signals before


def test_contact_is_learned_from_the_inputs_that_the_controller_sees():
    """The lesson's running means are the kernel's, tick by tick; and touched is told from not touched."""
    part = e8.constant(0.02, 1)
    record = e8.approach(e8.SURFACES["foam"], part, 1)
    state, means = part.start(), []
    force, depth = record["force_measured"][:400], record["penetration"][:400]
    for f, x in zip(force, depth, strict=True):
        _, state = part.step(state, e8.SWITCH, f, x)
        means.append((state.short, state.long))
    from scipy.signal import lfilter

    for n, mean in zip((4.0, 16.0), np.transpose(means), strict=True):
        assert mean == pytest.approx(lfilter([1.0 / n], [1.0, 1.0 / n - 1.0], force), abs=1e-9)
    inputs, near, contact = e8.lesson(np.random.default_rng(0), e8.SURFACES["foam"], 1)
    assert set(near) == set(contact) == {-0.95, 0.95}
    assert (near >= contact).all()
    assert inputs[contact > 0, 0].mean() > inputs[contact < 0, 0].mean() + 0.2


def test_an_approach_at_constant_speed_takes_the_way_over_the_speed():
    one = e8.arrival(e8.approach(e8.SURFACES["rubber"], e8.constant(0.03, 0), 0))
    assert one.time == pytest.approx(e8.GAP / 0.03, rel=0.1)
    assert not one.early
    assert one.most >= one.felt > 480.0 * 0.03  # the damper answers first


def test_the_models_slopes_are_those_of_its_force():
    """The kernel's derivatives against differences of the network's output, line included."""
    random = np.random.default_rng(5)
    net = network(random_layers(e9.SIZES, random, 1.0), 40.0, 1e-4)
    at, by = Vec3(0.47, 0.0, 0.0), Vec3(1e-3, 0.02, 0.0)
    part = e9.ModelTuned(36.0, Vec3(3000.0, 50.0, 0.0), at, by, 0.0, net)
    memory = part.start().network

    def force(x, v):
        part.slopes(memory, x, v)
        memory.signals[:2] = (x - at.x) / by.x, (v - at.y) / by.y
        net.forward(memory)
        return net.output(memory, 0) + 3000.0 * x + 50.0 * v

    K, B = part.slopes(memory, 0.4705, 0.01)
    assert (force(0.470501, 0.01) - force(0.470499, 0.01)) / 2e-6 == pytest.approx(K, rel=1e-5)
    assert (force(0.4705, 0.01001) - force(0.4705, 0.00999)) / 2e-5 == pytest.approx(B, rel=1e-5)
