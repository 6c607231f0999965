"""One tick of the closed loop: sense, think, act, move. The same code runs compiled and, a tick at a time, plain."""

from typing import Any, NamedTuple

from palpate._jit import kernel, law, part
from palpate._vector import ZERO3, Vec3
from palpate.bench.estimators import Estimators, EstimatorsState
from palpate.bench.force_input import Conditioning, ConditioningState, ForceInput, ForceInputState
from palpate.bench.plant import Plant, PlantState, SurfaceTouch
from palpate.bench.sequence import CONTACT, Sequence, SequenceState, put
from palpate.controllers.resolved_acceleration import ResolvedAcceleration
from palpate.friction import Coulomb
from palpate.instruments import Converter, Encoder
from palpate.references import ForceSchedule
from palpate.signals.types import Task

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
    force: ForceInput
    output: Converter
    conditioning: Conditioning
    sequence: Sequence
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
    force: ForceInputState
    conditioning: ConditioningState
    sequence: SequenceState
    approach: float
    controller: Any
    estimators: EstimatorsState


@part
class Command(NamedTuple):
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
    return Command(wanted, applied), desired, approach, controller


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
