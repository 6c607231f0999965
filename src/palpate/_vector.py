"""Three-vectors, pairs of them, 3x3 matrices by value, with operators, and the few functions of which laws are made.

A law calls only operators, ``.T`` and the functions of this file. Each has three meanings: on numbers and on
`Vec3`/`Mat3` (plain Python, or compiled by Numba through `palpate._jit`), and on NumPy arrays of any size.
The components of a `Vec3` may themselves be arrays: then the vector is a batch of vectors.

This file knows no Numba.
"""

import math
from typing import NamedTuple

import numpy as np


class Vec3(NamedTuple):
    """Three components; `+ - * /` work element by element, `@` is the dot product."""

    x: float
    y: float
    z: float

    def __add__(a, b):
        b = widen(b)
        return Vec3(a.x + b.x, a.y + b.y, a.z + b.z)

    def __radd__(a, k):
        return Vec3(k + a.x, k + a.y, k + a.z)

    def __sub__(a, b):
        b = widen(b)
        return Vec3(a.x - b.x, a.y - b.y, a.z - b.z)

    def __rsub__(a, k):
        return Vec3(k - a.x, k - a.y, k - a.z)

    def __mul__(a, b):
        b = widen(b)
        return Vec3(a.x * b.x, a.y * b.y, a.z * b.z)

    def __rmul__(a, k):
        return Vec3(k * a.x, k * a.y, k * a.z)

    def __truediv__(a, b):
        b = widen(b)
        return Vec3(a.x / b.x, a.y / b.y, a.z / b.z)

    def __neg__(a):
        return Vec3(-a.x, -a.y, -a.z)

    def __abs__(a):
        return Vec3(abs(a.x), abs(a.y), abs(a.z))

    def __matmul__(a, b):
        return a.x * b.x + a.y * b.y + a.z * b.z

    def map_left(b, A):
        return Vec3(A.r1 @ b, A.r2 @ b, A.r3 @ b)

    def map_outer(a, b):
        return Mat3(a.x * b, a.y * b, a.z * b)

    def map_exp(a):
        return Vec3(exp(a.x), exp(a.y), exp(a.z))

    def map_sqrt(a):
        return Vec3(sqrt(a.x), sqrt(a.y), sqrt(a.z))

    def map_sign(a):
        return Vec3(sign(a.x), sign(a.y), sign(a.z))

    def map_clip(a, limit):
        limit = widen(limit)
        return Vec3(clip(a.x, limit.x), clip(a.y, limit.y), clip(a.z, limit.z))


class Mat3(NamedTuple):
    """Three rows; `+ - * /` work element by element, `@` takes a `Vec3` or a `Mat3`."""

    r1: Vec3
    r2: Vec3
    r3: Vec3

    def __add__(A, B):
        return Mat3(A.r1 + B.r1, A.r2 + B.r2, A.r3 + B.r3)

    def __sub__(A, B):
        return Mat3(A.r1 - B.r1, A.r2 - B.r2, A.r3 - B.r3)

    def __rmul__(A, k):
        return Mat3(k * A.r1, k * A.r2, k * A.r3)

    def __truediv__(A, k):
        return Mat3(A.r1 / k, A.r2 / k, A.r3 / k)

    def __neg__(A):
        return Mat3(-A.r1, -A.r2, -A.r3)

    def __matmul__(A, b):
        return b.map_left(A)

    def map_left(B, A):
        columns = B.T
        return Mat3(A @ columns.r1, A @ columns.r2, A @ columns.r3).T

    @property
    def T(A):
        return Mat3(Vec3(A.r1.x, A.r2.x, A.r3.x), Vec3(A.r1.y, A.r2.y, A.r3.y), Vec3(A.r1.z, A.r2.z, A.r3.z))

    def map_trace(A):
        return A.r1.x + A.r2.y + A.r3.z

    def map_solve(A, b):
        # Cramer's rule: exact enough for the well-conditioned 3x3 systems here (relative error ~ cond * eps).
        (a, b1, c), (d, e, f), (g, h, i) = A.r1, A.r2, A.r3
        u, v, w = e * i - f * h, f * g - d * i, d * h - e * g
        adjugate = Mat3(
            Vec3(u, c * h - b1 * i, b1 * f - c * e),
            Vec3(v, a * i - c * g, c * d - a * f),
            Vec3(w, b1 * g - a * h, a * e - b1 * d),
        )
        return (1.0 / (a * u + b1 * v + c * w)) * (adjugate @ b)

    def map_resolve(J, a, M):
        return J.map_solve(a)


class Vec6(NamedTuple):
    """Two vectors, of translation and of rotation; the operators of `Vec3`, `@` the dot product of both."""

    lin: Vec3
    ang: Vec3

    def __add__(a, b):
        return Vec6(a.lin + linear(b), a.ang + angular(b))

    def __radd__(a, k):
        return Vec6(k + a.lin, k + a.ang)

    def __sub__(a, b):
        return Vec6(a.lin - linear(b), a.ang - angular(b))

    def __rsub__(a, k):
        return Vec6(k - a.lin, k - a.ang)

    def __mul__(a, b):
        return Vec6(a.lin * linear(b), a.ang * angular(b))

    def __rmul__(a, k):
        return Vec6(k * a.lin, k * a.ang)

    def __truediv__(a, b):
        return Vec6(a.lin / linear(b), a.ang / angular(b))

    def __neg__(a):
        return Vec6(-a.lin, -a.ang)

    def __abs__(a):
        return Vec6(abs(a.lin), abs(a.ang))

    def __matmul__(a, b):
        return a.lin @ b.lin + a.ang @ b.ang

    def map_left(b, A):
        return A.on(b)

    def map_exp(a):
        return Vec6(exp(a.lin), exp(a.ang))

    def map_sqrt(a):
        return Vec6(sqrt(a.lin), sqrt(a.ang))

    def map_sign(a):
        return Vec6(sign(a.lin), sign(a.ang))

    def map_clip(a, limit):
        return Vec6(clip(a.lin, linear(limit)), clip(a.ang, angular(limit)))

    def map_linear(a):
        return a.lin

    def map_angular(a):
        return a.ang


for _cls in (Vec3, Mat3, Vec6):
    _cls.__array_ufunc__ = None  # type: ignore[attr-defined]  # NumPy leaves the operators to these classes

ZERO3 = Vec3(0.0, 0.0, 0.0)


def widen(b):
    """A number as the vector that has it three times; a vector as it is."""
    return b if isinstance(b, tuple) else Vec3(b, b, b)


def linear(b):
    """The translation of a pair of vectors; a number as it is."""
    return b.map_linear() if isinstance(b, tuple) else b


def angular(b):
    """The rotation of a pair of vectors; a number as it is."""
    return b.map_angular() if isinstance(b, tuple) else b


def outer(a, b):
    """Outer product a b^T of two vectors."""
    return a.map_outer(b) if isinstance(a, tuple) else np.outer(a, b)


def exp(a):
    if isinstance(a, tuple):
        return a.map_exp()
    return np.exp(a) if isinstance(a, np.ndarray) else math.exp(a)


def sqrt(a):
    if isinstance(a, tuple):
        return a.map_sqrt()
    return np.sqrt(a) if isinstance(a, np.ndarray) else math.sqrt(a)


def sign(a):
    """-1.0, 0.0 or 1.0."""
    if isinstance(a, tuple):
        return a.map_sign()
    if isinstance(a, np.ndarray):
        return np.sign(a)
    return float(int(a > 0.0) - int(a < 0.0))


def sin(a):
    return np.sin(a) if isinstance(a, np.ndarray) else math.sin(a)


def cos(a):
    return np.cos(a) if isinstance(a, np.ndarray) else math.cos(a)


def atan2(y, x):
    """The angle of (x, y), in [-pi, pi]."""
    return np.arctan2(y, x) if isinstance(y, np.ndarray) else math.atan2(y, x)


def clip(a, limit):
    """a held within -limit ... +limit."""
    if isinstance(a, tuple):
        return a.map_clip(limit)
    return np.clip(a, -limit, limit) if isinstance(a, np.ndarray) else min(max(a, -limit), limit)


def trace(A):
    """The sum of the diagonal."""
    return A.map_trace() if isinstance(A, tuple) else np.trace(A)


def diagonal(v):
    """The matrix with v on its diagonal and zero elsewhere: for setting up, not a law's word."""
    return Mat3(Vec3(v.x, 0.0, 0.0), Vec3(0.0, v.y, 0.0), Vec3(0.0, 0.0, v.z))


def solve(A, b):
    """x with A x = b."""
    return A.map_solve(b) if isinstance(A, tuple) else np.linalg.solve(A, b)


def resolve(J, a, M):
    """The joint acceleration whose task acceleration is a: J^-1 a.

    Of a redundant arm the one of least kinetic energy, M^-1 J^T (J M^-1 J^T)^-1 a (Khatib, 1987).
    """
    if isinstance(J, tuple):
        return J.map_resolve(a, M)
    if J.shape[0] == J.shape[1]:
        return np.linalg.solve(J, a)
    weighted = np.linalg.solve(M, J.T)
    return weighted @ np.linalg.solve(J @ weighted, a)


#: Functions that a class answers with its own method of this name.
METHODS = {
    linear: "map_linear",
    angular: "map_angular",
    outer: "map_outer",
    exp: "map_exp",
    sqrt: "map_sqrt",
    sign: "map_sign",
    clip: "map_clip",
    trace: "map_trace",
    solve: "map_solve",
    resolve: "map_resolve",
}
