"""A small perceptron inside a kernel: forward, the gradients backwards, and one step down them."""

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from palpate._jit import law, part
from palpate._vector import exp, sqrt
from palpate.arrays import Array, Counts
from palpate.errors import InputError


@law
def sigmoid(u):  # (4.21): 2/(1 + e^-u) - 1
    """From -1 to 1. Written on |u|, so that the exponential never overflows."""
    e = exp(-abs(u))
    s = (1.0 - e) / (1.0 + e)
    return s if u >= 0.0 else -s


@law
def slope(s):
    """Derivative of the sigmoid, by its value s."""
    return 0.5 * (1.0 - s * s)


@law
def weighted_sum(threshold, weights, signals):
    """A neuron's sum. The weights come as a slice: the compiler then knows that no index is below zero."""
    u = threshold
    for i in range(len(weights)):
        u += weights[i] * signals[i]
    return u


@law
def shift(weights, d, signals):
    """Moves a neuron's weights by d times what came in."""
    for i in range(len(weights)):
        weights[i] += d * signals[i]


@law
def forward(sizes, weights, signals):  # (4.23), (4.24)
    """Fills `signals` from the inputs on; the outputs are still without their amplitudes."""
    w, before = 0, 0
    for layer in range(1, len(sizes)):
        n = sizes[layer - 1]
        here = before + n
        into = signals[before:here]
        for j in range(here, here + sizes[layer]):
            signals[j] = sigmoid(weighted_sum(weights[w], weights[w + 1 : w + 1 + n], into))
            w += n + 1
        before = here


@law
def backward(sizes, weights, amplitude, signals, deltas):
    """From the outputs' errors, at the end of `deltas`, to every neuron's: -dE/du of E = sum(error^2)/2."""
    end = len(signals)
    for k in range(len(amplitude)):
        j = end - len(amplitude) + k
        deltas[j] *= amplitude[k] * slope(signals[j])
    w, here = len(weights), end - sizes[-1]
    for layer in range(len(sizes) - 1, 1, -1):
        n, m = sizes[layer - 1], sizes[layer]
        w -= m * (n + 1)
        before = here - n
        for i in range(n):
            e = 0.0
            for j in range(m):
                e += deltas[here + j] * weights[w + j * (n + 1) + 1 + i]
            deltas[before + i] = e * slope(signals[before + i])
        here = before


@law
def descend(sizes, weights, signals, deltas, learning_rate, thresholds):  # (4.28), (4.29)
    """One step of every weight against the gradient; thresholds go `thresholds` times as far: 1, or 0 to keep them."""
    w, before = 0, 0
    for layer in range(1, len(sizes)):
        n = sizes[layer - 1]
        here = before + n
        into = signals[before:here]
        for j in range(here, here + sizes[layer]):
            d = learning_rate * deltas[j]
            weights[w] += thresholds * d
            shift(weights[w + 1 : w + 1 + n], d, into)
            w += n + 1
        before = here


@law
def squared_gradient(sizes, signals, deltas):
    """The squared length of the gradient that `deltas` stands for: of all weights and thresholds."""
    total, before = 0.0, 0
    for layer in range(1, len(sizes)):
        n = sizes[layer - 1]
        here = before + n
        into = 1.0
        for i in range(before, here):
            into += signals[i] * signals[i]
        for j in range(here, here + sizes[layer]):
            total += into * deltas[j] * deltas[j]
        before = here
    return total


@part
class NetworkState(NamedTuple):
    weights: Array  # (n_weights,), see `backpropagation`
    signals: Array  # (n_neurons,)
    deltas: Array  # (n_neurons,)


@part
class Network(NamedTuple):
    """A perceptron with its weights at the start, which it never changes; `network` makes it.

    Args:
        sizes: neurons of each layer, inputs first, shape (n_layers,).
        weights: at the start, shape (n_weights,), in the order of `backpropagation`.
        amplitude: of each output, shape (n_out,).
        learning_rate: eta.
    """

    sizes: Counts
    weights: Array
    amplitude: Array
    learning_rate: float

    def start(self):
        """Fresh arrays: two runs from one network do not see each other."""
        n = self.sizes.sum()
        return NetworkState(self.weights.copy(), np.zeros(n), np.zeros(n))

    def forward(self, state):
        """From the inputs, the first of `state.signals`, to all signals."""
        forward(self.sizes, state.weights, state.signals)

    def output(self, state, k):
        """Output k of the last `forward`."""
        n = len(self.amplitude)
        return self.amplitude[k] * state.signals[len(state.signals) - n + k]

    def want(self, state, k, error):
        """Says what output k lacked."""
        state.deltas[len(state.deltas) - len(self.amplitude) + k] = error

    def learn(self, state):
        """One step of back-propagation for the errors that `want` was told."""
        backward(self.sizes, state.weights, self.amplitude, state.signals, state.deltas)
        descend(self.sizes, state.weights, state.signals, state.deltas, self.learning_rate, 1.0)

    def gain(self, state, k):
        """Change of output k by one step of learning for error 1 of that output alone, to first order.

        A learning network is an integrator: this is its integral gain per sample, at this place and time.
        """
        for i in range(len(self.amplitude)):
            self.want(state, i, 1.0 if i == k else 0.0)
        backward(self.sizes, state.weights, self.amplitude, state.signals, state.deltas)
        return self.learning_rate * squared_gradient(self.sizes, state.signals, state.deltas)

    def norm(self, state, layer):
        """Root of the sum of squares of the weights and thresholds into a layer, 1 being the first hidden one."""
        first = 0
        for i in range(1, layer):
            first += self.sizes[i] * (self.sizes[i - 1] + 1)
        total = 0.0
        for w in range(first, first + self.sizes[layer] * (self.sizes[layer - 1] + 1)):
            total += state.weights[w] * state.weights[w]
        return sqrt(total)


def layers_of(sizes: Counts, weights: Array) -> tuple[Array, ...]:
    """The weights of each layer, shape (n, n_before + 1), thresholds in column 0: views of the flat array."""
    views, first = [], 0
    for n, m in pairwise(sizes):
        views.append(weights[first : first + m * (n + 1)].reshape(m, n + 1))
        first += m * (n + 1)
    return tuple(views)


def network(layers: Sequence[ArrayLike], amplitude: ArrayLike, learning_rate: float) -> Network:
    """A network from its layers' weights.

    Args:
        layers: each of shape (n, n_before + 1), thresholds in column 0; the last is the outputs'.
        amplitude: of the outputs, one number or shape (n_out,).
        learning_rate: eta, above 0.

    Raises:
        InputError: shapes that do not follow each other, numbers that are not finite, a rate not above 0.
    """
    matrices = [np.array(layer, dtype=np.float64) for layer in layers]
    if not matrices:
        raise InputError("a network needs at least one layer of weights, got none")
    _check_layers(matrices)
    n_out = len(matrices[-1])
    scale = np.array(amplitude, dtype=np.float64)
    if scale.shape not in ((), (n_out,)):
        raise InputError(f"amplitude must be a number or have shape ({n_out},), got {scale.shape}")
    if not (np.isfinite(scale).all() and (scale > 0.0).all()):
        raise InputError(f"amplitude must be above 0, got {scale}")
    if not (np.isfinite(learning_rate) and learning_rate > 0.0):
        raise InputError(f"learning_rate must be above 0 and finite, got {learning_rate}")
    sizes = np.array([matrices[0].shape[1] - 1, *map(len, matrices)], dtype=np.int64)
    weights = np.concatenate([m.ravel() for m in matrices])
    return Network(sizes, weights, np.full(n_out, 1.0) * scale, float(learning_rate))


def _check_layers(matrices: list[Array]) -> None:
    for i, m in enumerate(matrices):
        if m.ndim != 2 or m.shape[0] < 1 or m.shape[1] < 2:
            raise InputError(f"weights of layer {i + 1} must have shape (n, n_before + 1), got {m.shape}")
        if not np.isfinite(m).all():
            raise InputError(f"weights of layer {i + 1} must be finite")
        if i > 0 and m.shape[1] != len(matrices[i - 1]) + 1:
            raise InputError(
                f"weights of layer {i + 1} must have {len(matrices[i - 1]) + 1} columns, a threshold and one for each "
                f"neuron before, got {m.shape[1]}"
            )


def random_layers(sizes: tuple[int, ...], seed: int | np.random.Generator, scale: float) -> list[Array]:
    """Weights and thresholds drawn evenly from -scale ... scale.

    Args:
        sizes: neurons of each layer, inputs first; at least two.
        seed: or a generator.
        scale: the largest.
    """
    if len(sizes) < 2 or min(sizes) < 1:
        raise InputError(f"sizes must be two or more numbers above 0, inputs first, got {tuple(sizes)}")
    if not (np.isfinite(scale) and scale >= 0.0):
        raise InputError(f"scale must be finite and not negative, got {scale}")
    generator = np.random.default_rng(seed)
    return [generator.uniform(-scale, scale, (m, n + 1)) for n, m in pairwise(sizes)]
