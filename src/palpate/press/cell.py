"""A serial arm before a flat surface, and its force sensor: what moves between two ticks.

The arm's own laws fill M, h and J, or MuJoCo does; contact, sensor and motors are the same laws for both.
"""

from typing import Any, NamedTuple

from palpate._jit import kernel, law, part
from palpate._vector import ZERO3, Mat3, Vec3
from palpate.arrays import Array
from palpate.environments.surface import SurfaceState, contact_force, follow, opposing
from palpate.robots.serial.chain import KinematicChain, Room, axis_of, chain_motion
from palpate.robots.serial.linear import Wrench, backward, cross, factorise, forward_both, product


@part
class WristSensor(NamedTuple):
    """A force sensor as `palpate.force` describes it: low-pass, sampling by its own clock, noise, a full scale.

    Args:
        E, e: the low-pass over a step of the physics: z' = E z + e f.
        c, d: its output c z + d f [N].
        step: of the physics [s].
        sampling: readings a second [Hz].
        noise: standard deviation of a reading [N].
        full_scale: largest reading [N].
    """

    E: Mat3
    e: Vec3
    c: Vec3
    d: float
    step: float
    sampling: float
    noise: float
    full_scale: float


@part
class Reading(NamedTuple):
    """State of the sensor."""

    z: Vec3
    shown: float  # what comes out of the low-pass [N]
    value: float  # the last reading [N]
    samples: float  # taken so far


@part
class HeldTool(NamedTuple):
    """The tool beyond the force sensor, as the sensor shows it; pressing is positive.

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
class Workcell(NamedTuple):
    """Arm, surface and sensor.

    Args:
        chain: the arm.
        normal: into the surface, in the base's axes.
        place: of the undeformed surface along the normal [m].
        surface: what is touched, without friction along it.
        sensor: at the tip; it reads the contact force, and the force that moves and holds the tool.
        tool: beyond the sensor.
        step: of the physics [s].
        steps: of the physics in a tick.
        elastic: 1 where springs lead the links to a set-point, 0 where torques act on the links.
        yields: 1 where those springs are servos' own, and encoders show how they give way; 0 behind motors.
        spring: of each joint [N m/rad, N/m], shape (n,).
        damper: beside it, or of the link's own rate for a servo [N m s/rad, N s/m], shape (n,).
        first: w^2 of the motors, which follow their set-points whatever the load [1/s^2].
        second: 2 z w [1/s].
    """

    chain: KinematicChain
    normal: Vec3
    place: float
    surface: Any
    sensor: WristSensor
    tool: HeldTool
    step: float
    steps: int
    elastic: float
    yields: float
    spring: Array
    damper: Array
    first: float
    second: float


@part
class Body(NamedTuple):
    """State of the arm, and room for the laws; changed in place. Shapes (n,), (n, n)."""

    q: Array
    qd: Array
    motor: Array  # angle of each motor at the joint [rad, m]
    motor_rate: Array
    room: Room
    L: Array  # of M = L D L^T
    drive: Array  # torque on the links
    qdd: Array
    normal: Array  # row of J along the normal
    centre: Array  # row along the normal of the tool's centre of mass
    yielding: Array  # L^-1 times the row of the tip


@part
class TouchState(NamedTuple):
    """State of surface and sensor, and the contact force."""

    surface: SurfaceState
    reading: Reading
    force: float  # on the surface during the last step [N]
    mean: float  # over the last tick [N]
    depth: float  # of the tip, negative in free motion [m]


@law
def read_sensor(sensor, reading, force, time, noise):
    """The sensor after a step that ends at `time` [s]; `noise` are eight standard normal numbers of this tick.

    A sample is taken at its own time k/sampling, between two steps, so that the lag of the readings is known exactly.
    The force is constant over a step and is that of its beginning: with a low-pass the output is half a step late,
    without one a whole step.
    """
    z = sensor.E @ reading.z + force * sensor.e
    shown, value, samples = sensor.c @ z + sensor.d * force, reading.value, reading.samples
    due = int(time * sensor.sampling + 1e-9)  # the last sample's number, but for rounding
    if due >= samples:
        ago = (time - due / sensor.sampling) / sensor.step - 0.5 * (1.0 + sensor.d)
        exact = shown - ago * (shown - reading.shown) + sensor.noise * noise[due % 8]
        value = min(max(exact, -sensor.full_scale), sensor.full_scale)
        samples = due + 1.0
    return Reading(z, shown, value, samples)


@law
def apply_drive(cell, body, setpoint):
    """Fill the torque on the links: the set-point itself, or that of the springs to motors or set-points."""
    for i in range(len(body.q)):
        if cell.elastic == 0.0:
            body.drive[i] = setpoint[i]
        else:
            if cell.yields == 1.0:
                body.motor[i] = setpoint[i]
            else:
                pull = cell.first * (setpoint[i] - body.motor[i]) - cell.second * body.motor_rate[i]
                body.motor_rate[i] += cell.step * pull
                body.motor[i] += cell.step * body.motor_rate[i]
            stretch, rate = body.motor[i] - body.q[i], body.motor_rate[i] - body.qd[i]
            body.drive[i] = cell.spring[i] * stretch + cell.damper[i] * rate


@law
def tool_lever(cell, tip):
    """Lever by which a turning moves the tool's centre along the normal, relative to the tip [m]."""
    return cross(tip.R @ cell.tool.centre, cell.normal)


@law
def joints_of_tool(cell, body):
    """Number of joints for which the row of the tool's centre is filled: none for a tool without inertia."""
    return len(body.q) * int(cell.tool.inertia != 0.0)


@law
def rows_from_joints(cell, body, tip):
    """Fill the rows along the normal from the joints' axes."""
    lever, push = tool_lever(cell, tip), Wrench(cross(tip.p, cell.normal), cell.normal)
    for i in range(len(body.q)):
        body.normal[i] = push.power(axis_of(body.room, i))
    for i in range(joints_of_tool(cell, body)):
        body.centre[i] = body.normal[i] + axis_of(body.room, i).w @ lever


@law
def rows_from_jacobian(cell, body, tip):
    """Fill the rows along the normal from the Jacobian in the body's room."""
    J, lever = body.room.J, tool_lever(cell, tip)
    for i in range(len(body.q)):
        body.normal[i] = cell.normal @ Vec3(J[0, i], J[1, i], J[2, i])
    for i in range(joints_of_tool(cell, body)):
        body.centre[i] = body.normal[i] + Vec3(J[3, i], J[4, i], J[5, i]) @ lever


@law
def accelerations(cell, body, tip, touch):
    """Fill the joints' accelerations under drive and contact.

    Args:
        cell: all of it.
        body: filled with M, h and the rows along the normal of this moment, its drive with the torques.
        tip: of this moment.
        touch: after the step before.

    Returns:
        State of the surface, force on it [N], and depth of the tip [m].
    """
    n, room = len(body.q), body.room
    factorise(room.M, body.L)
    for i in range(n):
        body.yielding[i] = body.normal[i]
        body.qdd[i] = body.drive[i] - room.h[i]
    forward_both(body.L, body.yielding, body.qdd)
    mobility = product(body.L, body.yielding, body.yielding)
    free = cell.normal @ tip.a + product(body.L, body.yielding, body.qdd)
    v = 0.0
    for i in range(n):
        v += body.normal[i] * body.qd[i]
    p = cell.normal @ tip.p - cell.place
    surface, impulse = follow(cell.surface, touch.surface, touch.force, p, v, 1.0 / mobility, cell.step)
    late = v - 0.5 * cell.step * (cell.normal @ tip.a)
    elastic, opposed = opposing(cell.surface, surface, p, late, cell.step)
    force = surface.contact * contact_force(elastic, opposed, 1.0 / mobility, free)
    for i in range(n):
        body.qdd[i] -= body.yielding[i] * (max(force, 0.0) + impulse / cell.step)
    backward(body.L, body.qdd)
    return surface, force + impulse / cell.step, p


@law
def tool_force(tool, normal, tip, along):
    """Force along the normal that a tool adds to the sensor's reading, w + R b + m a of its centre [N].

    Args:
        tool: beyond the sensor.
        normal: into the surface.
        tip: of this moment.
        along: part of the centre's acceleration along the normal that is due to the joints' accelerations [m/s^2].
    """
    rest = normal @ (tool.weight + tip.R @ tool.bias)
    if tool.inertia == 0.0:
        return rest
    r = tip.R @ tool.centre
    return rest + tool.inertia * (along + normal @ (tip.a + cross(tip.dw, r) + cross(tip.w, cross(tip.w, r))))


@law
def tool_reading(cell, body, tip):
    """Force along the normal that the cell's tool adds to the reading after a step [N]."""
    along = 0.0
    for i in range(joints_of_tool(cell, body)):
        along += body.centre[i] * body.qdd[i]
    return tool_force(cell.tool, cell.normal, tip, along)


@law
def measure_touch(sensor, share, touch, surface, force, held, depth, time, noise):
    """The touch after a step; `share` is 1 over the steps in a tick, `held` the tool's force in the reading [N]."""
    felt = max(force, 0.0)
    reading = read_sensor(sensor, touch.reading, felt + held, time, noise)
    return TouchState(surface, reading, force, touch.mean + share * felt, depth)


@law
def tick(cell, body, touch, setpoint, k, noise):
    """The k-th tick under a constant set-point: torques [N m], or positions of the motors [rad, m], shape (n,).

    Semi-implicit Euler, first order; the contact force is solved together with the acceleration.
    """
    # A function with a branch counts references to its array arguments at each step: it gets no arrays.
    sensor, step, share = cell.sensor, cell.step, 1.0 / cell.steps
    touch = TouchState(touch.surface, touch.reading, touch.force, 0.0, touch.depth)
    for j in range(cell.steps):
        apply_drive(cell, body, setpoint)
        tip = chain_motion(cell.chain, body.q, body.qd, body.room)
        rows_from_joints(cell, body, tip)
        surface, force, depth = accelerations(cell, body, tip, touch)
        for i in range(len(body.q)):
            body.qd[i] += step * body.qdd[i]
            body.q[i] += step * body.qd[i]
        time = (k * cell.steps + j + 1) * step
        held = tool_reading(cell, body, tip)
        touch = measure_touch(sensor, share, touch, surface, force, held, depth, time, noise)
    return touch


@law
def step_foreign(cell, body, touch, tip, setpoint, time, noise):
    """Contact, sensor and drive of one step whose M, h and J another engine has filled in; it moves the arm."""
    apply_drive(cell, body, setpoint)
    rows_from_jacobian(cell, body, tip)
    surface, force, depth = accelerations(cell, body, tip, touch)
    held = tool_reading(cell, body, tip)
    return measure_touch(cell.sensor, 1.0 / cell.steps, touch, surface, force, held, depth, time, noise)


compiled_tick = kernel(tick)
compiled_foreign = kernel(step_foreign)
