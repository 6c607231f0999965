"""Force control with gains tuned by a network in the loop: the indirect scheme (thesis, fig. 2.5; Fukuda et al.)."""

from typing import Annotated, NamedTuple

from msgspec import Meta

from palpate._jit import law, part
from palpate._vector import Vec3, clip
from palpate.controllers.controller import ControllerTable, controller
from palpate.controllers.hybrid import hybrid
from palpate.controllers.resolved_acceleration import position_command
from palpate.networks import Network, NetworkState, network, random_layers
from palpate.signals.types import NotNegative, Positive, PositiveTriple, Size, alike, triple

INPUTS, OUTPUTS = 3, 3


@part
class SelfTuningState(NamedTuple):
    network: NetworkState
    integral: Vec3  # force command that the integral gain has gathered [N], shape (m,)
    rate: Vec3  # smoothed rate of the measured force [N/s], shape (m,)
    f: Vec3  # measured force of the tick before [N], shape (m,)
    by_ki: Vec3  # what the force owes to ki: df/d(ki) [N s], shape (m,)
    by_kd: Vec3  # the integral of what it owes to kd, likewise
    gains: Vec3  # in use: kf [1], ki [1/s], kd [s]


@law
def gradient(x, integral, kf, ki):
    """df/d(gain) of the gain that multiplies x, the loop closed and the surface giving way at once.

    There f = f_d + u_f, so that what a gain adds to u_f, kf and ki take back: x s/((1 + kf) s + ki).

    Args:
        x: what the gain multiplies.
        integral: of the result up to now.
        kf: force gain [1].
        ki: integral gain [1/s].
    """
    return (x - ki * integral) / (1.0 + kf)


@controller
class SelfTuning(NamedTuple):
    """`Hybrid` with a PID on the force, its three gains the output of a network that sees the force error.

    Each gain stays between 0 and twice its middle value. Every tick the network learns down the squared force error,
    as far as that exceeds the dead zone: below is noise, which teaches nothing. It knows no lag of arm or sensor, so
    that more kf always looks better to it: the loop has to be stable at twice the middle gains.

    When to use it: where one set of gains must do on surfaces unlike each other and the loop may be slow at first.
    A plain PI of the right gains is better on any one surface.

    Args:
        kp: position gain K_pp [1/s^2], shape (m,).
        kv: velocity gain K_pv [1/s], shape (m,).
        middle: of the gains: kf [1], ki [1/s], kd [s].
        scale: what the network's inputs are divided by: force error [N], the integral's share [N], force rate [N/s].
        dead_zone: force error that is not learned from [N].
        smoothing: time constant of the force rate [s].
        tick: time between steps [s].
        network: of 3 inputs and 3 outputs, the amplitudes being the middle gains.
    """

    kp: Vec3
    kv: Vec3
    middle: Vec3
    scale: Vec3
    dead_zone: float
    smoothing: float
    tick: float
    network: Network

    def start(self):
        no = 0.0 * self.kp
        return SelfTuningState(self.network.start(), no, no, no, no, no, 1.0 * self.middle)

    def step(self, state, sense, task, model):
        net, memory = self.network, state.network
        error = task.s * (task.f - sense.f)
        rate = state.rate + (sense.f - state.f - self.tick * state.rate) / self.smoothing
        slowing = -(task.s * rate)
        see(memory.signals, task.s @ error, task.s @ state.integral, task.s @ slowing, self.scale)
        net.forward(memory)
        kf = self.middle[0] + net.output(memory, 0)
        ki = self.middle[1] + net.output(memory, 1)
        kd = self.middle[2] + net.output(memory, 2)
        by_kf, by_kd = gradient(error, state.by_ki, kf, ki), gradient(slowing, state.by_kd, kf, ki)
        by_ki = state.by_ki + self.tick * by_kf
        lacking = error - clip(error, self.dead_zone)
        net.want(memory, 0, lacking @ by_kf)
        net.want(memory, 1, lacking @ by_ki)
        net.want(memory, 2, lacking @ by_kd)
        net.learn(memory)
        integral = state.integral + self.tick * ki * error
        u_x = position_command(self.kp, self.kv, sense.x, sense.xd, task.x, task.xd, task.xdd)
        u_f = kf * error + integral + kd * slowing
        torque = hybrid(model.J, model.Jdqd, model.M, model.h, task.s, u_x, task.f, u_f)
        owing = state.by_kd + self.tick * by_kd
        return torque, SelfTuningState(memory, integral, rate, sense.f, by_ki, owing, Vec3(kf, ki, kd))

    def rest(self, state, sense):
        """Keeps the learned weights."""
        no = 0.0 * self.kp
        return SelfTuningState(state.network, no, no, sense.f, no, no, state.gains)

    def report(self, state):
        """The integral's share of the force command; the gains kf, ki, kd."""
        return state.integral, state.gains


@law
def see(signals, error, integral, rate, scale):
    """Writes the network's three inputs."""
    signals[0], signals[1], signals[2] = error / scale[0], integral / scale[1], rate / scale[2]


class SelfTuningController(ControllerTable, tag="self-tuning"):
    """PID on the force; a network tunes its gains in the loop, each between 0 and twice its middle value."""

    kp: NotNegative = 400.0
    kv: NotNegative = 80.0
    kf: Positive = 0.25
    ki: Positive = 5.0
    """[1/s]."""
    kd: Positive = 0.004
    """[s]."""
    learning_rate: Positive = 1e-3
    layers: tuple[Size, ...] = (6,)
    """Neurons of each hidden layer."""
    weights_seed: Annotated[int, Meta(ge=0)] = 0
    scale: NotNegative = 0.3
    """The weights are drawn evenly from -scale ... scale."""
    inputs: PositiveTriple = (10.0, 5.0, 100.0)
    """Scales of the network's inputs: force error [N], the integral's share [N], force rate [N/s]."""
    dead_zone: NotNegative = 1.0
    """Force error that is not learned from [N]."""
    smoothing: Positive = 0.01
    """Time constant of the force rate [s]."""

    def build(self, tick: float, wall: float) -> SelfTuning:
        """The part, for a time between ticks [s] and a surface at x = `wall` [m]."""
        middle = (self.kf, self.ki, self.kd)
        layers = random_layers((INPUTS, *self.layers, OUTPUTS), self.weights_seed, self.scale)
        net = network(list(layers), middle, self.learning_rate)
        numbers = (float(self.dead_zone), float(self.smoothing), tick)
        return SelfTuning(alike(self.kp), alike(self.kv), triple(middle), triple(self.inputs), *numbers, net)
