"""Positive definite systems of any small size, in place: no array is made inside a loop, and no root is taken.

A = L D L^T with ones on L's diagonal. One array holds L below its diagonal, 1/D on it, and D L^T above it.

Motion, wrench and inertia of rigid bodies, all about the world's origin and in the world's axes.

There twists, wrenches and inertias of all bodies simply add (Featherstone, 2008, ch. 2).
"""

from typing import NamedTuple

import numpy as np

from palpate._jit import law, part
from palpate._vector import Mat3, Vec3
from palpate.arrays import Array
from palpate.errors import InputError


@law
def factorise(A, L):
    """Fills L, 1/D and D L^T from A's lower triangle, shape (n, n)."""
    n = len(A)
    for j in range(n):
        total = A[j, j]
        for k in range(j):
            total -= L[j, k] * L[k, j]
        share = 1.0 / total
        L[j, j] = share
        for i in range(j + 1, n):
            total = A[i, j]
            for k in range(j):
                total -= L[i, k] * L[k, j]
            L[j, i] = total
            L[i, j] = share * total


@law
def forward(L, b):
    """b becomes L^-1 b, shape (n,)."""
    n = len(b)
    for k in range(n):
        for i in range(k + 1, n):
            b[i] -= L[i, k] * b[k]


@law
def forward_both(L, a, b):
    """a becomes L^-1 a and b L^-1 b, each L's element read once."""
    n = len(b)
    for k in range(n):
        p, q = a[k], b[k]
        for i in range(k + 1, n):
            a[i] -= L[i, k] * p
            b[i] -= L[i, k] * q


@law
def product(L, a, b):
    """a^T D^-1 b: of A^-1, where both went `forward`."""
    total = 0.0
    for k in range(len(a)):
        total += a[k] * b[k] * L[k, k]
    return total


@law
def backward(L, b):
    """b becomes L^-T D^-1 b, shape (n,)."""
    n = len(b)
    for i in range(n):
        b[i] *= L[i, i]
    for back in range(n):
        i = n - 1 - back
        for k in range(i):
            b[k] -= L[i, k] * b[i]


UNIT3 = Mat3(Vec3(1.0, 0.0, 0.0), Vec3(0.0, 1.0, 0.0), Vec3(0.0, 0.0, 1.0))


@law
def cross(a, b):
    """The cross product a x b."""
    return Vec3(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x)


@law
def squares(k, a, b):
    """k 1 + a a^T + b b^T, symmetric to the last bit."""
    xy, xz, yz = a.x * a.y + b.x * b.y, a.x * a.z + b.x * b.z, a.y * a.z + b.y * b.z
    xx, yy, zz = a.x * a.x + b.x * b.x, a.y * a.y + b.y * b.y, a.z * a.z + b.z * b.z
    return Mat3(Vec3(k + xx, xy, xz), Vec3(xy, k + yy, yz), Vec3(xz, yz, k + zz))


@law
def turned_about_z(R, c, s):
    """R Rz, of the angle's cosine and sine."""
    columns = R.T
    return Mat3(c * columns.r1 + s * columns.r2, c * columns.r2 - s * columns.r1, columns.r3).T


@part
class Twist(NamedTuple):
    """Turning [rad/s] of a body, and velocity [m/s] of its point at the origin; or the rates of both."""

    w: Vec3
    v: Vec3

    def __add__(a, b):
        return Twist(a.w + b.w, a.v + b.v)

    def __rmul__(a, k):
        return Twist(k * a.w, k * a.v)

    def carries(a, b):
        """The rate of b, which a body carries along whose twist is a."""
        return Twist(cross(a.w, b.w), cross(a.w, b.v) + cross(a.v, b.w))

    def at(a, p):
        """Velocity of the body's point p."""
        return a.v + cross(a.w, p)


@part
class Wrench(NamedTuple):
    """Moment about the origin [N m], and force [N]."""

    m: Vec3
    f: Vec3

    def __add__(a, b):
        return Wrench(a.m + b.m, a.f + b.f)

    def power(a, s):
        """Power on the twist s."""
        return a.m @ s.w + a.f @ s.v


@law
def load_at(mass, centre, moment, V, A):
    """Wrench that moves a body (Newton and Euler), from its inertia about its centre of mass, twist and rate."""
    w, dw = V.w, A.w
    f = mass * (A.at(centre) + cross(w, V.at(centre)))
    return Wrench(moment @ dw + cross(w, moment @ w) + cross(centre, f), f)


@part
class Inertia(NamedTuple):
    """Mass [kg], mass times its centre [kg m], second moment about the origin [kg m^2]."""

    mass: float
    first: Vec3
    second: Mat3

    def __add__(a, b):
        return Inertia(a.mass + b.mass, a.first + b.first, a.second + b.second)

    def momentum(a, s):
        """Of the twist s; or the wrench that gives the acceleration s."""
        return Wrench(a.second @ s.w + cross(a.first, s.v), a.mass * s.v - cross(a.first, s.w))


@law
def inertia_at(mass, centre, moment):
    """A body's inertia from that about its centre of mass, in the world's axes."""
    c, first = centre, mass * centre
    xx, yy, zz = first.x * c.x, first.y * c.y, first.z * c.z
    xy, xz, yz = first.x * c.y, first.x * c.z, first.y * c.z
    spread = Mat3(Vec3(yy + zz, -xy, -xz), Vec3(-xy, xx + zz, -yz), Vec3(-xz, -yz, xx + yy))
    return Inertia(mass, first, moment + spread)


for _cls in (Twist, Wrench, Inertia):
    _cls.__array_ufunc__ = None  # type: ignore[union-attr]  # NumPy leaves the operators to these classes


_ROUNDING = 1e-12
"""Rounding of an inertia tensor's eigenvalues, relative to the largest: some thousand last places of a float."""


def check_inertia(name: str, mass: float, moment: Array) -> str:
    """Defect of a link's inertia, in a sentence; "" if there is none.

    A body of positive density has principal moments of which none exceeds the sum of the others. Makers publish links
    that break this (Franka's link 4): an arm with such a link still moves by the same laws, so it is taken as it is.

    Args:
        name: of the link.
        mass: [kg].
        moment: about its centre of mass [kg m^2], shape (3, 3).

    Raises:
        InputError: a negative mass, or a moment of inertia that is negative about some axis.
    """
    if not (np.isfinite(mass) and mass >= 0.0):
        raise InputError(f"link {name}: a mass must be 0 kg or more, got {mass:g}")
    if not np.isfinite(moment).all() or not np.allclose(moment, moment.T, rtol=1e-9, atol=1e-15):
        raise InputError(f"link {name}: an inertia is six finite numbers of a symmetric matrix")
    smallest, middle, largest = np.linalg.eigvalsh(moment)
    if smallest < -_ROUNDING * max(abs(largest), abs(smallest)):
        raise InputError(
            f"link {name}: its inertia is none, the moment about one axis is {smallest:.4g} kg m^2; it must be "
            "0 or more about every axis: check signs and order (xx yy zz xy xz yz, about the centre of mass)"
        )
    excess = largest - (smallest + middle)
    if excess <= _ROUNDING * largest:
        return ""
    return (
        f"link {name}: its principal moments break the triangle inequality, {largest:.4g} > {smallest:.4g} + "
        f"{middle:.4g} kg m^2, so no body has them; taken as published"
    )
