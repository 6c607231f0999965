"""From a bench to its linear model."""

from __future__ import annotations

import math

import numpy as np

from palpate.analysis.constant_modes import change
from palpate.analysis.equilibrium import at_equilibrium, pressing
from palpate.analysis.linear_loop import LinearLoop
from palpate.analysis.motion import Motion
from palpate.arrays import Array
from palpate.bench.bench import Bench
from palpate.bench.build import build
from palpate.bench.experiments.tables import Experiment
from palpate.bench.row import COLUMNS
from palpate.bench.tick import Loop
from palpate.errors import InputError

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
    motion = Motion(*pressing(loop, wanted, math.copysign(1.0, bench.q.y), x))
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
    transition, seen = motion.derivative(at, 0, period)
    return LinearLoop(motion, at, period, transition, seen, pose, row["force"], torque)


def period_of(loop: Loop) -> int:
    """Ticks after which the force sensor's sampling falls on the ticks as before: 25 for 480 Hz at 1 kHz."""
    sensor = loop.force.sensor
    pattern = sensor.rate // math.gcd(sensor.rate, sensor.sampling)
    return math.lcm(pattern, loop.steps) // loop.steps


def at_rest(motion: Motion, period: int) -> Array | None:
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


def _unrest(motion: Motion, x: Array, first: int, ticks: int) -> Array:
    """How far some ticks carry the state, in steps."""
    return (motion.after(x, first, ticks)[0] - x) / motion.steps


def _row(motion: Motion, x: Array) -> dict[str, float]:
    """Recorded values of a state, by column; of its second tick, which includes the force."""
    return dict(zip(COLUMNS, motion.after(x, 0, 2)[1][-1].tolist(), strict=True))
