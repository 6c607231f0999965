"""A bench of one joint: a motor turns a lever that presses on a surface; and its direct neural force control.

Thesis, sec. 2.2, fig. 2.3 and 2.4; after Yabuta and Yamada. The network gives the torque.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from palpate._jit import kernel, law, part
from palpate._vector import clip
from palpate.bench.force_input import ForceInput, ForceInputState, force_input
from palpate.bench.tables import ForceSensorTable
from palpate.environments import HuntCrossley, KelvinVoigt, StandardLinearSolid, join
from palpate.environments.surface import Surface, SurfaceState, contact_force, follow, opposing
from palpate.errors import InputError
from palpate.friction import LuGre
from palpate.networks import Network, NetworkState, network, random_layers
from palpate.records import Record
from palpate.references import ForceSchedule
from palpate.signals.filters import Biquad, BiquadState, butterworth2

COLUMNS = {
    "t": "s",
    "angle": "rad",
    "rate": "rad/s",
    "penetration": "m",
    "touching": "1",
    "force": "N",  # true, during the step before
    "force_sampled": "N",
    "force_measured": "N",  # filtered: what the controller sees
    "force_desired": "N",
    "torque": "N m",  # as applied
    "saturated": "1",
    "friction": "N m",
    "gain": "N m/N",  # integral gain of the controller, per sample
}


@part
class JointState(NamedTuple):
    q: float  # [rad]
    qd: float  # [rad/s]
    bristles: float  # of the friction [rad]
    surface: SurfaceState


@part
class JointTouch(NamedTuple):
    """Force and friction during a step."""

    force: float  # into the surface [N]
    friction: float  # torque lost [N m]


@part
class Joint(NamedTuple):
    """A lever that touches the surface at angle zero; small angles, so its tip moves by lever times angle.

    Args:
        inertia: about the joint [kg m^2].
        lever: from the joint to the tip [m].
        friction: of the joint, in numbers instead of vectors.
        surface: that the tip presses.
    """

    inertia: float
    lever: float
    friction: LuGre
    surface: Surface

    def start(self):
        """At rest, just not pressing."""
        return JointState(0.0, 0.0, self.friction.start(), self.surface.start())

    def advance(self, state, torque, dt):
        """The state after dt [s] under constant torque [N m], and what was felt; semi-implicit Euler."""
        tip_mass = self.inertia / (self.lever * self.lever)
        friction, bristles = self.friction.step(state.bristles, state.qd, dt)
        drive, surface, force = torque - friction, state.surface, 0.0
        if surface.contact == 1.0:
            elastic, opposed = opposing(
                self.surface, surface, self.lever * state.q, self.lever * state.qd, dt
            )
            force = contact_force(elastic, opposed, tip_mass, self.lever * drive / self.inertia)
        qd = state.qd + dt * (drive - self.lever * max(force, 0.0)) / self.inertia
        q = state.q + dt * qd
        p, v = self.lever * q, self.lever * qd
        surface, impulse = follow(self.surface, surface, force, p, v, tip_mass, dt)
        qd -= self.lever * impulse / self.inertia
        return JointState(q, qd, bristles, surface), JointTouch(max(force, 0.0) + impulse / dt, friction)


@part
class JointLoop(NamedTuple):
    """Everything that a tick needs.

    Args:
        joint: the plant.
        force: the force's way into the controller.
        filter: of the sampled force.
        schedule: desired force.
        controller: ``step(state, desired, f, x) -> (torque, state)``, x the depth [m], and ``gain(state)``.
        limit: largest torque of the motor [N m].
        tick: [s].
        steps: of the plant between ticks.
    """

    joint: Joint
    force: ForceInput
    filter: Biquad
    schedule: ForceSchedule
    controller: Any
    limit: float
    tick: float
    steps: int


@part
class JointLoopState(NamedTuple):
    joint: JointState
    felt: JointTouch
    force: ForceInputState
    filter: BiquadState
    controller: Any


@law
def start_loop(loop):
    """At rest, just not pressing."""
    filtered = loop.filter.start_at(0.0)
    return JointLoopState(
        loop.joint.start(), JointTouch(0.0, 0.0), loop.force.start(), filtered, loop.controller.start()
    )


@law
def tick(loop, state, k, noise, out):
    """The k-th tick: the new state; its row is written into `out`. `noise`: one standard normal number."""
    sampled = loop.force.reading(state.force)
    measured, filtered = loop.filter.step(state.filter, sampled)
    desired = loop.schedule.force(k * loop.tick)
    wanted, controller = loop.controller.step(
        state.controller, desired, measured, loop.joint.lever * state.joint.q
    )
    torque = clip(wanted, loop.limit)
    joint, felt = state.joint, state.felt
    out[0], out[1], out[2], out[3] = k * loop.tick, joint.q, joint.qd, loop.joint.lever * joint.q
    out[4], out[5], out[6], out[7], out[8] = joint.surface.contact, felt.force, sampled, measured, desired
    out[9], out[10], out[11] = torque, 1.0 if abs(wanted) > loop.limit else 0.0, felt.friction
    out[12] = loop.controller.gain(controller)
    force, dt = state.force, loop.tick / loop.steps
    for j in range(loop.steps):
        joint, felt = loop.joint.advance(joint, torque, dt)
        force = loop.force.advance(force, felt.force, k * loop.steps + j, noise)
    return JointLoopState(joint, felt, force, filtered, controller)


@law
def march_joint(loop, state, noise, out):
    """len(noise) ticks; row i of `out` is tick i."""
    for i in range(len(noise)):
        state = tick(loop, state, i, noise[i], out[i])
    return state


compiled_march = kernel(march_joint)


@dataclass(frozen=True)
class OneJoint:
    """A bench of one joint, ready to run; `one_joint` makes it."""

    loop: JointLoop

    def run(self, duration: float, seed: int = 0, *, gap: float = 0.0, compiled: bool = True) -> Record:
        """Runs from rest at the surface, or before it.

        Args:
            duration: [s].
            seed: of the noise; the same seed gives the same record, bit for bit.
            gap: between tip and surface at the start [m].
            compiled: False runs the same code in plain Python.

        Returns:
            One row a tick; ``meta["end"]`` is "done", or "diverged" where numbers ceased to be finite.

        Raises:
            InputError: a duration that is not positive.
        """
        if not duration >= self.loop.tick:
            raise InputError(f"duration must be at least one tick ({self.loop.tick} s), got {duration}")
        noise = np.random.default_rng(seed).standard_normal(round(duration / self.loop.tick))
        rows = np.empty((len(noise), len(COLUMNS)))
        state = start_loop(self.loop)
        state = state._replace(joint=state.joint._replace(q=-gap / self.loop.joint.lever))
        (compiled_march if compiled else march_joint)(self.loop, state, noise, rows)
        finite = np.isfinite(rows).all(axis=1)
        end = "done" if finite.all() else "diverged"
        rows = rows if finite.all() else rows[: int(np.argmin(finite))]
        columns = {name: rows[:, i].copy() for i, name in enumerate(COLUMNS)}
        told = {"force": self.loop.force.description(), "position": {"lag_s": 0.0}}
        return Record(columns, COLUMNS, {"seed": seed, "end": end, "instruments": told})


#: Joint 2 of the thesis' arm: its friction, chosen as the bench's. [N m/rad], [N m s/rad], [N m], [rad/s]
JOINT_FRICTION = LuGre(1250.0, 11.0, 0.0, 0.25, 0.3, 0.01)  # type: ignore[arg-type]


def require_positive(**numbers: float) -> None:
    """Refuses numbers that are not above 0, by their names."""
    for name, value in numbers.items():
        if not value > 0:
            raise InputError(f"{name} must be above 0, got {value}")


@dataclass(frozen=True)
class Link:
    """A joint and its motor; by default joint 2 of the thesis' arm, the one that presses where its experiments start.

    Args:
        friction: of the joint, in numbers.
        inertia: of link and rotor about the joint [kg m^2].
        lever: [m].
        limit: torque of the motor [N m].

    Raises:
        InputError: a number that is not above 0.
    """

    friction: LuGre = JOINT_FRICTION
    inertia: float = 0.126
    lever: float = 0.113
    limit: float = 2.5

    def __post_init__(self) -> None:
        require_positive(inertia=self.inertia, lever=self.lever, limit=self.limit)


JOINT_2 = Link()


def one_joint(
    surface: KelvinVoigt | StandardLinearSolid | HuntCrossley,
    controller: Any,
    schedule: ForceSchedule,
    *,
    link: Link = JOINT_2,
    noise: float = 0.6,
    rate: int = 1000,
    steps: int = 20,
) -> OneJoint:
    """A bench of one joint.

    Args:
        surface: that it presses.
        controller: `DirectNeural`, `DirectIntegral` or one of the user's own.
        schedule: desired force.
        link: the joint and its motor.
        noise: standard deviation of a force sample [N].
        rate: ticks a second.
        steps: of the plant between ticks.
    """
    require_positive(rate=rate, steps=steps)
    force = force_input(ForceSensorTable(noise=noise), rate * steps)
    joint = Joint(float(link.inertia), float(link.lever), link.friction.validate(), join(surface))
    smooth, limit = butterworth2(120.0, float(rate)), float(link.limit)
    return OneJoint(JointLoop(joint, force, smooth, schedule, controller, limit, 1.0 / rate, int(steps)))


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

    def step(self, state, desired, f, x):
        """Torque [N m] for the desired and the measured force [N]; learns on the way."""
        net, memory, scale = self.network, state.network, self.force
        before = state.torque / net.amplitude[0]
        see(memory.signals, desired / scale, f / scale, state.f / scale, before)
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

    def step(self, state, desired, f, x):
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
