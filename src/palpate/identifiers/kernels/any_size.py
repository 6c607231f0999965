"""Vectors and matrices of any size for kernels, with the operators of `Vec3` and `Mat3`.

NumPy's own operators do the same where laws run as they stand. Compiled, each expression of theirs costs half a
second to compile, and several arrays each time it runs; one of these makes one array, and all of them compile
in the time of three of those.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from palpate._jit import law, part
from palpate.arrays import Array


@law
def eliminated(A, b):
    """x with A x = b, in b, by Gauss' elimination with pivots; A is used up. LAPACK costs more to call than it does."""
    n = len(b)
    for k in range(n):
        pivot = k
        for i in range(k + 1, n):
            if abs(A[i, k]) > abs(A[pivot, k]):
                pivot = i
        for j in range(n):
            A[k, j], A[pivot, j] = A[pivot, j], A[k, j]
        b[k], b[pivot] = b[pivot], b[k]
        for i in range(k + 1, n):
            factor = A[i, k] / A[k, k]
            b[i] -= factor * b[k]
            for j in range(k + 1, n):
                A[i, j] -= factor * A[k, j]
    for k in range(n - 1, -1, -1):
        for j in range(k + 1, n):
            b[k] -= A[k, j] * b[j]
        b[k] /= A[k, k]
    return b


@part
class Vector(NamedTuple):
    """n components; `+` and `/` work element by element, `@` is the dot product."""

    of: Array

    def __add__(a, b):
        out = np.empty(len(a.of))
        for i in range(len(out)):
            out[i] = a.of[i] + b.of[i]
        return Vector(out)

    def __rmul__(a, k):
        out = np.empty(len(a.of))
        for i in range(len(out)):
            out[i] = k * a.of[i]
        return Vector(out)

    def __truediv__(a, b):
        out = np.empty(len(a.of))
        for i in range(len(out)):
            out[i] = a.of[i] / b.of[i]
        return Vector(out)

    def __matmul__(a, b):
        total = 0.0
        for i in range(len(a.of)):
            total += a.of[i] * b.of[i]
        return total

    def map_left(b, A):
        """A b."""
        out = np.zeros(len(b.of))
        for i in range(len(out)):
            for j in range(len(out)):
                out[i] += A.of[i, j] * b.of[j]
        return Vector(out)

    def map_outer(a, b):
        """a b^T."""
        out = np.empty((len(a.of), len(a.of)))
        for i in range(len(out)):
            for j in range(len(out)):
                out[i, j] = a.of[i] * b.of[j]
        return Matrix(out)


@part
class Matrix(NamedTuple):
    """n rows of n; `+ -` work element by element, `@` takes a `Vector` or a `Matrix`."""

    of: Array

    def __add__(A, B):
        out = np.empty(A.of.shape)
        for i in range(len(out)):
            for j in range(len(out)):
                out[i, j] = A.of[i, j] + B.of[i, j]
        return Matrix(out)

    def __sub__(A, B):
        out = np.empty(A.of.shape)
        for i in range(len(out)):
            for j in range(len(out)):
                out[i, j] = A.of[i, j] - B.of[i, j]
        return Matrix(out)

    def __rmul__(A, k):
        out = np.empty(A.of.shape)
        for i in range(len(out)):
            for j in range(len(out)):
                out[i, j] = k * A.of[i, j]
        return Matrix(out)

    def __matmul__(A, b):
        return b.map_left(A)

    def map_left(B, A):
        """A B."""
        out = np.zeros(A.of.shape)
        for i in range(len(out)):
            for j in range(len(out)):
                for k in range(len(out)):
                    out[i, j] += A.of[i, k] * B.of[k, j]
        return Matrix(out)

    @property
    def T(A):
        """The transpose, where it is."""
        return Matrix(A.of.T)

    def map_solve(A, b):
        """x with A x = b."""
        return Vector(eliminated(A.of.copy(), b.of.copy()))


Vector.__array_ufunc__ = Matrix.__array_ufunc__ = None  # type: ignore[attr-defined]  # NumPy leaves the operators alone
