"""Neural force control: a network in the loop compensates the hybrid controller's error (thesis, sec. 4.5)."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal, NamedTuple

from msgspec import Meta

from palpate._jit import law, part
from palpate._vector import ZERO3, Vec3
from palpate.controllers.controller import ControllerTable, controller
from palpate.controllers.hybrid import hybrid, position_command
from palpate.errors import InputError
from palpate.networks import THESIS_AMPLITUDE, Network, NetworkState, network, random_layers, thesis_layers
from palpate.signals.types import NotNegative, PositiveTriple, Size, Triple, alike, coerce_fields, triple

INPUTS, OUTPUTS = 9, 3
STUCK = 1e-3
"""1 - y^2 of a sigmoid y under which it counts as saturated: its weights then learn with 1e-6 of the rate at 0."""


@part
class NeuralState(NamedTuple):
    network: NetworkState
    x: Vec3  # pose of the tick before
    command: Vec3  # the network's [N, N, N m]


def _check(self):
    sizes = self.network.sizes
    if sizes[0] != INPUTS or sizes[-1] != OUTPUTS:
        raise InputError(
            f"the neural controller's network has {INPUTS} inputs (pose, pose before, torques) and {OUTPUTS} outputs, "
            f"got {sizes[0]} and {sizes[-1]}"
        )


@controller
@coerce_fields(_check)
class Neural(NamedTuple):
    """The hybrid controller without its integral, and a network whose force command is added through J^T.

    The network sees the pose, the pose of the tick before and the hybrid controller's torques; every tick it learns
    from the error of force where the force is controlled and of the pose where that is. It keeps what it has learned
    when the contact is lost.

    When to use it: it needs no gains for the surface. To first order it is an integral controller
    (`Network.gain`), and learning never stops: see what the thesis' reproduction says of long runs.

    Args:
        kp: position gain K_pp [1/s^2], shape (3,).
        kv: velocity gain K_pv [1/s], shape (3,).
        kf: force gain K_fp [1], shape (3,).
        offset: added to both poses before the network sees them [m, m, rad].
        network: of 9 inputs and 3 outputs.

    Raises:
        InputError: a network of other inputs or outputs.
    """

    kp: Vec3
    kv: Vec3
    kf: Vec3
    offset: Vec3
    network: Network

    @classmethod
    def thesis(cls, learning_rate: float = 5e-5) -> Neural:
        """The thesis' controller: its gains, its 9-12-3 network and the weights that it starts from."""
        net = network(thesis_layers(), THESIS_AMPLITUDE, learning_rate)
        return cls(alike(400.0), alike(80.0), alike(0.25), Vec3(0.0, 0.01, 0.01), net)

    def start(self):
        return NeuralState(self.network.start(), ZERO3, ZERO3)

    def step(self, state, sense, task, model):
        u_x = position_command(self.kp, self.kv, sense.x, sense.xd, task.x, task.xd, task.xdd)  # (4.19)
        u_f = self.kf * (task.s * (task.f - sense.f))  # (4.20)
        torque = hybrid(model.J, model.Jdqd, model.M, model.h, task.s, u_x, task.f, u_f)  # (4.18)
        net, memory = self.network, state.network
        see(memory.signals, sense.x + self.offset, state.x + self.offset, torque)
        net.forward(memory)
        command = Vec3(net.output(memory, 0), net.output(memory, 1), net.output(memory, 2))
        error = task.s * (task.f - sense.f) + (1.0 - task.s) * (task.x - sense.x)
        net.want(memory, 0, error.x)
        net.want(memory, 1, error.y)
        net.want(memory, 2, error.z)
        net.learn(memory)
        return torque + model.J.T @ command, NeuralState(memory, sense.x, command)

    def rest(self, state, sense):
        """Keeps the learned weights and tracks the pose, so that the next contact has a previous pose."""
        return NeuralState(state.network, sense.x, ZERO3)

    def report(self, state):
        """The network's command; norms of the hidden and of the output weights, and its integral gain per sample."""
        net, memory = self.network, state.network
        last = len(net.sizes) - 1
        return state.command, Vec3(net.norm(memory, 1), net.norm(memory, last), net.gain(memory, 0))

    def trouble(self, state):
        """Whether the force output is so far saturated that its errors teach it nothing any more."""
        net = self.network
        share = net.output(state.network, 0) / net.amplitude[0]
        if 1.0 - share * share >= STUCK:
            return ""
        return (
            f"the network's force output is saturated at {net.amplitude[0]:g} N and no longer learns; lower the "
            f"learning rate, {net.learning_rate:g}"
        )


@law
def see(signals, x, x_before, torque):
    """Writes the network's nine inputs."""
    signals[0], signals[1], signals[2] = x.x, x.y, x.z
    signals[3], signals[4], signals[5] = x_before.x, x_before.y, x_before.z
    signals[6], signals[7], signals[8] = torque.x, torque.y, torque.z


class NeuralController(ControllerTable, tag="neural"):
    """The hybrid controller without integral, and a network that compensates its error."""

    shares_loop: ClassVar[bool] = True

    kp: NotNegative = 400.0
    kv: NotNegative = 80.0
    kf: NotNegative = 0.25
    learning_rate: Annotated[float, Meta(gt=0, le=1e300)] = 5e-5
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

    def build(self, tick: float, wall: float) -> Neural:
        """The part, for a time between ticks [s] and a surface at x = `wall` [m]."""
        return Neural(alike(self.kp), alike(self.kv), alike(self.kf), triple(self.offset), self._network())

    def _network(self) -> Network:
        sizes = (INPUTS, *self.layers, OUTPUTS)
        if self.weights == "random":
            layers = random_layers(sizes, self.weights_seed, self.scale)
        elif self.layers == (12,):
            layers = thesis_layers()
        else:
            raise InputError(
                f'weights = "thesis" are for layers = [12], got {list(self.layers)} in [controller]; '
                'set weights = "random"'
            )
        return network(list(layers), self.amplitude, self.learning_rate)
