"""The perceptron for your own loop: forward and on-line back-propagation, compiled.

A row is a neuron, its threshold first.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from palpate._jit import kernel
from palpate._jit.typed_edge import cast_array, cast_number, machine_code
from palpate.arrays import Array
from palpate.errors import InputError
from palpate.networks.network import backward, descend, forward, layers_of, network, random_layers


class Perceptron:
    """A network with one hidden layer or more, sigmoids 2/(1 + e^-u) - 1 and an amplitude for each output.

    When to use it: as a term that learns in a control loop, or as a black-box model of a few signals; a `forward`
    and a `learn` take some three microseconds each. Both are compiled in the constructor.

    Args:
        hidden: weights of the hidden layer, shape (n_hidden, n_in + 1), thresholds in column 0.
        output: weights of the output layer, shape (n_out, n_hidden + 1), thresholds in column 0.
        amplitude: the largest output, one number or shape (n_out,).
        learning_rate: eta, above 0.

    Raises:
        InputError: shapes that do not fit, numbers that are not finite, a rate not above 0.
    """

    def __init__(self, hidden: ArrayLike, output: ArrayLike, amplitude: ArrayLike, learning_rate: float):
        self._set([hidden, output], amplitude, learning_rate)

    @classmethod
    def of_layers(cls, layers: Sequence[ArrayLike], amplitude: ArrayLike, learning_rate: float) -> Perceptron:
        """A network of any number of layers: each of shape (n, n_before + 1), the last the outputs'."""
        self = cls.__new__(cls)
        self._set(layers, amplitude, learning_rate)
        return self

    @classmethod
    def random(
        cls,
        sizes: Sequence[int],
        amplitude: ArrayLike,
        learning_rate: float,
        seed: int | np.random.Generator = 0,
        scale: float = 0.01,
    ) -> Perceptron:
        """A network of these sizes, inputs first, with weights drawn evenly from -scale ... scale."""
        return cls.of_layers(random_layers(tuple(sizes), seed, scale), amplitude, learning_rate)

    @classmethod
    def thesis(cls, learning_rate: float = 5e-5) -> Perceptron:
        """The 9-12-3 network of the thesis' controller, with the weights it starts from (App. E)."""
        return cls.of_layers(thesis_layers(), THESIS_AMPLITUDE, learning_rate)

    def _set(self, layers: Sequence[ArrayLike], amplitude: ArrayLike, learning_rate: float) -> None:
        net = network(layers, amplitude, learning_rate)
        self.learning_rate = net.learning_rate
        self._sizes, self._amplitude = net.sizes, net.amplitude
        self._weights, self._signals, self._deltas = net.start()
        self._bind()
        self._heard = False

    @property
    def layers(self) -> tuple[Array, ...]:
        """The weights of each layer, shape (n, n_before + 1): views, so that writing in them changes the network."""
        return layers_of(self._sizes, self._weights)

    @property
    def hidden_weights(self) -> Array:
        """The weights of the first layer after the inputs, a view."""
        return self.layers[0]

    @property
    def output(self) -> Array:
        """The weights of the last layer, a view."""
        return self.layers[-1]

    @property
    def amplitude(self) -> Array:
        """The largest size of each output, shape (n_out,)."""
        return self._amplitude.copy()

    def forward(self, inputs: ArrayLike) -> Array:
        """The outputs, shape (n_out,), for inputs of shape (n_in,).

        Raises:
            InputError: inputs of another shape, or not finite.
        """
        x = self._check(inputs, int(self._sizes[0]), "inputs")
        y = np.empty(len(self._amplitude))
        self._forward(self._sizes, self._weights, self._amplitude, self._signals, x, y)
        self._heard = True
        return y

    def learn(self, error: ArrayLike) -> None:
        """One step of back-propagation from the last `forward`: error = desired - measured, shape (n_out,).

        Raises:
            InputError: errors of another shape, or not finite; no `forward` before.
        """
        e = self._check(error, len(self._amplitude), "error")
        if not self._heard:
            raise InputError("learn needs the signals of a forward before it: call forward(inputs) first")
        rate = cast_number("learning_rate", self.learning_rate)
        self._learn(self._sizes, self._weights, self._amplitude, self._signals, self._deltas, e, rate)

    def _bind(self) -> None:
        """Compile both, without learning anything."""
        net, none = (self._sizes, self._weights, self._amplitude), 0.0 * self._amplitude
        self._forward = machine_code(_forward, *net, self._signals, np.zeros(self._sizes[0]), none.copy())
        self._learn = machine_code(_learn, *net, self._signals, self._deltas, none, 0.0)

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in self.__dict__.items() if name not in ("_forward", "_learn")}

    def __setstate__(self, known: dict[str, Any]) -> None:
        self.__dict__.update(known)
        self._bind()

    @staticmethod
    def _check(values: ArrayLike, n: int, name: str) -> Array:
        array = cast_array(name, values, (n,))
        if not (np.abs(array) <= LARGEST).all():
            raise InputError(
                f"{name} must be finite, up to {LARGEST:g}, got {array.tolist()}; leave the sample out"
            )
        return array


LARGEST = 1e30
"""Largest input or error of one sample, as of the estimators: products of three of them are floats."""
THESIS_AMPLITUDE = (20.0, 10.0, 1.0)
"""Of the outputs of the thesis' controller [N, N, N m]."""


def thesis_layers() -> list[Array]:
    """The weights that the thesis' controller starts from (App. E): shapes (12, 10) and (3, 13)."""
    return [np.array(HIDDEN) / 1000.0, np.array(OUTPUT) / 1000.0]


@kernel
def _forward(sizes, weights, amplitude, signals, inputs, outputs):
    for i in range(len(inputs)):
        signals[i] = inputs[i]
    forward(sizes, weights, signals)
    first = len(signals) - len(outputs)
    for k in range(len(outputs)):
        outputs[k] = amplitude[k] * signals[first + k]


@kernel
def _learn(sizes, weights, amplitude, signals, deltas, error, learning_rate):
    first = len(signals) - len(error)
    for k in range(len(error)):
        deltas[first + k] = error[k]
    backward(sizes, weights, amplitude, signals, deltas)
    descend(sizes, weights, signals, deltas, learning_rate, 1.0)


HIDDEN = (  # (12, 10)
    (-1, 1.439, 1.275, 2.55, -3.5, 1.3, 1.915, -4.17, 1.75, 4.1),
    (-1.1, 6.7, 7.5, 1.2, -2.878, 1.732, 1.238, -1.937, 8.1, 2.58),
    (-1.2, -1.3, 1.532, 1.4, 5.12, 1.097, 2.005, 5.8, 1.178, -1.8),
    (-1.3, 3.927, 4.19, -8.45, -8.475, 3.938, -1.838, -1.622, -2.75, 0.172),
    (-1.4, 1.476, 0.9, 0.667, 4.619, 0.889, 1, 4.6, 1.525, 0.105),
    (-1.5, 1.333, 1.698, 1.25, 1.333, 1.067, 1.524, 1.75, 3.8, 0.106),
    (-1.7, 1.381, 0.921, -6.55, -4.286, 1.09, 0.778, 1.85, 1.12, 0.107),
    (-1.7, 1.5, 1.548, 1.403, 1.387, 1.5, 1.806, 1.7, 1.225, 0.108),
    (-1.8, 1.502, 1.542, 1.402, 1.382, 1.502, 1.802, 1.702, 1.222, 0.102),
    (-1.9, 1.503, 1.543, 1.403, 1.383, 1.503, 1.803, 1.703, 1.223, 0.103),
    (-1.133, 1.504, 1.544, 1.404, 1.384, 1.504, 1.804, 1.704, 1.224, 0.104),
    (-1.234, 1.505, 1.545, 1.405, 1.385, 1.505, 1.805, 1.705, 1.225, 0.105),
)

OUTPUT = (  # (3, 13)
    (-1.05, -3.415, -1.57, 3.138, -6.8, -2.212, 1.976, -9.512, 8.026, -4.162, 3.532, -1.203, -1.65),
    (-1.15, 1.075, -6.95, 7.5, -4.2, -8.75, -1.039, 5.65, -2.756, -5.352, -8.803, -6.244, -5.537),
    (-1.658, 1.242, -2.742, -1.03, 2.921, -6.42, -4.429, 2.921, 8.418, 8.935, 9.695, -5.594, 8.905),
)
