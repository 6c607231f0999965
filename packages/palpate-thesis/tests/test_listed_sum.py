"""The identifier with the listing's output sum, against its formulas written out with NumPy."""

import numpy as np
import pytest

from palpate.identifiers.neural_probe import SETTINGS
from palpate_thesis.neural_identifier.listed_sum import ListedSumProbe

RATE, AMPLITUDE = 1e-4, 30.0


def sigmoid(u):
    return 2.0 / (1.0 + np.exp(-u)) - 1.0


@pytest.fixture
def press():
    """Displacement, velocity and acceleration, shape (500, 3), and the force of a spring."""
    rng = np.random.default_rng(0)
    x = np.linspace(0.0, 4e-3, 500)
    return np.column_stack([x, rng.normal(0.0, 1e-3, 500), rng.normal(0.0, 0.1, 500)]), 5.0 + 5000.0 * x


def test_it_adds_the_inputs_of_the_hidden_neurons_and_learns_as_with_their_outputs(press):
    probe = ListedSumProbe(SETTINGS["foam"], AMPLITUDE, RATE, seed=3, weights=0.5)
    hidden, output = (layer.copy() for layer in probe.layers)
    for phi, force in zip(*press, strict=True):
        inputs = np.concatenate([[1.0], np.array(SETTINGS["foam"].scale) * phi])
        h = hidden @ inputs
        s = sigmoid(output[0] @ np.concatenate([[1.0], h]))
        delta = (force - AMPLITUDE * s) * AMPLITUDE * (1.0 - s**2) / 2.0
        back = delta * output[0, 1:] * (1.0 - sigmoid(h) ** 2) / 2.0
        output[0] += RATE * delta * np.concatenate([[1.0], sigmoid(h)])
        hidden += RATE * np.outer(back, inputs)
    probe.update_many(*press)
    np.testing.assert_allclose(probe.layers[0], hidden, atol=1e-12)
    np.testing.assert_allclose(probe.layers[1], output, atol=1e-12)


def test_a_probe_is_what_the_trajectory_ends_with(press):
    probe = ListedSumProbe(SETTINGS["foam"], AMPLITUDE, RATE, seed=3)
    K, B, M, _ = probe.trajectory(*press)[-1]
    answer = probe.probe()
    assert (answer.stiffness, answer.damping, answer.mass) == pytest.approx((K, B, M))


def test_a_rate_that_is_far_too_large_ends_at_the_amplitude(press):
    probe = ListedSumProbe(SETTINGS["foam"], AMPLITUDE, 1e3, seed=3)
    probe.update_many(*press)
    assert abs(probe.force((4e-3, 0.0, 0.0))) == pytest.approx(AMPLITUDE)
