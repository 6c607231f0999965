"""The identifier's network with the output sum of the listing, which adds the inputs of the hidden neurons."""

import math

import numpy as np
from numpy.typing import ArrayLike

from palpate.bench import kernel, law
from palpate.identifiers.neural_probe import NeuralProbe, Probed
from palpate.networks.network import backward, descend, forward, sigmoid

SATURATED = 1.0 - 1e-15
"""Largest output of a hidden neuron from which its input is computed: rounding hides larger ones."""
MAX_SUM = 700.0
"""Bound of the output sum, at which exp would overflow; the output is at its amplitude from 40 on."""


class ListedSumProbe(NeuralProbe):
    """Probe whose output neuron adds v.h in place of v.s(h), for one hidden layer; it learns as before.

    The listing does so (errata, "network"): forward with h, backward with s(h).
    """

    def probe(
        self,
        displacement: float | None = None,
        velocity: float | None = None,
        acceleration: float | None = None,
    ) -> Probed:
        """K, B and M by differences of the network's forces; see `NeuralProbe.probe`."""
        inputs = (displacement, velocity, acceleration)
        x, v, a = (float(d if g is None else g) for g, d in zip(inputs, self.values, strict=True))
        pressed, moving = self.force((x, 0.0, 0.0)), self.force((x, v, 0.0))
        mass = (self.force((x, v, a)) - moving) / a
        at_zero = self.force((0.0, 0.0, 0.0))
        return Probed(pressed / x, (moving - pressed) / v, mass, at_zero, self._warnings(np.array([x, v, a])))

    def force(self, regressor: ArrayLike) -> float:
        """Force of the network for displacement, velocity and acceleration, shape (3,) [N]."""
        signals = self._memory.signals.copy()
        x, v, a = self.scale * np.asarray(regressor, dtype=np.float64)
        said = _said(self._net.sizes, self._memory.weights, signals, float(x), float(v), float(a))
        return float(self._net.amplitude[0] * said)

    def _bind(self) -> None:
        self._follow = _follow


@law
def _said(sizes, weights, signals, x, v, a):
    """Output of the network for scaled inputs, without its amplitude."""
    signals[0], signals[1], signals[2] = x, v, a
    forward(sizes, weights, signals)
    last = len(weights) - sizes[1] - 1
    total = weights[last]
    for j in range(sizes[1]):
        s = min(max(signals[3 + j], -SATURATED), SATURATED)
        total += weights[last + 1 + j] * math.log((1.0 + s) / (1.0 - s))  # h, from s = 2/(1 + e^-h) - 1
    signals[3 + sizes[1]] = sigmoid(min(max(total, -MAX_SUM), MAX_SUM))
    return signals[3 + sizes[1]]


# More than seven arguments: those of the kernel of `NeuralProbe`, whose place it takes.
@kernel
def _follow(
    sizes,
    weights,
    amplitude,
    signals,
    deltas,
    learning_rate,
    thresholds,
    scale,
    values,
    low,
    high,
    phi,
    y,
    out,
):
    """Learn from each sample; K, B, M and the error before it into `out`. Return the number of samples."""
    size = amplitude[0]
    px, pv, pa = scale[0] * values[0], scale[1] * values[1], scale[2] * values[2]
    for i in range(len(y)):
        for c in range(3):
            low[c], high[c] = min(low[c], phi[i, c]), max(high[c], phi[i, c])
        x, v, a = scale[0] * phi[i, 0], scale[1] * phi[i, 1], scale[2] * phi[i, 2]
        error = y[i] - size * _said(sizes, weights, signals, x, v, a)
        deltas[len(deltas) - 1] = error
        backward(sizes, weights, amplitude, signals, deltas)
        descend(sizes, weights, signals, deltas, learning_rate, thresholds)
        if len(out) > 0:
            pressed = size * _said(sizes, weights, signals, px, 0.0, 0.0)
            moving = size * _said(sizes, weights, signals, px, pv, 0.0)
            hastened = size * _said(sizes, weights, signals, px, pv, pa)
            out[i, 0], out[i, 1] = pressed / values[0], (moving - pressed) / values[1]
            out[i, 2], out[i, 3] = (hastened - moving) / values[2], error
    return len(y)
