"""Laws of a simulated slide, compiled: contact with friction, sensor, and a tip with an arm's lags in each axis.

Friction is a bristle that sticks until mu N (Coulomb) and weakens with speed (Stribeck). None of this is part of the
filter of the sliding law.
"""

from typing import NamedTuple

from palpate._jit import kernel, law, part
from palpate._vector import ZERO3, Vec3, exp, sin, sqrt
from palpate.arrays import Array
from palpate.force.sliding.slide_law import slide_step
from palpate.force.sliding.slide_state import (
    NORMAL,
    PHASE,
    SLIDE,
    TROUBLE,
    Sliding,
    put_vector,
    vector_at,
)
from palpate.force.sliding.tangent_filter import (
    BASE,
    MU,
    STIFF,
    slope_variance,
    stiffness_of,
    variance,
)
from palpate.slide.ground import outside


@part
class ContactState(NamedTuple):
    """State of the tip and of the contact."""

    x: Vec3  # of the arm [m]
    v: Vec3  # of it [m/s]
    stuck: Vec3  # place from which the bristle is bent [m]
    depth: float  # the surface's own deflection [m]
    touching: float
    force: Vec3  # on the surface [N]
    normal: float  # N [N]
    friction: float  # of now


@law
def contact(world, ground, tip, x, v, h):
    """The contact of a tip at x with a speed v: spring and damper along the normal, a bristle along the surface."""
    series = world.stiffness if world.torque == 0.0 else 1e12
    where = x - tip.force / series
    distance, out = outside(ground, where)
    n = -out
    pen = -distance + n @ (x - where)
    if pen <= 0.0:
        return ContactState(x, v, x, 0.0, 0.0, ZERO3, 0.0, 0.0)
    K, b = ground.stiffness * max(1.0 + ground.grade * where.x, 0.05), ground.damping
    if world.torque == 0.0:
        depth = (series * pen + b / h * tip.depth) / (series + K + b / h)
        N = max(series * (pen - depth), 0.0)
    else:
        depth, N = pen, max(K * pen + b * (n @ v), 0.0)
    stuck = tip.stuck if tip.touching > 0.0 else x
    bent = x - stuck
    bent = bent - (bent @ n) * n
    k = ground.ratio * K / (1.0 + ground.ratio * K / series)
    slip = v - (v @ n) * n
    mu = ground.friction + (ground.sticking - ground.friction) * exp(
        -slip @ slip / (ground.creep * ground.creep)
    )
    most, pull = mu * N / k, sqrt(bent @ bent)
    if pull > most:
        bent = bent * (most / pull)
    return ContactState(x, v, x - bent, depth, 1.0, N * n + k * bent, N, mu)


@part
class Course(NamedTuple):
    """Course of a run, and room for it.

    Args:
        directions: for each tick of the slide, shape (m, 3).
        desired: F_d [N].
        dither: share of F_d by which it changes in a slide, and its frequency [Hz].
        noise: standard normal numbers, shape (n, 3).
        work: room of the law, shape (STATES,).
    """

    directions: Array
    desired: float
    dither: tuple[float, float]
    noise: Array
    work: Array


@part
class TipState(NamedTuple):
    """State of the tip, the contact and the sensor between two ticks."""

    tip: ContactState
    x: Vec3  # of the sensor's low-pass in each axis
    y: Vec3
    z: Vec3
    reading: Vec3  # [N]
    samples: float  # taken so far
    command: Vec3  # place to which the velocities have led [m]
    mean: float  # normal force over the tick [N]


@part
class OwnLaw(NamedTuple):
    """The sliding law as what moves the tip."""

    law: Sliding

    def step(self, s, work, desired, force, position, direction):
        """Velocity of a tick [m/s]; the state changes in place, its normal and phase are those of the run."""
        return slide_step(self.law, s, work, desired, force, position, direction, 0.0)


# More than seven arguments: the state, and how far the run is.
@law
def run_law(world, ground, control, s, course, state, ticks, line, begin, out):
    """Run the law for some ticks, or until the directions are used up; each row of `out` is `world.COLUMNS`.

    Args:
        world: arm and sensor, each axis alike.
        ground: the surface.
        control: a part as `OwnLaw`.
        s: its state, shape (SIZE,) or longer.
        course: of the run.
        state: of the tip.
        ticks: of the slide so far.
        line: what is on its way, shape (delay + 1, 3).
        begin: ticks of the run so far.
        out: shape (n, 25).

    Returns:
        State of the tip, ticks of the slide, and rows.
    """
    for i in range(len(out)):
        if ticks >= len(course.directions):
            return state, ticks, i
        k = begin + i
        seen, wanted = encoder_position(world, state.tip.x), vector_at(course.directions[ticks], 0)
        angle = 6.283185307179586 * course.dither[1] * ticks * world.tick
        desired = course.desired * (1.0 + course.dither[0] * sin(angle))
        velocity = control.step(s, course.work, desired, state.reading, seen, wanted)
        ticks += 1 if s[PHASE] == SLIDE or ticks > 0 else 0
        state = tip_tick(world, ground, state, velocity, line, k, vector_at(course.noise[k], 0))
        fill_row(ground, s, state.tip, velocity, state.reading, state.mean, out[i])
        out[i, 20] = desired
        out[i, 13] = (1.0 if s[PHASE] == SLIDE else 2.0) * min(ticks, 1)
    return state, ticks, len(out)


@law
def tip_tick(world, ground, state, velocity, line, k, noise):
    """The k-th tick under a commanded velocity [m/s]; `noise` are three standard normal numbers."""
    h, torque = world.tick / world.steps, world.torque * (1.0 - world.yields)
    tip, x, y, z, reading, samples = state.tip, state.x, state.y, state.z, state.reading, state.samples
    seen, command = encoder_position(world, tip.x), state.command + world.tick * velocity
    pulled = torque * (world.stiffness * (command - seen) - world.second * tip.v)
    put_vector(line[world.delay], 0, (1.0 - torque) * command + pulled)
    held = vector_at(line[0], 0)
    for i in range(world.delay):
        put_vector(line[i], 0, vector_at(line[i + 1], 0))
    mean = 0.0
    for j in range(world.steps):
        tip = move_tip(world, ground, tip, held, h)
        f = tip.force
        x, y, z = world.E @ x + f.x * world.e, world.E @ y + f.y * world.e, world.E @ z + f.z * world.e
        mean += tip.normal
        if (k * world.steps + j + 1) * h >= world.phase + samples / world.sampling:
            samples += 1.0
            reading = Vec3(world.c @ x, world.c @ y, world.c @ z) + world.d * f
            reading = reading + world.noise * noise
    return TipState(tip, x, y, z, reading, samples, command, mean / world.steps)


@law
def move_tip(world, ground, tip, held, h):
    """The tip after a step of the physics, under the delayed command: positions [m], or a force [N]."""
    if world.torque == 0.0:
        rate = world.first * (held - tip.x) - world.second * tip.v
    elif world.yields == 0.0:
        rate = (held - tip.force) / world.first
    else:
        rate = (world.stiffness * (held - tip.x) - world.second * tip.v - tip.force) / world.first
    v = tip.v + h * rate
    return contact(world, ground, tip, tip.x + h * v, v, h)


@law
def encoder_position(world, x):
    """Position as the encoder shows it, in whole steps [m]."""
    step = world.step
    return Vec3(step * round(x.x / step), step * round(x.y / step), step * round(x.z / step))


@law
def fill_row(ground, s, tip, velocity, reading, mean, row):
    """Fill a row of `world.COLUMNS`."""
    (_, up), n = outside(ground, tip.x), vector_at(s, NORMAL)
    row[0] = mean
    put_vector(row, 1, tip.x)
    put_vector(row, 4, n)
    row[7] = sqrt(max(2.0 + 2.0 * (n @ up), 0.0))
    row[8] = sqrt(slope_variance(s))
    row[9], row[10] = s[MU], sqrt(max(variance(s, MU, MU), 0.0))
    row[11], row[12] = stiffness_of(s), s[BASE] * sqrt(max(variance(s, STIFF, STIFF), 0.0))
    row[13], row[14] = 0.0, s[TROUBLE]
    across = velocity - (velocity @ n) * n
    row[15] = sqrt(across @ across)
    put_vector(row, 16, reading)
    row[19] = tip.friction


compiled_run = kernel(run_law)
compiled_tip_tick = kernel(tip_tick)
compiled_row = kernel(fill_row)
