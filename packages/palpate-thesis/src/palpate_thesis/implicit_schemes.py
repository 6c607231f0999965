"""Schemes that learn an unknown surface without a number for it, on the whole arm (thesis, sec. 2.3, its [25]-[27]).

The thesis names them in a sentence each; the laws are those of their kind, the numbers are ours.
"""

import math
from typing import Any, NamedTuple

from palpate._jit import law, part
from palpate._vector import ZERO3, Vec3, clip, exp, resolve
from palpate.controllers import AnyController, Impedance, controller
from palpate.controllers.hybrid import hybrid
from palpate.controllers.resolved_acceleration import position_command
from palpate.networks import Network, NetworkState, network, random_layers
from palpate.signals.types import alike

MODULUS = 2147483647.0


@law
def rule(error, rate):
    """Output in [-1, 1] of fuzzy rules on two inputs in [-1, 1]: seven triangular labels each, output i + j of seven.

    Product inference and the centroid of singletons (Sugeno), which is the bilinear interpolation of the rules' table.
    """
    a, b = clip(3.0 * error, 3.0), clip(3.0 * rate, 3.0)
    i, j = min(math.floor(a), 2.0), min(math.floor(b), 2.0)
    a, b = a - i, b - j
    low, middle, high = clip(i + j, 3.0), clip(i + j + 1.0, 3.0), clip(i + j + 2.0, 3.0)
    return ((1.0 - a) * (1.0 - b) * low + (a + b - 2.0 * a * b) * middle + a * b * high) / 3.0


@part
class FuzzyState(NamedTuple):
    compensation: float  # [N]
    rate: float  # smoothed, of the measured force [N/s]
    f: float  # measured force of the tick before [N]


@controller
class FuzzyCompensation(NamedTuple):
    """`Hybrid`, with fuzzy rules on the force error and its rate in the place of the integral (after Xu et al.).

    Args:
        kp, kv: position gains K_pp [1/s^2] and K_pv [1/s], shape (3,).
        kf: force gain K_fp [1].
        error: force error at which the last label is reached [N].
        rate: force rate at which it is [N/s].
        push: largest change of the compensation [N/s].
        smoothing: time constant of the force rate [s].
        tick: time between steps [s].
    """

    kp: Vec3 = alike(400.0)
    kv: Vec3 = alike(80.0)
    kf: float = 0.25
    error: float = 10.0
    rate: float = 100.0
    push: float = 50.0
    smoothing: float = 0.01
    tick: float = 1e-3

    def start(self):
        return FuzzyState(0.0, 0.0, 0.0)

    def step(self, state, sense, task, model):
        f = task.s @ sense.f
        error = task.s @ task.f - f
        rate = state.rate + (f - state.f - self.tick * state.rate) / self.smoothing
        compensation = state.compensation + self.tick * self.push * rule(
            error / self.error, -rate / self.rate
        )
        u_x = position_command(self.kp, self.kv, sense.x, sense.xd, task.x, task.xd, task.xdd)
        u_f = (self.kf * error + compensation) * task.s
        torque = hybrid(model.J, model.Jdqd, model.M, model.h, task.s, u_x, task.f, u_f)
        return torque, FuzzyState(compensation, rate, f)

    def rest(self, state, sense):
        """Keeps the compensation between contacts."""
        return FuzzyState(state.compensation, 0.0, sense.f.x)

    def report(self, state):
        """The compensation as a force."""
        return Vec3(state.compensation, 0.0, 0.0), ZERO3


@part
class FeedbackErrorState(NamedTuple):
    network: NetworkState
    torque: Vec3  # of the network [N m]


@controller
class FeedbackErrorNetwork(NamedTuple):
    """A network beside the feedback learns each joint's torque; its error is the feedback's own torque (Gomi, Kawato).

    It becomes the inverse model of arm and surface as far as the feedback needs one. It sees the desired force and the
    joint angles.

    Args:
        kp, kv: position gains K_pp [1/s^2] and K_pv [1/s], shape (3,).
        kf: force gain K_fp [1], shape (3,).
        force: scale of the desired force at the network's input [N].
        network: of 4 inputs and 3 outputs [N m]; `feedback_error_learning` makes it.
    """

    kp: Vec3
    kv: Vec3
    kf: Vec3
    force: float
    network: Network

    def start(self):
        return FeedbackErrorState(self.network.start(), ZERO3)

    def step(self, state, sense, task, model):
        u_x = (1.0 - task.s) * position_command(
            self.kp, self.kv, sense.x, sense.xd, task.x, task.xd, task.xdd
        )
        feedback = model.M @ resolve(model.J, u_x, model.M) + model.J.T @ (
            self.kf * task.s * (task.f - sense.f)
        )
        net, memory = self.network, state.network
        see(memory.signals, task.s @ task.f / self.force, sense.q)
        net.forward(memory)
        torque = Vec3(net.output(memory, 0), net.output(memory, 1), net.output(memory, 2))
        net.want(memory, 0, feedback.x)
        net.want(memory, 1, feedback.y)
        net.want(memory, 2, feedback.z)
        net.learn(memory)
        known = hybrid(model.J, model.Jdqd, model.M, model.h, task.s, ZERO3, task.f, ZERO3)
        return known + feedback + torque, FeedbackErrorState(memory, torque)

    def rest(self, state, sense):
        """Keeps the learned weights."""
        return FeedbackErrorState(state.network, ZERO3)

    def report(self, state):
        """The network's torques [N m]; its integral gains per sample, joint by joint."""
        net, memory = self.network, state.network
        return state.torque, Vec3(net.gain(memory, 0), net.gain(memory, 1), net.gain(memory, 2))


@law
def see(signals, force, q):
    """Writes the network's four inputs."""
    signals[0], signals[1], signals[2], signals[3] = force, q.x, q.y, q.z


@part
class SearchState(NamedTuple):
    stiffness: Vec3  # weights of ln(k / k_0) on the context
    damping: Vec3  # of ln(b / b_0)
    expected: Vec3  # of the cost [N]
    tried: Vec3  # what this trial adds to both logarithms; the third is none
    cost: float  # of the trial so far: sum of the force error's size [N]
    ticks: float  # of the trial so far
    seed: float  # of the random numbers


@controller
class ImpedanceSearch(NamedTuple):
    """`Impedance` whose stiffness and damping an associative search network finds by trial (after Cohen and Flash).

    Two stochastic units give ln(k / k_0) and ln(b / b_0) for a context, the desired force; each trial adds random
    numbers. A trial whose force error is below the one expected in its context makes what it tried likelier (Barto,
    Sutton and Brouwer, 1981, with the expected cost as comparison).

    Args:
        impedance: that it starts from.
        force: middle of the desired forces [N].
        period: of a trial [s].
        after: what of a trial is over before its cost counts [s].
        rate: of the search [1/N]; a cost is off by 1 N at most.
        spread: largest random number, for each newton that the cost is expected to be [1/N].
        learning: of the expected cost, per trial.
        seed: of the random numbers, a whole number above 0.
        tick: time between steps [s].
    """

    impedance: Impedance
    force: float = 15.0
    period: float = 0.5
    after: float = 0.2
    rate: float = 0.4
    spread: float = 0.07
    learning: float = 0.2
    seed: float = 1.0
    tick: float = 1e-3

    def start(self):
        return SearchState(ZERO3, ZERO3, Vec3(5.0, 0.0, 0.0), ZERO3, 0.0, 0.0, self.seed)

    def context(self, desired):
        """The units' inputs: 1, and by how much the desired force is off the middle."""
        return Vec3(1.0, desired / self.force - 1.0, 0.0)

    def step(self, state, sense, task, model):
        context, own = self.context(task.s @ task.f), self.impedance
        stiffness, damping, expected, tried, cost, ticks, seed = state
        k = own.stiffness * (1.0 + task.s * (exp(stiffness @ context + tried.x) - 1.0))
        b = own.damping * (1.0 + task.s * (exp(damping @ context + tried.y) - 1.0))
        tuned = Impedance(own.mass, b, k, own.target)
        torque, _ = tuned.step(0.0, sense, task, model)
        counts = 1.0 if ticks * self.tick >= self.after else 0.0
        cost += counts * abs(task.s @ (task.f - sense.f))
        if (ticks + 1.0) * self.tick < self.period:
            return torque, SearchState(stiffness, damping, expected, tried, cost, ticks + 1.0, seed)
        better = expected @ context - cost / ((self.period - self.after) / self.tick)
        gain = self.rate * clip(better, 1.0)
        first = 16807.0 * seed % MODULUS
        second = 16807.0 * first % MODULUS
        stiffness += (gain * tried.x) * context
        damping += (gain * tried.y) * context
        expected -= (self.learning * better / (context @ context)) * context
        width = self.spread * max(expected @ context, 0.0)
        tried = width * Vec3(2.0 * first / MODULUS - 1.0, 2.0 * second / MODULUS - 1.0, 0.0)
        return torque, SearchState(stiffness, damping, expected, tried, 0.0, 0.0, second)

    def rest(self, state, sense):
        """Keeps what it has learned; the trial begins anew."""
        return SearchState(state.stiffness, state.damping, state.expected, state.tried, 0.0, 0.0, state.seed)

    def report(self, state):
        """No force; weights of ln(k / k_0), and the expected cost."""
        return ZERO3, Vec3(state.stiffness.x, state.stiffness.y, state.expected.x)


def feedback_error_learning(rate: float = 2e-3, hidden: int = 6, seed: int = 0) -> FeedbackErrorNetwork:
    """Feedback-error learning from small random weights.

    Args:
        rate: eta.
        hidden: neurons of the hidden layer.
        seed: of the weights.
    """
    net = network(random_layers((4, hidden, 3), seed, 0.1), 6.0, rate)
    return FeedbackErrorNetwork(alike(400.0), alike(80.0), alike(0.25), 20.0, net)


def impedance_search(target: float, seed: int = 0) -> ImpedanceSearch:
    """The search from the impedance of figure 2.2.

    Args:
        target: desired x, beyond the surface [m].
        seed: of the random numbers.
    """
    start = Impedance(
        Vec3(5.0, 11.0, 0.25), Vec3(600.0, 880.0, 20.0), Vec3(2000.0, 4400.0, 100.0), Vec3(target, 0.0, 0.0)
    )
    return ImpedanceSearch(start, seed=1.0 + seed)


def one_loop(scheme: Any) -> AnyController:
    """The scheme as one type with the others, so that one compiled loop serves all three."""
    fuzzy, learning, search = (
        scheme if isinstance(scheme, type(other)) else other
        for other in (FuzzyCompensation(), feedback_error_learning(), impedance_search(0.0))
    )
    rest = AnyController(int(scheme is learning), learning, search)
    return AnyController(int(scheme is fuzzy), fuzzy, rest)
