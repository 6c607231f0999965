"""The [controller] table of an experiment: one kind for each controller, and the part that it makes."""

from __future__ import annotations

from functools import singledispatch
from typing import Annotated, Any, Literal

from msgspec import Meta

from palpate._vector import Vec3
from palpate.bench.part_table import NotNegative, Part, Positive, PositiveTriple, Triple
from palpate.controllers import Hybrid, Neural, join
from palpate.controllers.neural import INPUTS, OUTPUTS, alike
from palpate.errors import InputError
from palpate.networks import Network, network, random_layers, thesis_layers

Size = Annotated[int, Meta(ge=1, le=1000)]


class HybridController(Part, tag="hybrid", tag_field="kind"):
    kp: NotNegative = 400.0
    kv: NotNegative = 80.0
    kf: NotNegative = 1.0
    ki: NotNegative = 0.003
    """Per sample."""


class NeuralController(Part, tag="neural", tag_field="kind"):
    """The hybrid controller without integral, and a network that learns what it lacks."""

    kp: NotNegative = 400.0
    kv: NotNegative = 80.0
    kf: NotNegative = 0.25
    learning_rate: Positive = 5e-5
    """5e-5 in the thesis' text, 1e-4 in its listing."""
    layers: tuple[Size, ...] = (12,)
    """Neurons of each hidden layer."""
    weights: Literal["thesis", "random"] = "thesis"
    """At the start: those of the listing, or drawn evenly from -scale ... scale."""
    weights_seed: Annotated[int, Meta(ge=0)] = 0
    scale: NotNegative = 0.01
    amplitude: PositiveTriple = (20.0, 10.0, 1.0)
    """Of the outputs [N, N, N m]."""
    offset: Triple = (0.0, 0.01, 0.01)
    """Added to the poses that the network sees [m, m, rad]."""


ControllerTable = HybridController | NeuralController


def controller_of(table: ControllerTable) -> Any:
    """The controller of a table. Hybrid control has a compiled loop of its own; all others share one."""
    one = made(table)
    return one if isinstance(one, Hybrid) else join(one)


@singledispatch
def made(table: Any) -> Any:
    """The part that a table describes."""
    raise TypeError(f"no controller for {type(table).__name__}")


@made.register
def _(c: HybridController) -> Hybrid:
    return Hybrid(alike(c.kp), alike(c.kv), alike(c.kf), alike(c.ki))


@made.register
def _(c: NeuralController) -> Neural:
    return Neural(alike(c.kp), alike(c.kv), alike(c.kf), Vec3(*map(float, c.offset)), _network(c))


def _network(c: NeuralController) -> Network:
    sizes = (INPUTS, *c.layers, OUTPUTS)
    if c.weights == "random":
        layers = random_layers(sizes, c.weights_seed, c.scale)
    elif c.layers == (12,):
        layers = thesis_layers()
    else:
        raise InputError(
            f'weights = "thesis" are for layers = [12], got {list(c.layers)} in [controller]; set weights = "random"'
        )
    return network(list(layers), c.amplitude, c.learning_rate)
