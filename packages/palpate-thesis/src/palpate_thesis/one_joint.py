"""A bench of one joint: a motor turns a lever that presses on a surface; and its direct neural force control.

Thesis, sec. 2.2, fig. 2.3 and 2.4; after Yabuta and Yamada. The network gives the torque.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from palpate._vector import clip
from palpate.bench import kernel, law, part
from palpate.bench.force_input import ForceInput, ForceInputState, force_input
from palpate.bench.tables import ForceSensorTable
from palpate.environments import KelvinVoigt, StandardLinearSolid, join
from palpate.environments.surface import Surface, SurfaceState, contact_force, follow, opposing
from palpate.friction import LuGre
from palpate.networks import Network, NetworkState, network, random_layers
from palpate.records import Record
from palpate.references import ForceSchedule
from palpate.signals.filters import Biquad, BiquadState, butterworth2

RATE, STEPS = 1000, 20
"""Ticks a second, and steps of the plant in a tick."""
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

    def run(self, duration: float, seed: int = 0, *, compiled: bool = True) -> Record:
        """Run from rest at the surface.

        Args:
            duration: [s].
            seed: of the noise; the same seed gives the same record, bit for bit.
            compiled: False runs the same code in plain Python.

        Returns:
            One row a tick; ``meta["end"]`` is "done", or "diverged" where numbers ceased to be finite.
        """
        noise = np.random.default_rng(seed).standard_normal(round(duration / self.loop.tick))
        rows = np.empty((len(noise), len(COLUMNS)))
        state = start_loop(self.loop)
        (compiled_march if compiled else march_joint)(self.loop, state, noise, rows)
        finite = np.isfinite(rows).all(axis=1)
        end = "done" if finite.all() else "diverged"
        rows = rows if finite.all() else rows[: int(np.argmin(finite))]
        columns = {name: rows[:, i].copy() for i, name in enumerate(COLUMNS)}
        return Record(columns, COLUMNS, {"seed": seed, "end": end})


JOINT_FRICTION = LuGre(1250.0, 11.0, 0.0, 0.25, 0.3, 0.01)  # type: ignore[arg-type]
"""Friction of joint 2 of the thesis' arm, chosen as the bench's [N m/rad, N m s/rad, N m, rad/s]."""


class Link(NamedTuple):
    """A joint and its motor; by default joint 2 of the thesis' arm, which presses where its experiments start.

    Args:
        friction: of the joint, in numbers instead of vectors.
        inertia: of link and rotor about the joint [kg m^2].
        lever: from the joint to the tip [m].
        limit: torque of the motor [N m].
    """

    friction: LuGre = JOINT_FRICTION
    inertia: float = 0.126
    lever: float = 0.113
    limit: float = 2.5


JOINT_2 = Link()


def one_joint(
    surface: KelvinVoigt | StandardLinearSolid,
    controller: Any,
    schedule: ForceSchedule,
    *,
    link: Link = JOINT_2,
    noise: float = 0.6,
) -> OneJoint:
    """A bench of one joint.

    Args:
        surface: that it presses.
        controller: `DirectNeural` or `DirectIntegral`.
        schedule: desired force.
        link: the joint and its motor.
        noise: standard deviation of a force sample [N].
    """
    force = force_input(ForceSensorTable(noise=noise), RATE * STEPS)
    joint = Joint(link.inertia, link.lever, link.friction, join(surface))
    smooth = butterworth2(120.0, float(RATE))
    return OneJoint(JointLoop(joint, force, smooth, schedule, controller, link.limit, 1.0 / RATE, STEPS))


INPUTS, HIDDEN = 4, 6
MAX_WEIGHT, MAX_TORQUE = 0.3, 9.8
"""Largest initial weight; largest output [N m], well above what is needed, because a flat sigmoid learns nothing."""


@part
class DirectNeuralState(NamedTuple):
    network: NetworkState
    f: float  # measured force of the tick before [N]
    torque: float  # of the tick before [N m]


@part
class DirectNeural(NamedTuple):
    """A network as the only controller: it learns the torque from the force error alone.

    Its inputs are the desired force, the measured one, that of the previous tick, and its own last torque.

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
        """Present integral gain [N m per N and sample]: what one step of learning adds to the torque."""
        return self.network.gain(state.network, 0)


@law
def see(signals, desired, f, f_before, torque):
    """Write the network's four inputs."""
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
        """Integral gain [N m per N and sample]."""
        return self.ki


def direct_neural(learning_rate: float = 5e-5, force: float = 20.0, seed: int = 0) -> DirectNeural:
    """A direct neural controller of 4-6-1 neurons with random weights.

    Args:
        learning_rate: eta.
        force: scale of the forces [N].
        seed: of the weights.

    Raises:
        InputError: a learning rate not above 0.
    """
    layers = random_layers((INPUTS, HIDDEN, 1), seed, MAX_WEIGHT)
    return DirectNeural(float(force), network(list(layers), MAX_TORQUE, learning_rate))
