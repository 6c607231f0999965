"""First touches simulated: an arm with its lags and limits, a one-sided surface, a sensor, and any law, compiled.

It is no copy of `SampledLoop`: the contact is one-sided, the sensor samples by its own clock, speeds are limited and
readings are noisy. What is proved of the one is tried on the other.
"""

from typing import NamedTuple

from palpate._jit import kernel, law, part
from palpate._vector import ZERO3, Mat3, Vec3, cos, sin, sqrt

SKIN, DULL = 1e6, 0.6
"""Stiffness between a torque arm's tip and a surface with mass [N/m], as of steel on steel under a small tip, and its
damping in units of sqrt(stiffness times mass)."""


@part
class Surface(NamedTuple):
    """A one-sided surface: f = K p^n + B p^(n-1) pdot, or f = K p + B pdot + M pddot.

    Args:
        stiffness: K [N/m^n].
        damping: B.
        exponent: n; 1 for a spring and a damper.
        place: of the undeformed surface [m].
        sway: amplitude of its own motion [m].
        frequency: of that [rad/s].
        later: K after `change` [N/m].
        change: time of that [s]; the force stays, what is in contact then being as deep as that takes.
        depth: of the surface's own deflection then [m].
        mass: M, of what moves with the tip [kg]; 0, or from 0.02 (the step is explicit) with an exponent of 1, at rest.
        thickness: depth from which something hard lies behind a massless surface of exponent 1 [m].
        behind: stiffness of that beside K [N/m].
        cable: force in the reading over the way from the start, of a cable that lets go at the surface [N/m].
    """

    stiffness: float
    damping: float
    exponent: float
    place: float
    sway: float
    frequency: float
    later: float
    change: float
    depth: float
    mass: float
    thickness: float
    behind: float
    cable: float


@part
class World(NamedTuple):
    """Arm and sensor.

    Args:
        torque: 1 for a torque arm, 0 for a position arm.
        yields: 1 for a servo that gives way to the force, whose spring and damper act between ticks too.
        first: w^2 of the inner loop [1/s^2]; the tip's mass [kg].
        second: 2 z w [1/s]; D [N s/m].
        stiffness: the arm's own; K_p [N/m].
        delay: ticks from command to inner loop; from encoders to torque.
        tick: [s].
        steps: of the physics in a tick.
        speed: the arm's limit [m/s].
        E, e: the sensor's low-pass over a step.
        c, d: its output.
        sampling: of the sensor [Hz].
        phase: when it samples first [s].
        noise: of a reading [N].
        full_scale: of the sensor [N].
        step: quantisation of the position [m].
        resolution: of a reading, to whose multiples it is rounded; 0 for none [N].
    """

    torque: float
    yields: float
    first: float
    second: float
    stiffness: float
    delay: int
    tick: float
    steps: int
    speed: float
    E: Mat3
    e: Vec3
    c: Vec3
    d: float
    sampling: float
    phase: float
    noise: float
    full_scale: float
    step: float
    resolution: float


@part
class BodyState(NamedTuple):
    x: float
    v: float
    p: float  # surface's own deflection [m]
    force: float
    z: Vec3  # of the sensor's low-pass
    reading: float
    samples: float  # taken so far
    u: float  # speed of a surface with mass [m/s]


@law
def contact_of_position(world, surface, K, x, p, h):
    """Force and new deflection where a spring of the arm's presses on the surface: implicit in the deflection."""
    pressed = max(x, 0.0)
    n = surface.exponent
    if n == 1.0:
        k, b = K, surface.damping
    else:
        depth = max(p, 1e-9) ** (n - 1.0)
        k, b = K * depth, surface.damping * depth
    q = (world.stiffness * x + b / h * p) / (world.stiffness + k + b / h)
    if q > surface.thickness:
        hard = surface.behind
        q = (world.stiffness * x + b / h * p + hard * surface.thickness) / (
            world.stiffness + k + hard + b / h
        )
    force = world.stiffness * (x - q)
    if force <= 0.0 or pressed <= 0.0:
        relaxed = p * b / (b + k * h) if b > 0.0 else 0.0
        return 0.0, max(relaxed, 0.0)
    return force, q


@law
def contact_of_mass(surface, K, x, v):
    """Force on the surface where the tip itself is pressed into it."""
    if x <= 0.0:
        return 0.0
    n = surface.exponent
    depth = 1.0 if n == 1.0 else x ** (n - 1.0)
    behind = surface.behind * max(x - surface.thickness, 0.0)
    return max((K * x + surface.damping * v) * depth + behind, 0.0)


@law
def contact_of_heavy(world, surface, K, x, v, p, u, h):
    """Force, deflection and speed of a surface with mass, which the arm's own spring presses, or the tip's skin."""
    spring, damper = world.stiffness, 0.0
    if world.torque > 0.0:
        spring, damper = SKIN, DULL * sqrt(SKIN * min(surface.mass, world.first))
    force = max(spring * (x - p) + damper * (v - u), 0.0) if x > p else 0.0
    u += h * (force - K * p - surface.damping * u) / surface.mass
    return force, p + h * u, u


@law
def moved(world, surface, body, held, t, h, noise, at, error):
    """The body a step later: `held` is the commanded position or the torque as a force, `error` the sensor's [N]."""
    swing = surface.sway * sin(surface.frequency * t)
    place = surface.place + swing
    K, p, u = surface.stiffness, body.p, body.u
    if t >= surface.change:
        K = surface.later
        deeper = surface.depth * (1.0 - surface.stiffness / surface.later)
        place += deeper
        if t - h < surface.change:
            p -= deeper
    if world.torque > 0.0:
        sway = surface.sway * surface.frequency * cos(surface.frequency * t)
        if surface.mass > 0.0:
            force, p, u = contact_of_heavy(world, surface, K, body.x - place, body.v, p, u, h)
        else:
            force = contact_of_mass(surface, K, body.x - place, body.v - sway)
        pull = held
        if world.yields > 0.0:
            pull = world.stiffness * (held - body.x) - world.second * body.v
        v = body.v + h * (pull - force) / world.first
        x = body.x + h * v
    else:
        v = body.v + h * (world.first * (held - body.x) - world.second * body.v)
        x = body.x + h * v
        if surface.mass > 0.0:
            force, p, u = contact_of_heavy(world, surface, K, x - place, v, p, u, h)
        else:
            force, p = contact_of_position(world, surface, K, x - place, p, h)
    z = world.E @ body.z + force * world.e
    reading, samples = body.reading, body.samples
    if t + h >= world.phase + samples / world.sampling:
        reading = world.c @ z + world.d * force + world.noise * noise[at + int(samples) % 8] + error
        if world.resolution > 0.0:
            reading = world.resolution * round(reading / world.resolution)
        reading = min(max(reading, -world.full_scale), world.full_scale)
        samples += 1.0
    return BodyState(x, v, p, force, z, reading, samples, u)


@law
def touch(world, surface, control, start, desired, noise, error, line, out):
    """A run from free motion: row k of `out` is force on the surface (mean of the tick), K_u, position, speed, reading.

    Args:
        world: arm and sensor.
        surface: what is touched.
        control: any part with start() and step(state, desired, force, position) -> speed, state.
        start: of the tip [m].
        desired: F_d at each tick [N], shape (n,).
        noise: standard normal numbers, shape (8 (n + 1),).
        error: of the sensor beside its noise: bias, drift, hum [N], shape (n,).
        line: room for what is on its way, zeros, shape (delay + 1,).
        out: shape (n, 5).
    """
    state = control.start()
    body = BodyState(start, 0.0, 0.0, 0.0, ZERO3, world.noise * noise[0] + error[0], 0.0, 0.0)
    command, h = start, world.tick / world.steps
    line[:] = start if world.torque == 0.0 or world.yields > 0.0 else 0.0
    for k in range(len(desired)):
        seen = body.x if world.step == 0.0 else world.step * round(body.x / world.step)
        felt = body.reading
        speed, state = control.step(state, desired[k], felt, seen)
        speed = min(max(speed, -world.speed), world.speed)
        command += world.tick * speed
        into = command
        if world.torque > 0.0 and world.yields == 0.0:
            into = world.stiffness * (command - seen) - world.second * body.v
        held = line[0] if world.delay > 0 else into
        for i in range(world.delay - 1):
            line[i] = line[i + 1]
        if world.delay > 0:
            line[world.delay - 1] = into
        false, mean = error[k] + (surface.cable * (body.x - start) if body.x < 0.0 else 0.0), 0.0
        for j in range(world.steps):
            body = moved(world, surface, body, held, (k * world.steps + j) * h, h, noise, 8 * k, false)
            mean += body.force
        out[k, 0], out[k, 1], out[k, 2], out[k, 3] = (
            mean / world.steps,
            control.stiffness_bound(state),
            body.x,
            speed,
        )
        out[k, 4] = felt


compiled_touch = kernel(touch)
