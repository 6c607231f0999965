"""The plant between two ticks: the arm, one elastic mode of it, its friction and the surface.

The mode is the deflection of the tip along x, between the pose of the joints and the actual one.
"""

import math
from typing import Any, NamedTuple

from palpate._jit import kernel, law, part
from palpate._vector import ZERO3, Vec3, solve
from palpate.bench import force_input
from palpate.bench.estimators import Estimators, EstimatorsState
from palpate.bench.force_input import put
from palpate.bench.summary import CONTACT
from palpate.controllers.hybrid import ResolvedAcceleration
from palpate.environments.stick_slip import StickSlip, StickSlipState
from palpate.environments.surface import Surface, SurfaceState, contact_force, follow, opposing
from palpate.friction import Coulomb, LuGre
from palpate.instruments import Converter, Encoder
from palpate.references import ForceSchedule
from palpate.robots.arm3 import Arm3
from palpate.signals.types import Task


@part
class ElasticState(NamedTuple):
    bend: float  # of the tip beyond where the joints put it [m]
    rate: float  # [m/s]


@part
class ElasticMode(NamedTuple):
    """A modal mass on a spring and a damper that the contact force drives: d'' + 2 zeta w d' + w^2 d = -mobility f.

    The joints' encoders do not see it. In modal coordinates the rigid arm feels the contact force as before; that
    torques excite the mode too is left out.

    Args:
        mobility: one over the modal mass [1/kg]; 0 makes a rigid arm.
        frequency: w, undamped [rad/s].
        damping: zeta.
    """

    mobility: float
    frequency: float
    damping: float

    def start(self):
        return ElasticState(0.0, 0.0)

    def acceleration(self, state):
        """Acceleration by spring and damper [m/s^2]."""
        return -self.frequency * (2.0 * self.damping * state.rate + self.frequency * state.bend)

    def step(self, state, acceleration, dt):
        """The state after dt [s]; semi-implicit Euler, as the arm's."""
        rate = state.rate + dt * acceleration
        return ElasticState(state.bend + dt * rate, rate)

    def after_impulse(self, state, impulse):
        """The state after an impulse [N s] of the surface."""
        return ElasticState(state.bend, state.rate - self.mobility * impulse)


RIGID = ElasticMode(0.0, 0.0, 0.0)


def elastic_mode(stiffness: float, frequency: float, damping: float) -> ElasticMode:
    """The mode that gives way by 1/stiffness [m/N] at rest and swings at a frequency [Hz] with a damping ratio."""
    w = 2.0 * math.pi * frequency
    return ElasticMode(w * w / stiffness, w, float(damping))


@part
class PlantState(NamedTuple):
    q: Vec3  # joint angles [rad]
    qd: Vec3  # joint rates [rad/s]
    bristles: Vec3  # of the joints' friction [rad]
    surface: SurfaceState
    side: StickSlipState  # friction along the surface
    bent: ElasticState  # of the arm along x


@part
class SurfaceTouch(NamedTuple):
    """Force of the tip on the surface during a step."""

    normal: float  # into the surface [N], never negative
    tangential: float  # along y [N]
    penetration: float  # of the tip [m], negative in free motion
    friction: Vec3  # torque lost in the joints [N m]
    inertial: float = 0.0  # force that what lies beyond the force sensor takes to be moved [N]
    rate: float = 0.0  # of the tip along x [m/s]


@part
class Plant(NamedTuple):
    """A planar arm before a wall at x = `wall` that it can press in the direction of +x.

    Args:
        arm: with its rotors (`Arm3.with_rotors`).
        friction: of the joints.
        surface: along its normal.
        side: friction along it.
        wall: x of the undeformed surface [m].
        mode: in which the arm gives way along x, between its joints and its tip.
        beyond: mass between force sensor and tip, part of the arm's own [kg].
    """

    arm: Arm3
    friction: LuGre
    surface: Surface
    side: StickSlip
    wall: float
    mode: ElasticMode = RIGID
    beyond: float = 0.0

    def start_at(self, q):
        """State at rest in free motion, at the joint angles q."""
        return PlantState(
            q,
            0.0 * q,
            self.friction.start(),
            self.surface.start(),
            self.side.start(),
            self.mode.start(),
        )

    def advance(self, state, torque, dt):
        """The state after dt [s] under constant torque [N m], and what was felt; semi-implicit Euler, first order.

        The surface's mass moves with the tip while they touch, so the contact force is solved together with the
        acceleration: it is the one that leaves both with the same acceleration. Rates are those half a step before
        the angles; the force is that of p and of the rate and acceleration that p has at that moment, so that
        f = K p + B p' + M p'' holds in central differences of p (what is left, a part in a million at 50 us, is
        the centripetal acceleration, taken at the rates of half a step before).
        """
        model = self.arm.model(state.q, state.qd)
        normal, along = model.J.r1, model.J.r2
        bent = state.bent
        p = self.arm.pose(state.q).x + bent.bend - self.wall
        friction, bristles = self.friction.step(state.bristles, state.qd, dt)
        drive = torque - model.h - friction
        per_normal = solve(model.M, normal)
        tip_mass = 1.0 / (normal @ per_normal + self.mode.mobility)
        springs_back = self.mode.acceleration(bent)
        surface, side, force, slide = state.surface, state.side, 0.0, 0.0
        if surface.contact == 1.0:
            # The normal force before friction along the surface: its share in f is second order.
            elastic, opposed = opposing(
                self.surface, surface, p, normal @ state.qd + bent.rate - 0.5 * dt * model.Jdqd.x, dt
            )
            a = normal @ solve(model.M, drive) + model.Jdqd.x + springs_back
            force = contact_force(elastic, opposed, tip_mass, a)
            slide, side = self.side.slide(side, along @ state.qd, force, dt)
            drive += along * slide
            a = normal @ solve(model.M, drive) + model.Jdqd.x + springs_back
            force = contact_force(elastic, opposed, tip_mass, a)
        qdd = solve(model.M, drive) - per_normal * max(force, 0.0)
        qd = state.qd + dt * qdd
        q = state.q + dt * qd
        bent = self.mode.step(bent, springs_back - self.mode.mobility * max(force, 0.0), dt)
        p = self.arm.pose(q).x + bent.bend - self.wall
        v = normal @ qd + bent.rate
        if force < 0.0:
            side = self.side.start()
        surface, impulse = follow(self.surface, surface, force, p, v, tip_mass, dt)
        qd -= per_normal * impulse
        bent = self.mode.after_impulse(bent, impulse)
        after = normal @ qd + bent.rate
        inertial = self.beyond * ((after - normal @ state.qd - state.bent.rate) / dt + model.Jdqd.x)
        felt = SurfaceTouch(max(force, 0.0) + impulse / dt, -slide, p, friction, inertial, after)
        return PlantState(q, qd, bristles, surface, side, bent), felt


ALONG_X = Vec3(1.0, 0.0, 0.0)


@part
class Loop(NamedTuple):
    """Everything that a tick needs, by value.

    Args:
        start: pose at the start [m, m, rad]; y and phi are held.
        plant: arm, friction and surface.
        encoder, force, output: the instruments: joint angles, force, torque.
        conditioning: the controller's signals.
        sequence: phases.
        schedule: desired force in contact.
        approach: controller outside contact.
        controller: controller in contact.
        compensation: of friction, added in both.
        estimators: of M, B, K; they watch and do not act.
        tick: [s].
        steps: of the plant between ticks.
    """

    start: Vec3
    plant: Plant
    encoder: Encoder
    force: force_input.ForceInput
    output: Converter
    conditioning: force_input.Conditioning
    sequence: force_input.Sequence
    schedule: ForceSchedule
    approach: ResolvedAcceleration
    controller: Any
    compensation: Coulomb
    estimators: Estimators
    tick: float
    steps: int


@part
class LoopState(NamedTuple):
    plant: PlantState
    felt: SurfaceTouch  # during the step before this tick
    force: force_input.ForceInputState
    conditioning: force_input.ConditioningState
    sequence: force_input.SequenceState
    approach: float
    controller: Any
    estimators: EstimatorsState


@part
class DriveCommand(NamedTuple):
    """A torque before and after its limits."""

    wanted: Vec3  # torque that the control law asks for [N m]
    applied: Vec3  # torque after limits and converter [N m]


@law
def start_at(loop, q):
    """The loop at rest in free motion, at joint angles q [rad]."""
    seen = loop.encoder.read(q)
    conditioning = loop.conditioning.start_at(seen)
    return LoopState(
        loop.plant.start_at(q),
        SurfaceTouch(0.0, 0.0, loop.plant.arm.pose(q).x - loop.plant.wall, ZERO3, 0.0, 0.0),
        loop.force.start(),
        conditioning,
        loop.sequence.start(),
        loop.approach.start(),
        loop.controller.start(),
        loop.estimators.start_at(conditioning.x.x),
    )


@law
def think(loop, state, signals, sequence):
    """Torque command and the controllers' states, from the measurements."""
    sense, pressing = signals.sense, sequence.phase == CONTACT
    arm = loop.conditioning.arm
    model = arm.model(sense.q, sense.qd)
    desired = loop.schedule.force(sequence.since) if pressing else 0.0
    at = Vec3(sequence.x_d, loop.start.y, loop.start.z)
    approach, controller = state.approach, state.controller
    if pressing:
        task = Task(at, ZERO3, ZERO3, desired * ALONG_X, ALONG_X)
        wanted, controller = loop.controller.step(controller, sense, task, model)
    else:
        task = Task(at, ZERO3, ZERO3, ZERO3, ZERO3)
        wanted, approach = loop.approach.step(approach, sense, task, model)
        controller = loop.controller.rest(controller, sense)
    wanted += loop.compensation.torque(sense.qd)
    applied = loop.output.convert_within(wanted, arm.limits)
    return DriveCommand(wanted, applied), desired, approach, controller


@law
def move(loop, plant, force, torque, k, noise):
    """Plant and force sensor through the steps up to the next tick."""
    dt = loop.tick / loop.steps
    felt = SurfaceTouch(0.0, 0.0, 0.0, ZERO3, 0.0, 0.0)
    for j in range(loop.steps):
        plant, felt = loop.plant.advance(plant, torque, dt)
        rough = noise * (1.0 + loop.force.roughness * abs(felt.rate))
        force = loop.force.advance(force, felt.normal + felt.inertial, k * loop.steps + j, rough)
    return plant, felt, force


@law
def tick(loop, state, k, noise, out):
    """One tick, the k-th: the new state; its row is written into `out`. `noise`: one standard normal number."""
    q = loop.encoder.read(state.plant.q)
    sampled = loop.force.reading(state.force)
    signals, conditioning = loop.conditioning.step(state.conditioning, q, sampled)
    sequence = loop.sequence.step(state.sequence, signals.sense.x.x, signals.sense.f.x)
    estimators = loop.estimators.step(state.estimators, signals, sequence.phase == CONTACT, sequence.x0)
    command, desired, approach, controller = think(loop, state, signals, sequence)
    inside = loop.controller.report(controller)
    write(loop, state, k, signals, sequence, command, desired, estimators, inside, out)
    plant, felt, force = move(loop, state.plant, state.force, command.applied, k, noise)
    return LoopState(plant, felt, force, conditioning, sequence, approach, controller, estimators)


@law
def write(loop, state, k, signals, sequence, command, desired, estimators, inside, out):
    """The row of a tick, in the order of `row.COLUMNS`."""
    plant, felt, sense = state.plant, state.felt, signals.sense
    out[0], out[1] = k * loop.tick, sequence.phase
    at = put(out, 2, plant.q)
    at = put(out, at, plant.qd)
    at = put(out, at, loop.plant.arm.pose(plant.q))
    at = put(out, at, sense.x)
    at = put(out, at, sense.xd)
    at = put(out, at, Vec3(signals.velocity, signals.acceleration, signals.smooth_acceleration))
    at = put(out, at, Vec3(sequence.x_d, loop.start.y, loop.start.z))
    at = put(out, at, Vec3(felt.normal, felt.tangential, signals.force))
    out[at], out[at + 1] = sense.f.x, desired
    at = put(out, at + 2, command.applied)
    at = put(out, at, beyond(command.wanted, loop.conditioning.arm.limits))
    at = put(out, at, felt.friction)
    pressing = sequence.phase == CONTACT
    out[at], out[at + 1] = felt.penetration, plant.surface.contact
    out[at + 2] = sense.x.x - sequence.x0 if pressing else 0.0
    at = put(out, at + 3, estimators.thesis.theta)
    at = put(out, at, estimators.raw.theta)
    at = put(out, at, estimators.matched.theta)
    at = put(out, at, estimators.matched.std())
    at = put(out, at, inside[0])
    put(out, at, inside[1])


@law
def beyond(a, limit):
    """1 for each component outside its limit, else 0."""
    return Vec3(
        1.0 if abs(a.x) > limit.x else 0.0,
        1.0 if abs(a.y) > limit.y else 0.0,
        1.0 if abs(a.z) > limit.z else 0.0,
    )


@law
def march(loop, state, k, noise, out):
    """len(noise) ticks, the first being the k-th; row i of `out` is tick k + i."""
    for i in range(len(noise)):
        state = tick(loop, state, k + i, noise[i], out[i])
    return state


compiled_march = kernel(march)
