"""The network against finite differences, against matrices, and against itself uncompiled."""

import numpy as np
import pytest

from palpate.errors import InputError
from palpate.networks import THESIS_AMPLITUDE, Perceptron, layers_of, network, random_layers, thesis_layers
from palpate.networks.network import backward, descend, forward, sigmoid, slope

DEEP = {1: (4, 5, 2), 2: (3, 6, 4, 2), 3: (5, 4, 3, 4, 3)}
deep = pytest.mark.parametrize("sizes", DEEP.values(), ids=[f"{n} hidden" for n in DEEP])


def by_matrices(layers, amplitude, x):
    """The network as a textbook has it, independent of the laws."""
    for w in layers:
        x = 2.0 / (1.0 + np.exp(-(w[:, 0] + w[:, 1:] @ x))) - 1.0
    return amplitude * x


def some(sizes, learning_rate=1.0, seed=1):
    generator = np.random.default_rng(seed)
    amplitude = generator.uniform(0.5, 20.0, sizes[-1])
    net = Perceptron.random(sizes, amplitude, learning_rate, generator, 0.8)
    return net, generator.normal(size=sizes[0]), generator.normal(size=sizes[-1])


@deep
def test_forward_is_the_textbook_s(sizes):
    net, x, _ = some(sizes)
    np.testing.assert_allclose(
        net.forward(x), by_matrices(net.layers, net.amplitude, x), rtol=1e-13, atol=1e-14
    )


@deep
def test_a_step_goes_against_the_gradient_to_1e_8_of_finite_differences(sizes):
    """E = sum (desired - output)^2/2, every weight and threshold; old weights of the layer behind (4.28)."""
    net, x, desired = some(sizes)
    before = [w.copy() for w in net.layers]

    def cost(layers):
        return 0.5 * np.sum((desired - by_matrices(layers, net.amplitude, x)) ** 2)

    net.learn(desired - net.forward(x))
    h = 1e-5
    for k, w in enumerate(before):
        for index in np.ndindex(w.shape):
            moved = [[v.copy() for v in before] for _ in (0, 1)]
            moved[0][k][index] += h
            moved[1][k][index] -= h
            # Central differences at h and 2h, extrapolated: error of order h^4.
            near = (cost(moved[0]) - cost(moved[1])) / (2 * h)
            moved[0][k][index] += h
            moved[1][k][index] -= h
            far = (cost(moved[0]) - cost(moved[1])) / (4 * h)
            expected = -(4 * near - far) / 3
            step = net.layers[k][index] - w[index]
            assert step == pytest.approx(expected, rel=1e-8, abs=1e-8)


@deep
def test_compiled_and_plain_agree_to_the_last_bit(sizes):
    net, x, desired = some(sizes, 0.01)
    plain = network([w.copy() for w in net.layers], net.amplitude, 0.01)
    memory = plain.start()
    for _ in range(50):
        memory.signals[: sizes[0]] = x
        plain.forward(memory)
        y = np.array([plain.output(memory, k) for k in range(sizes[-1])])
        np.testing.assert_array_equal(net.forward(x), y)
        for k, e in enumerate(desired - y):
            plain.want(memory, k, e)
        plain.learn(memory)
        net.learn(desired - y)
    for a, b in zip(net.layers, layers_of(plain.sizes, memory.weights), strict=True):
        np.testing.assert_array_equal(a, b)


def test_the_sigmoid_and_its_slope():
    u = np.linspace(-40.0, 40.0, 401)
    s = np.array([sigmoid(v) for v in u])
    np.testing.assert_allclose(s, 2.0 / (1.0 + np.exp(-u)) - 1.0, rtol=0, atol=4e-16)
    np.testing.assert_array_equal(s, [-sigmoid(-v) for v in u])
    small = np.linspace(-3.0, 3.0, 61)
    differences = [(sigmoid(v + 1e-6) - sigmoid(v - 1e-6)) / 2e-6 for v in small]
    np.testing.assert_allclose([slope(sigmoid(v)) for v in small], differences, atol=1e-9)


@pytest.mark.parametrize(("u", "s"), [(1e4, 1.0), (-1e4, -1.0), (np.inf, 1.0), (-np.inf, -1.0), (0.0, 0.0)])
def test_the_sigmoid_never_overflows(u, s):
    with np.errstate(all="raise"):
        assert sigmoid(u) == s


def test_the_thesis_network():
    net = Perceptron.thesis(learning_rate=1e-4)
    assert net.hidden_weights.shape == (12, 10)
    assert net.output.shape == (3, 13)
    assert tuple(net.amplitude) == THESIS_AMPLITUDE == (20.0, 10.0, 1.0)
    assert net.learning_rate == 1e-4
    # Corners and sums of the listing's numbers, in thousandths.
    assert net.hidden_weights[0, 0] == -0.001
    assert net.hidden_weights[3, 4] == -0.008475
    assert net.output[2, 12] == 0.008905
    hidden, output = thesis_layers()
    assert 1e3 * hidden[:, 0].sum() == pytest.approx(-16.967)
    assert 1e3 * output[:, 0].sum() == pytest.approx(-3.858)
    assert np.abs(hidden).max() == 0.008475
    assert np.abs(output).max() == 0.009695


@deep
def test_gain_is_what_a_small_step_adds_to_the_output(sizes):
    net, x, _ = some(sizes)
    part = network([w.copy() for w in net.layers], net.amplitude, 1e-9)
    memory = part.start()
    for k in range(sizes[-1]):
        memory.signals[: sizes[0]] = x
        part.forward(memory)
        gain = part.gain(memory, k)
        moved = Perceptron.of_layers(layers_of(part.sizes, memory.weights), part.amplitude, 1e-9)
        before = moved.forward(x)
        moved.learn(np.eye(sizes[-1])[k])
        assert gain == pytest.approx(moved.forward(x)[k] - before[k], rel=1e-5)


def test_thresholds_can_be_kept():
    part = network(random_layers((2, 3, 1), 1, 1.0), 1.0, 1.0)
    memory = part.start()
    memory.signals[:2] = 1.0, -1.0
    forward(part.sizes, memory.weights, memory.signals)
    part.want(memory, 0, 1.0)
    backward(part.sizes, memory.weights, part.amplitude, memory.signals, memory.deltas)
    descend(part.sizes, memory.weights, memory.signals, memory.deltas, 1.0, 0.0)
    for before, after in zip(
        layers_of(part.sizes, part.weights), layers_of(part.sizes, memory.weights), strict=True
    ):
        np.testing.assert_array_equal(after[:, 0], before[:, 0])
        assert (after[:, 1:] != before[:, 1:]).all()


GOOD = {"hidden": np.zeros((2, 4)), "output": np.zeros((1, 3)), "amplitude": 1.0, "learning_rate": 0.1}


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"hidden": np.zeros(4)}, "shape"),
        ({"hidden": np.zeros((2, 1))}, "shape"),
        ({"output": np.zeros((1, 2))}, "3 columns"),
        ({"output": np.full((1, 3), np.nan)}, "finite"),
        ({"amplitude": [1.0, 2.0]}, "amplitude"),
        ({"amplitude": 0.0}, "amplitude"),
        ({"amplitude": np.inf}, "amplitude"),
        ({"learning_rate": 0.0}, "learning_rate must be above 0"),
        ({"learning_rate": -1.0}, "got -1"),
        ({"learning_rate": np.nan}, "learning_rate"),
    ],
)
def test_a_network_that_cannot_be_is_refused(changed, message):
    with pytest.raises(InputError, match=message):
        Perceptron(**{**GOOD, **changed})


@pytest.mark.parametrize(
    ("sizes", "scale"), [((3,), 0.1), ((3, 0, 1), 0.1), ((3, 1), -0.1), ((3, 1), np.nan)]
)
def test_sizes_and_scales_that_cannot_be_are_refused(sizes, scale):
    with pytest.raises(InputError):
        random_layers(sizes, 0, scale)


def test_a_bad_sample_is_refused_and_changes_nothing():
    net = Perceptron(**GOOD)
    with pytest.raises(InputError, match="forward"):
        net.learn([1.0])
    net.forward([1.0, 2.0, 3.0])
    for bad in ([1.0, 2.0], [1.0, np.nan, 0.0], 1.0):
        with pytest.raises(InputError, match="inputs"):
            net.forward(bad)
    for bad in ([1.0, 2.0], [np.inf]):
        with pytest.raises(InputError, match="error"):
            net.learn(bad)
    assert not net.hidden_weights.any()
    assert not net.output.any()
