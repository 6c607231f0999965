"""From an experiment's numbers to the parts of a loop."""

from __future__ import annotations

import math
from functools import partial

import msgspec
import numpy as np

from palpate._vector import Mat3, Vec3, diagonal
from palpate.arrays import Array
from palpate.bench.bench import Bench
from palpate.bench.conditioning import Conditioning
from palpate.bench.elastic_mode import RIGID, elastic_mode
from palpate.bench.estimators import Estimators
from palpate.bench.experiments.consistency import check, matched_delay
from palpate.bench.experiments.tables import Experiment
from palpate.bench.force_reading import force_input
from palpate.bench.matched_channels import Centring, Matched
from palpate.bench.plant import Plant
from palpate.bench.sequence import Sequence
from palpate.bench.tick import Loop
from palpate.controllers import ResolvedAcceleration, controller_of
from palpate.environments import StickSlip, surface_of
from palpate.errors import InputError
from palpate.friction import Coulomb, LuGre
from palpate.identifiers.kernels.least_squares import LeastSquares
from palpate.instruments import Converter, Encoder
from palpate.references import NO_WAVE, Approach, Chirp, ForceSchedule, Multisine
from palpate.robots.arm3 import MOTOR_TORQUE, Arm3
from palpate.signals.filters import butterworth2, butterworth3, delay, state_variable
from palpate.signals.types import alike, triple


def build(experiment: Experiment) -> Bench:
    """The bench of an experiment.

    Raises:
        InputError: a start pose out of reach, a wall behind the arm's start, inconsistent numbers.
    """
    e = experiment
    check(e)
    arm = Arm3(limits=triple(e.robot.torque_limits), rotor=triple(e.robot.rotor_inertia))
    q = _start(arm, e)
    rate, tick = float(e.run.rate), 1.0 / e.run.rate
    force = force_input(e.force_sensor, e.run.rate * e.run.steps)
    loop = Loop(
        start=triple(e.robot.start),
        plant=_plant(arm, e),
        encoder=Encoder(triple(e.encoders.counts), q),
        force=force,
        output=Converter(12, MOTOR_TORQUE),
        conditioning=Conditioning(
            arm, butterworth2(e.filters.motion, rate), butterworth2(e.filters.force, rate), tick
        ),
        sequence=_sequence(e, tick),
        schedule=_schedule(e),
        approach=ResolvedAcceleration(alike(e.approach.kp), alike(e.approach.kv)),
        controller=controller_of(e.controller, tick, e.wall.x),
        compensation=Coulomb(triple(e.compensation.level), triple(e.compensation.blend)),
        estimators=_estimators(e, rate, matched_delay(e, force)),
        tick=tick,
        steps=e.run.steps,
    )
    meta = {"experiment": msgspec.to_builtins(e), "truth": _truth(loop)}
    return Bench(
        loop, q, meta, e.run.losses, None if e.identifier is None else partial(e.identifier.made, tick)
    )


def _start(arm: Arm3, e: Experiment) -> Vec3:
    pose = triple(e.robot.start)
    beyond = arm.beyond_reach(pose)
    if beyond > 0.0:
        raise InputError(
            f"start in [robot] is out of reach by {1e3 * beyond:.1f} mm, got {list(pose)}; move it"
        )
    if pose.x > e.wall.x:
        raise InputError(
            f"the wall at x = {e.wall.x} m in [wall] lies behind the arm's start at x = {pose.x} m in [robot]; "
            "move one of them"
        )
    return arm.inverse(pose, float(e.robot.elbow))


def _plant(arm: Arm3, e: Experiment) -> Plant:
    f = e.friction
    friction = LuGre(
        triple(f.bristle_stiffness),
        triple(f.bristle_damping),
        triple(f.viscous),
        triple(f.coulomb),
        triple(f.static),
        triple(f.stribeck),
        float(f.asymmetry),
    ).checked()
    side = StickSlip(e.wall.side_stiffness, e.wall.side_damping, e.wall.side_friction)
    mode = RIGID if e.elastic is None else elastic_mode(**msgspec.structs.asdict(e.elastic))
    beyond = float(e.force_sensor.beyond)
    return Plant(arm.with_rotors(), friction, surface_of(e.surface), side, float(e.wall.x), mode, beyond)


def _sequence(e: Experiment, tick: float) -> Sequence:
    a = e.approach
    reference = Approach(float(e.robot.start[0]), a.hold, a.first, a.step, a.period)
    return Sequence(Approach(*map(float, reference)), float(a.switch), float(a.release), float(a.wait), tick)


def _schedule(e: Experiment) -> ForceSchedule:
    f = e.force
    second = f.first if f.second is None else f.second
    steps = ForceSchedule(*map(float, (f.first, second, f.period, f.amplitude, f.frequency, f.restart)))
    return steps._replace(wave=_wave(e), rate=float(e.run.rate))


def _wave(e: Experiment) -> Array:
    """Chirp and multisine, tick by tick: the one as long as it lasts, the other as long as a run may."""
    chirp, multisine, rate = e.force.chirp, e.force.multisine, e.run.rate
    if chirp is None and multisine is None:
        return NO_WAVE
    longest = e.run.duration if chirp is None or multisine is not None else min(chirp.seconds, e.run.duration)
    time = np.arange(math.floor(longest * rate) + 1) / rate
    wave = np.zeros(len(time))
    if chirp is not None:
        wave += Chirp(**msgspec.structs.asdict(chirp)).at(time)
    if multisine is not None:
        wave += Multisine(**msgspec.structs.asdict(multisine)).at(time)
    return wave


def _estimators(e: Experiment, rate: float, late: float) -> Estimators:
    i, s = e.identification, e.force_sensor
    P: Mat3 = diagonal(alike(i.covariance))
    forgetting = float(i.forgetting)
    thesis = LeastSquares(triple(i.initial), P, forgetting)
    sensor = butterworth3(s.cutoff, rate)
    front = Matched(
        sensor.second,
        sensor.first,
        delay(late, rate),  # computing, holding, and what the filter's model at this rate lacks
        state_variable(i.cutoff, rate),
    )
    matched = LeastSquares(alike(0.0), P, forgetting)
    return Estimators(thesis, thesis, matched, front, Centring(forgetting), float(i.touch))


def _truth(loop: Loop) -> dict[str, dict[str, object]]:
    surface = loop.plant.surface
    if not hasattr(surface, "truth"):  # one of the user's that does not say it
        return {}
    return {name: {"value": value, "unit": unit} for name, (value, unit) in surface.truth().items()}
