"""Slides simulated and judged: an arm with lags, a curved surface with friction, a sensor, and a law, compiled.

Nothing of the filter is in here: friction is a bristle that sticks until mu N (Coulomb) and weakens with speed
(Stribeck), shapes are distance functions.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from palpate._jit import kernel, law, part
from palpate._vector import ZERO3, Vec3, exp, sin, sqrt
from palpate.arrays import Array
from palpate.force.gains import Gains
from palpate.force.simulated_press import world_of
from palpate.force.sliding.slide_law import slide_step
from palpate.force.sliding.slide_state import (
    NORMAL,
    PHASE,
    SIZE,
    SLIDE,
    TROUBLE,
    Sliding,
    put_vector,
    vector_at,
)
from palpate.force.sliding.sliding_loop import CHI2_95, DOWN, Z_95, sliding
from palpate.force.sliding.tangent_filter import (
    BASE,
    MU,
    STATES,
    STIFF,
    slope_variance,
    stiffness_of,
    variance,
)
from palpate_slide.ground import Ground, outside

COLUMNS = (
    "normal_force", "x", "y", "z", "nx", "ny", "nz", "normal_error", "cone", "mu", "mu_std", "stiffness",
    "stiffness_std", "sliding", "trouble", "speed", "fx", "fy", "fz", "mu_true", "desired", "tool", "ax", "ay", "az",
)  # fmt: skip
"""Of a run: N [N], tip [m], estimated normal, its error and one standard deviation [rad], mu, K [N/m], phase, trouble,
speed commanded along the surface [m/s], reading [N], friction as it acts, desired force [N], and of an arm with joints
the angle between the tool's axis and the true normal [rad], and that axis; NaN of a point."""


@part
class Carried(NamedTuple):
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
        return Carried(x, v, x, 0.0, 0.0, ZERO3, 0.0, 0.0)
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
    return Carried(x, v, x - bent, depth, 1.0, N * n + k * bent, N, mu)


@part
class Course(NamedTuple):
    """Course of a run, and room for it.

    Args:
        start: of the tip [m].
        directions: for each tick of the slide, shape (m, 3).
        desired: F_d [N].
        dither: share of F_d by which it changes in a slide, and its frequency [Hz].
        noise: standard normal numbers, shape (n, 3).
        line: room for what is on its way, shape (delay + 1, 3).
        work: room of the law, shape (STATES,).
    """

    start: Vec3
    directions: Array
    desired: float
    dither: tuple[float, float]
    noise: Array
    line: Array
    work: Array


@part
class OwnLaw(NamedTuple):
    """The sliding law as what moves the tip."""

    law: Sliding

    def step(self, s, work, desired, force, position, direction):
        """Velocity of a tick [m/s]; the state changes in place, its normal and phase are those of the run."""
        return slide_step(self.law, s, work, desired, force, position, direction, 0.0)


@law
def slide_run(world, ground, control, s, course, out):
    """A run from free motion until the directions are used up; row k of `out` is `COLUMNS`; returns the rows.

    Args:
        world: arm and sensor, each axis alike.
        ground: the surface.
        control: a part as `OwnLaw`.
        s: its state, as it starts, shape (SIZE,) or longer.
        course: of the run.
        out: shape (n, 25).
    """
    h, ticks, samples = world.tick / world.steps, 0, 0.0
    torque = world.torque * (1.0 - world.yields)
    line, x, y, z = course.line, ZERO3, ZERO3, ZERO3
    tip = Carried(course.start, ZERO3, ZERO3, 0.0, 0.0, ZERO3, 0.0, 0.0)
    reading, command = world.noise * vector_at(course.noise[0], 0), tip.x
    for i in range(world.delay + 1):
        put_vector(line[i], 0, (1.0 - torque) * command)
    for k in range(len(out)):
        if ticks >= len(course.directions):
            return k
        seen, wanted = by_encoder(world, tip.x), vector_at(course.directions[ticks], 0)
        angle = 6.283185307179586 * course.dither[1] * ticks * world.tick
        desired = course.desired * (1.0 + course.dither[0] * sin(angle))
        velocity = control.step(s, course.work, desired, reading, seen, wanted)
        ticks += 1 if s[PHASE] == SLIDE or ticks > 0 else 0
        command = command + world.tick * velocity
        pulled = torque * (world.stiffness * (command - seen) - world.second * tip.v)
        put_vector(line[world.delay], 0, (1.0 - torque) * command + pulled)
        held = vector_at(line[0], 0)
        for i in range(world.delay):
            put_vector(line[i], 0, vector_at(line[i + 1], 0))
        mean = 0.0
        for j in range(world.steps):
            tip = moved_tip(world, ground, tip, held, h)
            f = tip.force
            x, y, z = world.E @ x + f.x * world.e, world.E @ y + f.y * world.e, world.E @ z + f.z * world.e
            mean += tip.normal
            if (k * world.steps + j + 1) * h >= world.phase + samples / world.sampling:
                samples += 1.0
                reading = Vec3(world.c @ x, world.c @ y, world.c @ z) + world.d * f
                reading = reading + world.noise * vector_at(course.noise[k], 0)
        note(ground, s, tip, velocity, reading, mean / world.steps, out[k])
        out[k, 20] = desired
        out[k, 13] = (1.0 if s[PHASE] == SLIDE else 2.0) * min(ticks, 1)
    return len(out)


@law
def moved_tip(world, ground, tip, held, h):
    """The tip after a step of the physics under what the delay lets through: places [m], or a pull [N]."""
    if world.torque == 0.0:
        rate = world.first * (held - tip.x) - world.second * tip.v
    elif world.yields == 0.0:
        rate = (held - tip.force) / world.first
    else:
        rate = (world.stiffness * (held - tip.x) - world.second * tip.v - tip.force) / world.first
    v = tip.v + h * rate
    return contact(world, ground, tip, tip.x + h * v, v, h)


@law
def by_encoder(world, x):
    """A position in steps of the encoder [m]."""
    step = world.step
    return Vec3(step * round(x.x / step), step * round(x.y / step), step * round(x.z / step))


@law
def note(ground, s, tip, velocity, reading, mean, row):
    """Fills a row of `COLUMNS`."""
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


compiled_slide = kernel(slide_run)

GAP = 3e-3
"""Between tip and surface at the start [m]."""
LONGEST = 30.0
"""Time in which the surface is to be found and the force held [s]."""
SPARE = 6
"""Numbers behind the law's state, for laws that it is compared with."""
SETTLED = 0.5
"""Time after which a slide is judged [s]."""


def simulate(
    gains: Gains,
    ground: Ground,
    ways: Array,
    *,
    into: ArrayLike = DOWN,
    seed: int = 0,
    control: Callable[[Sliding], Any] = OwnLaw,
    dither: tuple[float, float] = (0.0, 0.0),
) -> Array:
    """A slide from free motion on: rows of `COLUMNS`, shape (n, 25).

    Args:
        gains: with a table `slide`.
        ground: the surface; the tip comes down on its origin.
        ways: directions of the slide, tick by tick, shape (m, 3).
        into: direction in which the law looks for the surface, shape (3,).
        seed: of the noise.
        control: makes what moves the tip out of the law's numbers.
        dither: share of the desired force by which it changes in a slide, and the frequency [Hz].
    """
    law, arm = sliding(gains, into), gains.arm
    state = np.zeros(SIZE + SPARE)
    law.start(state)
    world = world_of(arm, noise=arm.sensor.noise)
    out = np.zeros((len(ways) + round(LONGEST * arm.rate), len(COLUMNS)))
    out[:, COLUMNS.index("tool") :] = np.nan
    start = (GAP if law.into.z > 0.0 else -GAP) * law.into  # outside, however wrong it is
    noise = np.random.default_rng(seed).standard_normal((len(out), 3))
    course = Course(
        start, ways, float(gains.force), dither, noise, np.zeros((world.delay + 1, 3)), np.zeros(STATES)
    )
    return out[: compiled_slide(world, ground, control(law), state, course, out)]


@dataclass(frozen=True)
class SlideFigures:
    """How a slide went; errors are judged after `SETTLED`."""

    touched: bool  # the force was held, and the tip slid
    rms: float  # of the force error, share of F_d
    most: float  # largest error, share of F_d
    worst: float  # largest normal force of the whole run in F_d
    lost: bool  # the true force was 0
    normal: float  # median error [rad]
    cone: float  # share of the time in which the 95 % cone holds the normal
    friction: float  # the same of mu
    stiffness: float  # the same of K
    said: bool  # a trouble was shown

    @property
    def obeys(self) -> bool:
        """Within 3 % rms and 10 %, contact kept."""
        return self.touched and self.rms <= 0.03 and self.most <= 0.1 and not self.lost


def figures_of(out: Array, gains: Gains, ground: Ground) -> SlideFigures:
    """How a slide went, from its rows."""
    on = np.flatnonzero(out[:, COLUMNS.index("sliding")])
    judged = on[round(SETTLED * gains.arm.rate) :]
    c = dict(zip(COLUMNS, out[judged].T, strict=True))
    if not len(judged):
        nan = float("nan")
        return SlideFigures(False, nan, nan, nan, True, nan, 0.0, 0.0, 0.0, False)
    error = (c["normal_force"] - c["desired"]) / gains.force
    dither = c["desired"] / gains.force - 1.0
    if dither.any():  # it is followed late: what it is of the error itself, and its rate, is none
        both = np.column_stack([dither, np.gradient(dither)])
        error = error - both @ np.linalg.lstsq(both, error, rcond=None)[0]
    true = gains.arm.seen(ground.stiffness) if gains.arm.kind == "position" else ground.stiffness
    return SlideFigures(
        True, float(np.sqrt(np.mean(error**2))), float(np.abs(error).max()),
        float(out[:, 0].max() / gains.force), bool((out[on, 0] <= 0.0).any()),
        float(np.median(c["normal_error"])),
        float(np.mean(c["normal_error"] < CHI2_95 * c["cone"])),
        float(np.mean(np.abs(c["mu"] - ground.friction) < Z_95 * c["mu_std"])),
        float(np.mean(np.abs(c["stiffness"] - true) < Z_95 * c["stiffness_std"])),
        bool(c["trouble"].any()),
    )  # fmt: skip
