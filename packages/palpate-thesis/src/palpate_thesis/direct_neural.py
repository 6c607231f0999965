"""Direct neural force control of one joint: the network gives the torque (thesis, fig. 2.3, 2.4; Yabuta, Yamada)."""

from __future__ import annotations

from typing import NamedTuple

from palpate._jit import law, part
from palpate.networks import Network, NetworkState, network, random_layers

INPUTS = 4


@part
class DirectNeuralState(NamedTuple):
    network: NetworkState
    f: float  # measured force of the tick before [N]
    torque: float  # of the tick before [N m]


@part
class DirectNeural(NamedTuple):
    """No other controller stands beside the network: it learns from the force error alone what torque presses so.

    The network sees the desired force, the measured one, that of the tick before and its own last torque. Of the plant
    it knows only that more torque presses harder.

    Args:
        force: what forces are divided by before the network sees them [N].
        network: of 4 inputs and 1 output, the amplitude being the largest torque [N m]; `direct_neural` makes it.
    """

    force: float
    network: Network

    def start(self):
        return DirectNeuralState(self.network.start(), 0.0, 0.0)

    def step(self, state, desired, f):
        """Torque [N m] for the desired and the measured force [N]; learns on the way."""
        net, memory = self.network, state.network
        see(
            memory.signals,
            desired / self.force,
            f / self.force,
            state.f / self.force,
            state.torque / net.amplitude[0],
        )
        net.forward(memory)
        torque = net.output(memory, 0)
        net.want(memory, 0, desired - f)
        net.learn(memory)
        return torque, DirectNeuralState(memory, f, torque)

    def gain(self, state):
        """Its integral gain, here and now [N m per N and sample]: what one step of learning adds to the torque."""
        return self.network.gain(state.network, 0)


@law
def see(signals, desired, f, f_before, torque):
    """Writes the network's four inputs."""
    signals[0], signals[1], signals[2], signals[3] = desired, f, f_before, torque


@part
class DirectIntegral(NamedTuple):
    """First-order equivalent of `DirectNeural`: the integral of the force error, as a torque.

    Args:
        ki: [N m per N and sample].
    """

    ki: float

    def start(self):
        return 0.0

    def step(self, state, desired, f):
        """Torque [N m] for the desired and the measured force [N]."""
        torque = state + self.ki * (desired - f)
        return torque, torque

    def gain(self, state):
        """Its integral gain [N m per N and sample]."""
        return self.ki


def direct_neural(
    learning_rate: float = 5e-5,
    torque: float = 9.8,
    hidden: int = 6,
    force: float = 20.0,
    seed: int = 0,
    scale: float = 0.3,
) -> DirectNeural:
    """A direct neural controller whose weights are drawn evenly from -scale ... scale.

    Args:
        learning_rate: eta.
        torque: the largest it can give [N m]; well above what is needed, or the sigmoid flattens and learns no more.
        hidden: neurons of the hidden layer.
        force: scale of the forces [N].
        seed: of the weights.
        scale: of the weights.

    Raises:
        InputError: a learning rate or a torque not above 0, no hidden neuron.
    """
    return DirectNeural(
        float(force), network(list(random_layers((INPUTS, hidden, 1), seed, scale)), torque, learning_rate)
    )
