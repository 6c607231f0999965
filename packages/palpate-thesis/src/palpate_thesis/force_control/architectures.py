"""Networks of other architectures in the place of the thesis' (sec. 7.2): radial basis functions; a recurrent one."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from palpate._jit import part
from palpate._vector import exp, sqrt
from palpate.arrays import Array
from palpate.bench import Bench, Experiment, build
from palpate.controllers.neural import Neural
from palpate.networks import Network, NetworkState, network, random_layers
from palpate.networks.network import shift, sigmoid, slope, weighted_sum

SIZES = (9, 12, 3)
"""Of the thesis' network, and so of both."""
LOW = np.array([0.460, 0.0, -0.02, 0.460, 0.0, -0.02, -3.0, 0.0, -0.3])
HIGH = np.array([0.475, 0.02, 0.04, 0.475, 0.02, 0.04, 3.0, 3.0, 0.3])
"""Between which the inputs lie in contact: pose, pose before [m, m, rad], torques [N m]."""


@part
class RadialBasis(NamedTuple):
    """Hidden neurons that answer to inputs near their centre; only the weights to the outputs learn.

    The hidden signals are scaled to length one. So the output layer, without thresholds, has the integral gain that
    the thesis' thresholds have alone.

    Args:
        sizes: inputs, hidden neurons, outputs, shape (3,).
        amplitude: of the outputs, shape (n_out,).
        learning_rate: eta.
        centres: of the hidden neurons over the widths, shape (n_hidden, n_in).
        widths: of every neuron in the direction of each input, shape (n_in,).
    """

    sizes: NDArray[np.int64]
    amplitude: Array
    learning_rate: float
    centres: Array
    widths: Array

    def start(self):
        n, m, k = self.sizes
        return NetworkState(np.zeros(m * k), np.zeros(n + m + k), np.zeros(k))

    def forward(self, state):
        """From the inputs to all signals."""
        n, m, _ = self.sizes
        nearest, total = 1e300, 0.0
        for j in range(m):
            d = 0.0
            for i in range(n):
                d += (state.signals[i] / self.widths[i] - self.centres[j, i]) ** 2
            state.signals[n + j] = d
            nearest = min(nearest, d)
        for j in range(n, n + m):
            state.signals[j] = exp(0.5 * (nearest - state.signals[j]))
            total += state.signals[j] * state.signals[j]
        for j in range(n, n + m):
            state.signals[j] /= sqrt(total)
        for k in range(len(self.amplitude)):
            u = weighted_sum(0.0, state.weights[k * m : k * m + m], state.signals[n : n + m])
            state.signals[n + m + k] = sigmoid(u)

    def output(self, state, k):
        """Output k of the last `forward`."""
        return self.amplitude[k] * state.signals[self.sizes[0] + self.sizes[1] + k]

    def want(self, state, k, error):
        """Says what output k lacked."""
        state.deltas[k] = error

    def learn(self, state):
        """One step against the gradient."""
        n, m, _ = self.sizes
        for k in range(len(self.amplitude)):
            d = self.amplitude[k] * slope(state.signals[n + m + k]) * state.deltas[k]
            shift(state.weights[k * m : k * m + m], self.learning_rate * d, state.signals[n : n + m])

    def gain(self, state, k):
        """Integral gain per sample, as of `Network`."""
        a = self.amplitude[k] * slope(state.signals[self.sizes[0] + self.sizes[1] + k])
        return self.learning_rate * a * a

    def norm(self, state, layer):
        """Root of the sum of squares of the weights into a layer; the hidden one has none that learn."""
        return sqrt(state.weights @ state.weights) if layer == 2 else 0.0


@part
class Recurrent(NamedTuple):
    """A network whose hidden neurons see their own signals of the tick before (Elman, 1990).

    It learns by back-propagation through one tick: the signals of before count as inputs.

    Args:
        sizes: inputs, hidden neurons, outputs, shape (3,).
        amplitude: of the outputs, shape (n_out,).
        learning_rate: eta.
        inner: the network with those signals as further inputs.
    """

    sizes: NDArray[np.int64]
    amplitude: Array
    learning_rate: float
    inner: Network

    def start(self):
        return self.inner.start()

    def forward(self, state):
        """From the inputs and the hidden signals of before to all signals."""
        n, m, _ = self.sizes
        for j in range(n, n + m):
            state.signals[j] = state.signals[j + m]
        self.inner.forward(state)

    def output(self, state, k):
        """Output k of the last `forward`."""
        return self.inner.output(state, k)

    def want(self, state, k, error):
        """Says what output k lacked."""
        self.inner.want(state, k, error)

    def learn(self, state):
        """One step of back-propagation."""
        self.inner.learn(state)

    def gain(self, state, k):
        """Integral gain per sample, as of `Network`."""
        return self.inner.gain(state, k)

    def norm(self, state, layer):
        """Root of the sum of squares of the weights into a layer."""
        return self.inner.norm(state, layer)


def radial_basis(amplitude: Array, learning_rate: float, seed: int) -> RadialBasis:
    """One whose centres are drawn evenly from where the inputs lie, half as wide as that."""
    widths = 0.5 * (HIGH - LOW)
    centres = np.random.default_rng(seed).uniform(LOW, HIGH, (SIZES[1], SIZES[0])) / widths
    return RadialBasis(np.array(SIZES), amplitude, learning_rate, centres, widths)


def recurrent(amplitude: Array, learning_rate: float, seed: int) -> Recurrent:
    """One with small random weights, as the thesis' network."""
    n, m, k = SIZES
    inner = network(random_layers((n + m, m, k), seed, 0.01), amplitude, learning_rate)
    return Recurrent(np.array(SIZES), inner.amplitude, learning_rate, inner)


def bench_with(experiment: Experiment, architecture: Any, seed: int) -> Bench:
    """The bench of an experiment with the neural controller, and another network in it."""
    table: Any = experiment.controller
    made: Neural = table.build(1.0 / experiment.run.rate, experiment.wall.x)
    other = architecture(made.network.amplitude, made.network.learning_rate, seed)
    return build(experiment).with_controller(made._replace(network=other))
