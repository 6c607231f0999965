"""Small layered networks that learn on line, a sample at a time: forward and back-propagation, nothing else."""

from palpate.networks.network import Network, NetworkState, layers_of, network, random_layers
from palpate.networks.perceptron import THESIS_AMPLITUDE, Perceptron, thesis_layers

__all__ = [
    "THESIS_AMPLITUDE",
    "Network",
    "NetworkState",
    "Perceptron",
    "layers_of",
    "network",
    "random_layers",
    "thesis_layers",
]
