"""A serial arm before a flat surface, and its force sensor: what moves between two ticks.

The arm's own laws fill M, h and J, or MuJoCo does; contact, sensor and motors are the same laws for both.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from palpate._jit import kernel, law, part
from palpate._vector import ZERO3, Mat3, Vec3
from palpate.environments.kelvin_voigt import KelvinVoigt
from palpate.environments.surface_state import SurfaceState, contact_force, follow, opposing
from palpate.robots.serial.chain import Chain, Room, chain_model, room_for
from palpate.robots.serial.linear import backward, factorise, forward
from palpate.robots.serial.spatial import cross

Array = NDArray[np.float64]


@part
class WristSensor(NamedTuple):
    """A force sensor as `palpate.force` describes it: low-pass, sampling by its own clock, noise, a full scale.

    Args:
        E, e: the low-pass over a step of the physics: z' = E z + e f.
        c, d: its output c z + d f [N].
        sampling: readings a second [Hz].
        noise: standard deviation of a reading [N].
        full_scale: largest reading [N].
    """

    E: Mat3
    e: Vec3
    c: Vec3
    d: float
    sampling: float
    noise: float
    full_scale: float


@part
class Reading(NamedTuple):
    """State of the sensor."""

    z: Vec3
    value: float  # the last reading [N]
    samples: float  # taken so far


@part
class HeldTool(NamedTuple):
    """What hangs beyond the force sensor, as the sensor shows it: the sign is that of a press.

    Args:
        weight: in the base's axes, less what a driver takes off [N].
        bias: of the sensor, in the tool's axes [N].
        inertia: mass by which the reading follows the acceleration, less what a driver takes off [kg].
        centre: of mass, in the tool's axes from the tip [m].
    """

    weight: Vec3
    bias: Vec3
    inertia: float
    centre: Vec3


NO_TOOL = HeldTool(ZERO3, ZERO3, 0.0, ZERO3)


@part
class Cell(NamedTuple):
    """Arm, surface and sensor.

    Args:
        chain: the arm.
        normal: into the surface, in the base's axes.
        place: of the undeformed surface along the normal [m].
        surface: what is touched, without friction along it.
        sensor: at the tip; it feels what the surface does, and what moves and holds the tool beyond it.
        tool: that one.
        step: of the physics [s].
        steps: of the physics in a tick.
        elastic: 1 where motors lead the links through springs, 0 where torques act on the links.
        spring: of each joint [N m/rad, N/m], shape (n,).
        damper: beside it [N m s/rad, N s/m], shape (n,).
        first: w^2 of the motors, which follow their set-points whatever pushes [1/s^2].
        second: 2 z w [1/s].
    """

    chain: Chain
    normal: Vec3
    place: float
    surface: KelvinVoigt
    sensor: WristSensor
    tool: HeldTool
    step: float
    steps: int
    elastic: float
    spring: Array
    damper: Array
    first: float
    second: float


@part
class Body(NamedTuple):
    """Where the arm is, and room for the laws; changed in place. Shapes (n,), (n, n)."""

    q: Array
    qd: Array
    motor: Array  # angle of each motor at the joint [rad, m]
    motor_rate: Array
    room: Room
    L: Array  # of M = L L^T
    drive: Array  # torque on the links
    qdd: Array
    normal: Array  # row of J along the normal
    yielding: Array  # L^-1 times that


@part
class Touch(NamedTuple):
    """What surface and sensor remember, and what was felt."""

    surface: SurfaceState
    reading: Reading
    force: float  # on the surface during the last step [N]
    mean: float  # over the last tick [N]
    depth: float  # of the tip, negative in the air [m]


def body_at(q: Array, motor: Array) -> Body:
    """At rest."""
    n = len(q)
    one = [np.zeros(n) for _ in range(6)]
    return Body(q.copy(), one[0], motor.copy(), one[1], room_for(n), np.zeros((n, n)), *one[2:])


@law
def sensed(sensor, reading, force, time, noise):
    """The sensor after a step that ends at `time` [s]; `noise` are eight standard normal numbers of this tick."""
    z = sensor.E @ reading.z + force * sensor.e
    value, samples = reading.value, reading.samples
    if time >= samples / sensor.sampling:
        value = sensor.c @ z + sensor.d * force + sensor.noise * noise[int(samples) % 8]
        value = min(max(value, -sensor.full_scale), sensor.full_scale)
        samples += 1.0
    return Reading(z, value, samples)


@law
def driven(cell, body, setpoint):
    """Fills the torque on the links: it is the set-point itself, or the springs' between motors and links."""
    for i in range(len(body.q)):
        if cell.elastic == 0.0:
            body.drive[i] = setpoint[i]
        else:
            pull = cell.first * (setpoint[i] - body.motor[i]) - cell.second * body.motor_rate[i]
            body.motor_rate[i] += cell.step * pull
            body.motor[i] += cell.step * body.motor_rate[i]
            stretch, rate = body.motor[i] - body.q[i], body.motor_rate[i] - body.qd[i]
            body.drive[i] = cell.spring[i] * stretch + cell.damper[i] * rate


@law
def answered(cell, body, tip, touch):
    """Fills the joints' accelerations under drive and contact: the surface's state and the force on it [N].

    Args:
        cell: all of it.
        body: its room filled with M, h and J of this moment, its drive with the torques.
        tip: of this moment.
        touch: after the step before.
    """
    n, room = len(body.q), body.room
    factorise(room.M, body.L)
    for i in range(n):
        along = cell.normal @ Vec3(room.J[0, i], room.J[1, i], room.J[2, i])
        body.normal[i], body.yielding[i] = along, along
        body.qdd[i] = body.drive[i] - room.h[i]
    forward(body.L, body.yielding)
    forward(body.L, body.qdd)
    mobility, free, v = 0.0, cell.normal @ tip.a, 0.0
    for i in range(n):
        mobility += body.yielding[i] * body.yielding[i]
        free += body.yielding[i] * body.qdd[i]
        v += body.normal[i] * body.qd[i]
    p = cell.normal @ tip.p - cell.place
    surface, impulse = follow(cell.surface, touch.surface, touch.force, p, v, 1.0 / mobility, cell.step)
    force = 0.0
    if surface.contact == 1.0:
        late = v - 0.5 * cell.step * (cell.normal @ tip.a)
        elastic, opposed = opposing(cell.surface, surface, p, late, cell.step)
        force = contact_force(elastic, opposed, 1.0 / mobility, free)
    for i in range(n):
        body.qdd[i] -= body.yielding[i] * (max(force, 0.0) + impulse / cell.step)
    backward(body.L, body.qdd)
    return surface, force + impulse / cell.step, p


@law
def held_by(cell, body, tip):
    """Force along the normal that the tool beyond the sensor adds to its reading: w + R b + m a of its centre [N]."""
    tool, room = cell.tool, body.room
    shown = tool.weight + tip.R @ tool.bias
    if tool.inertia != 0.0:
        a, dw = tip.a, tip.dw
        for i in range(len(body.q)):
            a = a + body.qdd[i] * Vec3(room.J[0, i], room.J[1, i], room.J[2, i])
            dw = dw + body.qdd[i] * Vec3(room.J[3, i], room.J[4, i], room.J[5, i])
        r = tip.R @ tool.centre
        shown = shown + tool.inertia * (a + cross(dw, r) + cross(tip.w, cross(tip.w, r)))
    return cell.normal @ shown


@law
def measured(cell, body, tip, touch, surface, force, depth, time, noise):
    """The touch after a step."""
    felt = max(force, 0.0)
    reading = sensed(cell.sensor, touch.reading, felt + held_by(cell, body, tip), time, noise)
    return Touch(surface, reading, force, touch.mean + felt / cell.steps, depth)


@law
def tick(cell, body, touch, setpoint, k, noise):
    """The k-th tick under a set-point that holds: torques [N m], or the motors' places [rad, m], shape (n,).

    Semi-implicit Euler, first order; the contact force is solved together with the acceleration.
    """
    step = cell.step
    touch = Touch(touch.surface, touch.reading, touch.force, 0.0, touch.depth)
    for j in range(cell.steps):
        driven(cell, body, setpoint)
        tip = chain_model(cell.chain, body.q, body.qd, body.room)
        surface, force, depth = answered(cell, body, tip, touch)
        for i in range(len(body.q)):
            body.qd[i] += step * body.qdd[i]
            body.q[i] += step * body.qd[i]
        time = (k * cell.steps + j + 1) * step
        touch = measured(cell, body, tip, touch, surface, force, depth, time, noise)
    return touch


@law
def foreign(cell, body, touch, tip, setpoint, time, noise):
    """One step whose M, h and J another engine has filled in; that engine moves the arm."""
    driven(cell, body, setpoint)
    surface, force, depth = answered(cell, body, tip, touch)
    return measured(cell, body, tip, touch, surface, force, depth, time, noise)


compiled_tick = kernel(tick)
compiled_foreign = kernel(foreign)
