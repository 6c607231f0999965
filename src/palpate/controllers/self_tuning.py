"""Force control whose gains a network tunes in the loop: the indirect scheme (thesis, fig. 2.5; Fukuda et al.)."""

from typing import NamedTuple

from palpate._jit import law, part
from palpate._vector import Vec3, clip
from palpate.controllers.controller import controller
from palpate.controllers.hybrid import hybrid
from palpate.controllers.resolved_acceleration import position_command
from palpate.networks import Network, NetworkState

INPUTS, OUTPUTS = 3, 3


@part
class SelfTuningState(NamedTuple):
    network: NetworkState
    integral: Vec3  # of the force error [N s], shape (m,)
    rate: Vec3  # smoothed rate of the measured force [N/s], shape (m,)
    f: Vec3  # measured force of the tick before [N], shape (m,)
    gains: Vec3  # in use: kf [1], ki [1/s], kd [s]


@law
def tune(network, memory, lacking, proportional, integral, derivative):
    """One step of learning down the squared force error, the force taken to answer the force command one to one.

    d(u_f)/d(gain) is what the gain multiplies, so each output lacks the error times that.
    """
    network.want(memory, 0, lacking @ proportional)
    network.want(memory, 1, lacking @ integral)
    network.want(memory, 2, lacking @ derivative)
    network.learn(memory)


@controller
class SelfTuning(NamedTuple):
    """`Hybrid` with a PID on the force, its three gains the output of a network that sees the force error.

    Each gain stays between 0 and twice its middle value. The network learns while the force error exceeds the dead
    zone: the gradient for the proportional gain is the error squared, so that from noise alone it would grow for ever.

    When to use it: where one set of gains must do on surfaces unlike each other and the loop may be slow at first.
    A plain PI of the right gains is better on any one surface.

    Args:
        kp: position gain K_pp [1/s^2], shape (m,).
        kv: velocity gain K_pv [1/s], shape (m,).
        middle: of the gains: kf [1], ki [1/s], kd [s].
        scale: what the network's inputs are divided by: force error [N], its integral [N s], force rate [N/s].
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
        nothing = 0.0 * self.kp
        return SelfTuningState(self.network.start(), nothing, nothing, nothing, 1.0 * self.middle)

    def step(self, state, sense, task, model):
        net, memory = self.network, state.network
        error = task.s * (task.f - sense.f)
        integral = state.integral + self.tick * error
        rate = state.rate + (sense.f - state.f - self.tick * state.rate) / self.smoothing
        slowing = -(task.s * rate)
        see(memory.signals, task.s @ error, task.s @ integral, task.s @ slowing, self.scale)
        net.forward(memory)
        kf = self.middle[0] + net.output(memory, 0)
        ki = self.middle[1] + net.output(memory, 1)
        kd = self.middle[2] + net.output(memory, 2)
        tune(net, memory, error - clip(error, self.dead_zone), error, integral, slowing)
        u_x = position_command(self.kp, self.kv, sense.x, sense.xd, task.x, task.xd, task.xdd)
        u_f = kf * error + ki * integral + kd * slowing
        torque = hybrid(model.J, model.Jdqd, model.M, model.h, task.s, u_x, task.f, u_f)
        return torque, SelfTuningState(memory, integral, rate, sense.f, Vec3(kf, ki, kd))

    def rest(self, state, sense):
        """What was learned stays."""
        nothing = 0.0 * self.kp
        return SelfTuningState(state.network, nothing, nothing, sense.f, state.gains)

    def report(self, state):
        """The integral's share of the force command; the gains kf, ki, kd."""
        return state.gains[1] * state.integral, state.gains


@law
def see(signals, error, integral, rate, scale):
    """Writes the network's three inputs."""
    signals[0], signals[1], signals[2] = error / scale[0], integral / scale[1], rate / scale[2]
