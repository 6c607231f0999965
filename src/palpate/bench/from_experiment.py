"""Builds the parts of a loop from an experiment's numbers.

Here the numbers are checked against each other; each number alone is checked where it is read.

The user's parts are tried before the first run: an error is reported once, not by every run.
"""

import math
from collections.abc import Callable
from functools import partial
from typing import Any

import msgspec
import numpy as np

from palpate._vector import Mat3, Vec3, diagonal
from palpate.arrays import Array
from palpate.bench.bench import Bench
from palpate.bench.estimators import Centring, Estimators, Matched
from palpate.bench.force_input import COLUMNS, Conditioning, ForceInput, Sequence, force_input
from palpate.bench.plant import RIGID, Loop, Plant, elastic_mode, start_at, tick
from palpate.bench.simulation import diagnose, is_own, not_finite
from palpate.bench.tables import Experiment
from palpate.controllers import ResolvedAcceleration, controller_of
from palpate.environments import StickSlip, surface_of
from palpate.errors import InputError, PartError
from palpate.friction import Coulomb, LuGre
from palpate.identifiers.least_squares import LeastSquares
from palpate.instruments import Converter, Encoder
from palpate.references import NO_WAVE, Approach, Chirp, ForceSchedule, Multisine
from palpate.robots.arm3 import MOTOR_TORQUE, Arm3
from palpate.signals.filters import butterworth2, butterworth3, delay, state_variable
from palpate.signals.types import alike, triple

LONGEST_DELAY = 9.0
"""Ticks that the matched front-end's delay line holds."""
SLOWER = 20.0
"""Steps of the physics in a period of an elastic mode, at least: they resolve it, and stay stable."""


def check(e: Experiment) -> None:
    """Refuse numbers that contradict each other, and name their keys."""
    _check_rates(e)
    _check_waves(e)
    if any(high < low for high, low in zip(e.friction.static, e.friction.coulomb, strict=True)):
        raise InputError(
            f"static in [friction] must be at least coulomb in every joint, got {list(e.friction.static)} "
            f"and {list(e.friction.coulomb)}"
        )
    if e.approach.release >= e.approach.switch:
        raise InputError(
            f"release in [approach] must be below switch ({e.approach.switch:g} N), or contact is lost at the "
            f"moment of the switch; got {e.approach.release:g}"
        )
    if e.force_sensor.full_scale <= e.approach.switch:
        raise InputError(
            f"full_scale in [force_sensor] must be above switch in [approach] ({e.approach.switch:g} N), or the "
            f"switch is never reached; got {e.force_sensor.full_scale:g}"
        )


def _check_rates(e: Experiment) -> None:
    half, physics = e.run.rate / 2.0, e.run.rate * e.run.steps
    cutoffs = {
        "motion in [filters]": e.filters.motion,
        "force in [filters]": e.filters.force,
        "cutoff in [identification]": e.identification.cutoff,
        "cutoff in [force_sensor]": e.force_sensor.cutoff,
    }
    for name, cutoff in cutoffs.items():
        if cutoff >= half:
            raise InputError(
                f"{name} must be below {half:g} Hz, half the rate in [run], got {cutoff:g}; lower it or raise rate"
            )
    if e.force_sensor.phase * e.force_sensor.sampling >= 1.0:
        raise InputError(
            f"phase in [force_sensor] must be below {1.0 / e.force_sensor.sampling:g} s, a period of its sampling, got "
            f"{e.force_sensor.phase:g}"
        )
    if e.force_sensor.sampling > physics:
        raise InputError(
            f"sampling in [force_sensor] must be at most {physics} Hz, rate times steps in [run], got "
            f"{e.force_sensor.sampling}"
        )

    if e.elastic is not None and e.elastic.frequency > physics / SLOWER:
        raise InputError(
            f"frequency in [elastic] must be at most {physics / SLOWER:g} Hz, rate times steps in [run] over "
            f"{SLOWER:g}, got {e.elastic.frequency:g}; lower it or raise steps"
        )


def _check_waves(e: Experiment) -> None:
    half, chirp, sines = e.run.rate / 2.0, e.force.chirp, e.force.multisine
    if chirp is not None and max(chirp.low, chirp.high) >= half:
        raise InputError(
            f"low and high in [force.chirp] must be below {half:g} Hz, half the rate in [run], got {chirp.low:g} and "
            f"{chirp.high:g}"
        )
    if sines is None:
        return
    lengths = [len(values) for values in (sines.frequencies, sines.amplitudes, sines.phases)]
    if len(set(lengths)) > 1:
        raise InputError(
            f"frequencies, amplitudes and phases in [force.multisine] must be of one length, got {lengths}"
        )
    if max(sines.frequencies, default=0.0) >= half:
        raise InputError(
            f"frequencies in [force.multisine] must be below {half:g} Hz, half the rate in [run], got "
            f"{max(sines.frequencies):g}"
        )


def matched_delay(e: Experiment, force: ForceInput) -> float:
    """Seconds by which the matched front-end must delay the position, beside its model of the sensor's filter."""
    late = force.lag - butterworth3(e.force_sensor.cutoff, float(e.run.rate)).lag
    if late * e.run.rate > LONGEST_DELAY:
        raise InputError(
            f"the force is {1e3 * late:.1f} ms late beside its filter, more than the {LONGEST_DELAY:g} ticks that the "
            "matched estimator can follow; raise sampling in [force_sensor] or lower rate in [run]"
        )
    return late


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
        loop, q, meta, e.run.losses, None if e.identifier is None else partial(e.identifier.build, tick)
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
    ).validate()
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


TICKS = 3
"""Ticks that are compiled and run."""


def check_parts(bench: Bench, waiting: Callable[[], None] | None = None) -> None:
    """Step each part of the user's once in plain Python, and compile the loop with them.

    Args:
        bench: whose parts.
        waiting: called when the loop has to be compiled first.

    Raises:
        InputError: a part raises, gives a number that is none, or cannot be compiled; one line says which and where.
    """
    try:
        _check(bench, waiting)
    except PartError as error:
        raise InputError(str(error)) from error


def _check(bench: Bench, waiting: Callable[[], None] | None) -> None:
    if not any(map(is_own, (bench.loop.controller, bench.loop.plant.surface))):
        _check_identifier(bench)
        return
    state = start_at(bench.loop, bench.q)
    wrong = not_finite(bench.loop, state)
    if wrong:
        raise PartError(wrong)
    try:
        tick(bench.loop, state, 0, 0.0, np.empty(len(COLUMNS)))
    except Exception as error:
        raise diagnose(bench.loop, state) from error
    _check_trouble(bench.loop.controller, state.controller)
    bench.run(TICKS * bench.loop.tick, waiting=waiting)
    _check_identifier(bench)


def _check_trouble(controller: Any, state: Any) -> None:
    if not isinstance(controller.trouble(state), str):
        raise PartError(
            f"trouble of the controller {type(controller).__name__} must return a text, '' if nothing is"
        )


def _check_identifier(bench: Bench) -> None:
    """An identifier must take a sample and have an estimate."""
    if bench.identifier is None:
        return
    from palpate.bench.estimators import after

    identifier = bench.identifier()
    for k in range(TICKS):
        after(identifier, np.array([0.1, 0.01 * (k + 1), 1e-3]), 5.0 + k, k * bench.loop.tick)
