"""Four components by value: a `Vec3` and one more, and the `Mat3` with a border that maps them.

A surface with mass, damping, stiffness and an offset has four parameters; by value they cost no arrays.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from palpate._jit import part
from palpate._vector import Mat3, Vec3, outer
from palpate.identifiers.kernels.any_size import eliminated


@part
class Vec4(NamedTuple):
    """Four components; `+` and `/` work element by element, `@` is the dot product."""

    v: Vec3
    w: float

    def __add__(a, b):
        return Vec4(a.v + b.v, a.w + b.w)

    def __rmul__(a, k):
        return Vec4(k * a.v, k * a.w)

    def __truediv__(a, b):
        return Vec4(a.v / b.v, a.w / b.w)

    def __matmul__(a, b):
        return a.v @ b.v + a.w * b.w

    def map_left(b, A):
        """A b."""
        return Vec4(A.inner @ b.v + b.w * A.column, A.row @ b.v + A.corner * b.w)

    def map_outer(a, b):
        """a b^T."""
        return Mat4(outer(a.v, b.v), b.w * a.v, a.w * b.v, a.w * b.w)


@part
class Mat4(NamedTuple):
    """Four rows: [[inner, column], [row, corner]]; `+ -` work element by element, `@` takes a `Vec4` or a `Mat4`."""

    inner: Mat3
    column: Vec3
    row: Vec3
    corner: float

    def __add__(A, B):
        return Mat4(A.inner + B.inner, A.column + B.column, A.row + B.row, A.corner + B.corner)

    def __sub__(A, B):
        return Mat4(A.inner - B.inner, A.column - B.column, A.row - B.row, A.corner - B.corner)

    def __rmul__(A, k):
        return Mat4(k * A.inner, k * A.column, k * A.row, k * A.corner)

    def __matmul__(A, b):
        return b.map_left(A)

    def map_left(B, A):
        """A B."""
        return Mat4(
            A.inner @ B.inner + outer(A.column, B.row),
            A.inner @ B.column + B.corner * A.column,
            B.inner.T @ A.row + A.corner * B.row,
            A.row @ B.column + A.corner * B.corner,
        )

    @property
    def T(A):
        """The transpose."""
        return Mat4(A.inner.T, A.row, A.column, A.corner)

    def map_solve(A, b):
        """x with A x = b."""
        numbers, right = np.empty((4, 4)), np.empty(4)
        for i in range(3):
            numbers[i, 3], numbers[3, i], right[i] = A.column[i], A.row[i], b.v[i]
            for j in range(3):
                numbers[i, j] = A.inner[i][j]
        numbers[3, 3], right[3] = A.corner, b.w
        x = eliminated(numbers, right)
        return Vec4(Vec3(x[0], x[1], x[2]), x[3])


Vec4.__array_ufunc__ = Mat4.__array_ufunc__ = None  # type: ignore[attr-defined]  # NumPy leaves the operators alone
