"""A layered network with on-line back-propagation, as laws on arrays that the caller owns (thesis, sec. 4.5).

A network is `sizes`, the number of neurons in each layer from the inputs to the outputs, and one flat array
`weights`: layer by layer, neuron by neuron, its threshold first and then its weight for each neuron before it.
Two work arrays have a place for every neuron, layer by layer: `signals`, what leaves it, of which the caller
writes the inputs; and `deltas`, of which the caller writes the errors of the outputs.
Everything is changed in place: no array is made.
"""

from palpate._jit import law
from palpate._vector import exp


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
