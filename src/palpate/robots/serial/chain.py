"""Any serial arm as laws: kinematics, bias torque (Newton and Euler) and mass matrix (composite bodies) in two sweeps.

Written once for any number of revolute and prismatic joints: the arm's numbers and the results are arrays, what is
calculated with are values. One compiled version serves every arm.
"""

from typing import NamedTuple

import numpy as np

from palpate._jit import law, part
from palpate._vector import ZERO3, Mat3, Vec3, cos, sin
from palpate.arrays import Array
from palpate.errors import InputError
from palpate.robots.serial.linear import (
    UNIT3,
    Inertia,
    Twist,
    Wrench,
    cross,
    inertia_at,
    load_at,
    squares,
    turned_about_z,
)


@part
class KinematicChain(NamedTuple):
    """The numbers of a serial arm of n joints; each joint's axis is the z of its own frame.

    Args:
        at: origin of each joint's frame in the one before, at joint position 0 [m], shape (n, 3).
        turn: its axes there, shape (n, 3, 3).
        slide: 1 where the joint is prismatic, 0 where it is revolute, shape (n,).
        mass: of each link [kg], shape (n,).
        com: its centre of mass in its joint's frame [m], shape (n, 3).
        least: smallest principal moment of inertia about that centre [kg m^2], shape (n,).
        spread: what the inertia has beyond it, in that frame: least 1 + a a^T + b b^T, shape (n, 2, 3).
        rotor: inertia of motor and gear, felt at the joint [kg m^2; kg where it slides], shape (n,).
        tip: in the last joint's frame [m], shape (3,).
        tip_turn: its axes there, shape (3, 3).
        gravity: [m/s^2], shape (3,).
    """

    at: Array
    turn: Array
    slide: Array
    mass: Array
    com: Array
    least: Array
    spread: Array
    rotor: Array
    tip: Array
    tip_turn: Array
    gravity: Array

    @property
    def inertia(self) -> Array:
        """Inertia of each link about its centre of mass, in its joint's frame [kg m^2], shape (n, 3, 3)."""
        a = self.spread
        return self.least[:, None, None] * np.eye(3) + a.swapaxes(1, 2) @ a


@part
class Room(NamedTuple):
    """Where the laws put what they find, and what they need between the sweeps; `room_for` makes it."""

    M: Array  # mass matrix [kg m^2], shape (n, n)
    h: Array  # bias torque, gravity included [N m], shape (n,)
    J: Array  # Jacobian of the tip, velocity above turning, shape (6, n)
    axes: Array  # twist of each joint at unit rate, shape (n, 6)
    loads: Array  # what moving each link takes, shape (n, 6)
    bodies: Array  # inertia of each link, shape (n, 10)
    turns: Array  # cosine and sine of each joint's angle, shape (n, 2)


@part
class Tip(NamedTuple):
    """The tip, in the base's axes."""

    p: Vec3  # [m]
    R: Mat3
    v: Vec3  # [m/s]
    w: Vec3  # [rad/s]
    a: Vec3  # Jdot qd, of the velocity [m/s^2]
    dw: Vec3  # Jdot qd, of the turning [rad/s^2]


def spread_of(inertia: Array) -> tuple[Array, Array]:
    """`least` and `spread` of a `KinematicChain`, of inertias in any axes [kg m^2], shape (n, 3, 3).

    Raises:
        InputError: a number of them is not finite.
    """
    if not np.isfinite(inertia).all():
        raise InputError("the inertia of a link is not finite; mend its mass, its moments and its places")
    moments, axes = np.linalg.eigh(np.asarray(inertia, dtype=float).reshape(-1, 3, 3))
    beyond = np.sqrt(moments[:, 1:] - moments[:, :1])
    return moments[:, 0].copy(), np.ascontiguousarray(beyond[:, :, None] * axes.swapaxes(1, 2)[:, 1:])


def room_for(n: int) -> Room:
    """Room for an arm of n joints."""
    return Room(
        np.zeros((n, n)),
        np.zeros(n),
        np.zeros((6, n)),
        np.zeros((n, 6)),
        np.zeros((n, 6)),
        np.zeros((n, 10)),
        np.zeros((n, 2)),
    )


@law
def vector_at(a, i):
    """Row i as a vector."""
    return Vec3(a[i, 0], a[i, 1], a[i, 2])


@law
def matrix_at(a, i):
    """Page i as a matrix."""
    return Mat3(
        Vec3(a[i, 0, 0], a[i, 0, 1], a[i, 0, 2]),
        Vec3(a[i, 1, 0], a[i, 1, 1], a[i, 1, 2]),
        Vec3(a[i, 2, 0], a[i, 2, 1], a[i, 2, 2]),
    )


@law
def moment_at(chain, i, R):
    """Inertia of link i about its centre of mass, in the base's axes."""
    s = chain.spread
    a, b = R @ Vec3(s[i, 0, 0], s[i, 0, 1], s[i, 0, 2]), R @ Vec3(s[i, 1, 0], s[i, 1, 1], s[i, 1, 2])
    return squares(chain.least[i], a, b)


@law
def put_pair(a, i, u, v):
    """Two vectors into row i."""
    a[i, 0], a[i, 1], a[i, 2] = u.x, u.y, u.z
    a[i, 3], a[i, 4], a[i, 5] = v.x, v.y, v.z


@law
def axis_of(room, i):
    """Twist of joint i at unit rate."""
    s = room.axes
    return Twist(Vec3(s[i, 0], s[i, 1], s[i, 2]), Vec3(s[i, 3], s[i, 4], s[i, 5]))


@law
def load_of(room, i):
    """Wrench that moves link i."""
    f = room.loads
    return Wrench(Vec3(f[i, 0], f[i, 1], f[i, 2]), Vec3(f[i, 3], f[i, 4], f[i, 5]))


@law
def put_body(b, i, X):
    """An inertia into row i."""
    b[i, 0], b[i, 1], b[i, 2], b[i, 3] = X.mass, X.first.x, X.first.y, X.first.z
    b[i, 4], b[i, 5], b[i, 6] = X.second.r1.x, X.second.r2.y, X.second.r3.z
    b[i, 7], b[i, 8], b[i, 9] = X.second.r1.y, X.second.r1.z, X.second.r2.z


@law
def body_of(b, i):
    """The inertia in row i."""
    xy, xz, yz = b[i, 7], b[i, 8], b[i, 9]
    second = Mat3(Vec3(b[i, 4], xy, xz), Vec3(xy, b[i, 5], yz), Vec3(xz, yz, b[i, 6]))
    return Inertia(b[i, 0], Vec3(b[i, 1], b[i, 2], b[i, 3]), second)


@law
def outward(chain, q, qd, room):
    """From base to tip: axes, inertias and loads of all links; the tip.

    The base accelerates against gravity, which then needs no law of its own.
    """
    # Beforehand: a call among the vectors would put all of them from registers into memory and back.
    for i in range(len(q)):
        room.turns[i, 0], room.turns[i, 1] = cos(q[i]), sin(q[i])
    g = Vec3(chain.gravity[0], chain.gravity[1], chain.gravity[2])
    p, R = ZERO3, UNIT3
    V, A = Twist(ZERO3, ZERO3), Twist(ZERO3, -g)
    for i in range(len(q)):
        p = p + R @ vector_at(chain.at, i)
        R = R @ matrix_at(chain.turn, i)
        z = R.T.r3
        if chain.slide[i] == 0.0:
            R = turned_about_z(R, room.turns[i, 0], room.turns[i, 1])
            s = Twist(z, cross(p, z))
        else:
            p = p + q[i] * z
            s = Twist(ZERO3, z)
        step = qd[i] * s
        A = A + V.carries(step)
        V = V + step
        moment = moment_at(chain, i, R)
        mass, centre = chain.mass[i], p + R @ vector_at(chain.com, i)
        X = inertia_at(mass, centre, moment)
        load = load_at(mass, centre, moment, V, A)
        put_pair(room.axes, i, s.w, s.v)
        put_pair(room.loads, i, load.m, load.f)
        put_body(room.bodies, i, X)
    p = p + R @ Vec3(chain.tip[0], chain.tip[1], chain.tip[2])
    t = chain.tip_turn
    R = R @ Mat3(
        Vec3(t[0, 0], t[0, 1], t[0, 2]), Vec3(t[1, 0], t[1, 1], t[1, 2]), Vec3(t[2, 0], t[2, 1], t[2, 2])
    )
    v = V.at(p)
    return Tip(p, R, v, V.w, A.at(p) + cross(V.w, v) + g, A.w)


@law
def inward(chain, room):
    """From tip to base: bias torque, and the mass matrix' lower triangle, all that a factor of it needs."""
    load = Wrench(ZERO3, ZERO3)
    X = Inertia(0.0, ZERO3, 0.0 * UNIT3)
    n = len(room.h)
    for back in range(n):
        i = n - 1 - back
        load = load + load_of(room, i)
        X = X + body_of(room.bodies, i)
        s = axis_of(room, i)
        room.h[i] = load.power(s)
        push = X.momentum(s)
        for k in range(i + 1):
            room.M[i, k] = push.power(axis_of(room, k))
        room.M[i, i] += chain.rotor[i]


@law
def chain_motion(chain, q, qd, room):
    """Fills h, M's lower triangle and the joints' axes; the tip."""
    tip = outward(chain, q, qd, room)
    inward(chain, room)
    return tip


@law
def chain_model(chain, q, qd, room):
    """Fills M, h and J; the tip."""
    tip = chain_motion(chain, q, qd, room)
    for i in range(len(q)):
        for k in range(i):
            room.M[k, i] = room.M[i, k]
        s = axis_of(room, i)
        v = s.at(tip.p)
        room.J[0, i], room.J[1, i], room.J[2, i] = v.x, v.y, v.z
        room.J[3, i], room.J[4, i], room.J[5, i] = s.w.x, s.w.y, s.w.z
    return tip


@law
def jacobian_rate(qd, room, tip, Jdot):
    """Fills dJ/dt, shape (6, n), of the pose for which `chain_model` has filled the room."""
    V = Twist(ZERO3, ZERO3)
    for i in range(len(qd)):
        s = axis_of(room, i)
        V = V + qd[i] * s
        ds = V.carries(s)
        v = ds.at(tip.p) + cross(s.w, tip.v)
        Jdot[0, i], Jdot[1, i], Jdot[2, i] = v.x, v.y, v.z
        Jdot[3, i], Jdot[4, i], Jdot[5, i] = ds.w.x, ds.w.y, ds.w.z
