"""The linear model of a bench: at rest under force, with instruments so fine that all may be differentiated."""

import math
from typing import Any

import numpy as np

from palpate._vector import ZERO3, Vec3
from palpate.arrays import Array
from palpate.bench.bench import Bench
from palpate.bench.force_input import COLUMNS, SequenceState
from palpate.bench.from_experiment import build
from palpate.bench.plant import Loop, LoopState, start_at
from palpate.bench.summary import CONTACT
from palpate.bench.tables import Experiment
from palpate.errors import InputError
from palpate.studies.analysis.linear_loop import LinearLoop, LoopMotion, change

FINE_BITS = 50
"""Bits of every converter: the rounding of `signals.quantise` is exact up to 2^51 steps."""
FINE_COUNTS = 1e17
"""Counts per turn of every encoder; around its offset, so that the count stays below 2^51 for some milliradians."""
STRONGER = 10.0
NONE = 0.0 * ZERO3


def exact(loop: Loop) -> Loop:
    """Give a loop instruments that round nothing; its angles must stay near the encoders' offset."""
    sensor = loop.force.sensor
    return loop._replace(
        encoder=loop.encoder._replace(counts=NONE + FINE_COUNTS),
        force=loop.force._replace(
            sensor=sensor._replace(converter=_fine(sensor.converter)), converter=_fine(loop.force.converter)
        ),
        output=_fine(loop.output)._replace(full_scale=2.0 * loop.conditioning.arm.limits),
    )


def at_equilibrium(loop: Loop, force: float, *, friction: bool) -> Loop:
    """Give a loop exact instruments, a constant desired force [N] and, unless wanted, no friction of joints.

    Friction that is left in acts as it does at rest, before anything slips: as a spring and a damper. The motors are
    given `STRONGER` limits, so that a search for the state of rest may go beyond them on its way.
    """
    arm = loop.conditioning.arm
    loop = loop._replace(
        conditioning=loop.conditioning._replace(arm=arm._replace(limits=STRONGER * arm.limits))
    )
    plant = loop.plant
    if not friction:
        plant = plant._replace(friction=plant.friction._replace(sigma0=NONE, sigma1=NONE, sigma2=NONE))
    schedule = loop.schedule
    constant = schedule._replace(first=force, second=force, amplitude=0.0, wave=schedule.wave[:0])
    return exact(loop)._replace(plant=plant, schedule=constant)


def _fine(converter: Any) -> Any:
    return converter._replace(bits=FINE_BITS)


def pressing(loop: Loop, force: float, elbow: float, x: float | None = None) -> tuple[Loop, LoopState]:
    """The loop and its state at rest in the desired pose, pressing with the desired force [N].

    Where the controller is at rest elsewhere (an impedance, say) this is where the search for that begins.

    Args:
        loop: as `still` leaves it.
        force: on the surface [N].
        elbow: +1 or -1, the side to which joint 2 bends.
        x: of the pressed tip [m]; the wall is put where it has to be. Left out, the wall stays where it is.

    Raises:
        InputError: a surface that lies out of reach.
    """
    depth = penetration(loop.plant.surface, force)
    wall = loop.plant.wall if x is None else x - depth
    loop = loop._replace(plant=loop.plant._replace(wall=wall))
    pose = Vec3(wall + depth, loop.start.y, loop.start.z)
    arm: Any = loop.plant.arm
    beyond = arm.beyond_reach(pose)
    if beyond > 0.0:
        raise InputError(
            f"the surface under {force:g} N is out of reach by {1e3 * beyond:.1f} mm; move the wall"
        )
    q = arm.inverse(pose, elbow)
    loop = loop._replace(encoder=loop.encoder._replace(offset=q))
    free = start_at(loop, q)  # type: ignore[no-untyped-call]
    touched = free.plant.surface._replace(deflection=depth, contact=1.0)
    sensor: Any = loop.force
    smooth: Any = loop.conditioning.force
    return loop, free._replace(
        plant=free.plant._replace(surface=touched),
        force=sensor.settled_at(force, 0.0, 0.0),
        conditioning=free.conditioning._replace(force=smooth.start_at(force)),
        sequence=SequenceState(CONTACT, 0.0, 0.0, pose.x, pose.x, 1.0),
    )


def penetration(surface: Any, force: float) -> float:
    """Penetration of the surface under a constant force [m]: Newton's iteration on its law."""
    rest, depth = surface.start(), 1e-3
    for _ in range(100):
        step = 1e-6 * depth
        here, beyond = (surface.force(rest._replace(deflection=p), p, 0.0) for p in (depth, depth + step))
        slope = (beyond - here) / step
        if not slope > 0.0:
            break
        nearer = max(depth - (here - force) / slope, 0.1 * depth)
        if abs(nearer - depth) <= 1e-12 * depth:
            return float(nearer)
        depth = nearer
    raise InputError(
        f"the surface holds no force of {force:g} N at any depth; a linear model needs an equilibrium"
    )


REST = 10.0
"""Steps of `Motion` by which a tick may still move a state of rest: 1e-8 rad, 1e-5 rad/s, 1e-3 N."""
TRIES = 12
POSE, TORQUE = ("x", "y", "phi"), ("torque1", "torque2", "torque3")


def linearise(
    of: Experiment | Bench, *, force: float | None = None, x: float | None = None, friction: bool = False
) -> LinearLoop:
    """The linear model of a bench that presses: bench, instruments and control law, all three joints.

    It is the compiled tick itself, differentiated about the state of rest. Rounding, noise and the limits of the
    motors are not in it, and the friction of the joints only if asked for. Networks learn in it as they do.

    Args:
        of: an experiment, or a bench.
        force: desired [N]; the experiment's first when left out.
        x: of the pressed tip [m]: the wall is put where it has to be. Left out, the wall stays.
        friction: takes the joints' friction as it is at rest, before anything slips: a spring and a damper at each
            joint. Left out, there is none.

    Returns:
        The model, at the desired y and phi, or where else the controller comes to rest.

    Raises:
        InputError: a pose out of reach, no equilibrium, a motor at its limit.
    """
    bench = of if isinstance(of, Bench) else build(of)
    wanted = float(bench.loop.schedule.first if force is None else force)
    if not wanted > 0.0:
        raise InputError(f"force must be above 0 N, got {wanted:g}: without contact there is no force loop")
    loop = at_equilibrium(bench.loop, wanted, friction=friction)
    motion = LoopMotion(*pressing(loop, wanted, math.copysign(1.0, bench.q.y), x))
    period = period_of(loop)
    at = at_rest(motion, period)
    if at is None:
        raise InputError(
            f"the loop has no equilibrium in contact near the desired pose and {wanted:g} N: nothing to linearise"
        )
    row = _row(motion, at)
    pose, torque = (np.array([row[name] for name in names]) for names in (POSE, TORQUE))
    limits = np.array(bench.loop.conditioning.arm.limits)
    beyond = np.flatnonzero(np.abs(torque) > limits)
    if len(beyond):
        i = int(beyond[0])
        raise InputError(
            f"at rest under {row['force']:.3g} N motor {i + 1} would have to give {abs(torque[i]):.3g} N m, its limit "
            f"is {limits[i]:g}; lower the force or raise the limit"
        )
    transition, outputs = motion.derivative(at, 0, period)
    return LinearLoop(motion, at, period, transition, outputs, pose, row["force"], torque)


def period_of(loop: Loop) -> int:
    """Ticks after which the force sensor's sampling falls on the ticks as before: 25 for 480 Hz at 1 kHz."""
    sensor = loop.force.sensor
    pattern = sensor.rate // math.gcd(sensor.rate, sensor.sampling)
    return math.lcm(pattern, loop.steps) // loop.steps


def at_rest(motion: LoopMotion, period: int) -> Array | None:
    """The state that no tick moves by more than `REST`, by Newton's iteration, shape (n,); None if it finds none.

    Of many such states the one nearest to the start.
    """
    x = motion.start
    for _ in range(TRIES):
        if max(np.abs(_unrest(motion, x, k, 1)).max() for k in range(period)) <= REST:
            return x
        unrest = _unrest(motion, x, 0, period)
        if not np.isfinite(unrest).all():
            break
        scaled = motion.derivative(x, 0, period)[0] / motion.steps[:, None] * motion.steps
        U, s, Vt = change(scaled)
        x = x - motion.steps * (Vt.T @ ((U.T @ unrest) / s))
    return None


def _unrest(motion: LoopMotion, x: Array, first: int, ticks: int) -> Array:
    """Change of the state over some ticks, in steps."""
    return (motion.after(x, first, ticks)[0] - x) / motion.steps


def _row(motion: LoopMotion, x: Array) -> dict[str, float]:
    """Recorded values of a state, by column; of its second tick, which includes the force."""
    return dict(zip(COLUMNS, motion.after(x, 0, 2)[1][-1].tolist(), strict=True))
