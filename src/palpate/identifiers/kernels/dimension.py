"""How many parameters there are: a part for each way to hold them, which reads and writes them in flat arrays.

Kernels are handed one of these and are compiled for it: three and four parameters by value, which makes no arrays,
other numbers of them as arrays.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from palpate._jit import part
from palpate._vector import Mat3, Vec3
from palpate.identifiers.kernels.any_size import Matrix, Vector
from palpate.identifiers.kernels.four import Mat4, Vec4

_AXES = Mat3(Vec3(1.0, 0.0, 0.0), Vec3(0.0, 1.0, 0.0), Vec3(0.0, 0.0, 1.0))
_NONE = Vec3(0.0, 0.0, 0.0)


@part
class Three(NamedTuple):
    """Three parameters, as `Vec3` and `Mat3`."""

    given: int = 3

    @property
    def n(self):
        """How many: a constant, so that kernels know where everything stands when they are compiled."""
        return 3

    def vector(self, numbers, k):
        """Three numbers from k on."""
        return Vec3(numbers[k], numbers[k + 1], numbers[k + 2])

    def matrix(self, numbers, k):
        """Nine numbers from k on, row by row."""
        return Mat3(self.vector(numbers, k), self.vector(numbers, k + 3), self.vector(numbers, k + 6))

    def put_vector(self, numbers, k, v):
        """Writes a vector from k on."""
        numbers[k], numbers[k + 1], numbers[k + 2] = v.x, v.y, v.z

    def put_matrix(self, numbers, k, A):
        """Writes a matrix from k on, row by row."""
        self.put_vector(numbers, k, A.r1)
        self.put_vector(numbers, k + 3, A.r2)
        self.put_vector(numbers, k + 6, A.r3)

    def axis(self, i):
        """The unit vector of parameter i."""
        return _AXES[i]

    def identity(self):
        """The unit matrix."""
        return _AXES

    def variances(self, S):
        """The diagonal of S S^T."""
        return Vec3(S.r1 @ S.r1, S.r2 @ S.r2, S.r3 @ S.r3)


@part
class Four(NamedTuple):
    """Four parameters, as `Vec4` and `Mat4`."""

    given: int = 4

    @property
    def n(self):
        """How many: a constant, so that kernels know where everything stands when they are compiled."""
        return 4

    def vector(self, numbers, k):
        """Four numbers from k on."""
        return Vec4(Vec3(numbers[k], numbers[k + 1], numbers[k + 2]), numbers[k + 3])

    def matrix(self, numbers, k):
        """Sixteen numbers from k on, row by row."""
        a, b, c = self.vector(numbers, k), self.vector(numbers, k + 4), self.vector(numbers, k + 8)
        d = self.vector(numbers, k + 12)
        return Mat4(Mat3(a.v, b.v, c.v), Vec3(a.w, b.w, c.w), d.v, d.w)

    def put_vector(self, numbers, k, v):
        """Writes a vector from k on."""
        numbers[k], numbers[k + 1], numbers[k + 2], numbers[k + 3] = v.v.x, v.v.y, v.v.z, v.w

    def put_matrix(self, numbers, k, A):
        """Writes a matrix from k on, row by row."""
        self.put_vector(numbers, k, Vec4(A.inner.r1, A.column.x))
        self.put_vector(numbers, k + 4, Vec4(A.inner.r2, A.column.y))
        self.put_vector(numbers, k + 8, Vec4(A.inner.r3, A.column.z))
        self.put_vector(numbers, k + 12, Vec4(A.row, A.corner))

    def axis(self, i):
        """The unit vector of parameter i."""
        return Vec4(_AXES[i], 0.0) if i < 3 else Vec4(_NONE, 1.0)

    def identity(self):
        """The unit matrix."""
        return Mat4(_AXES, _NONE, _NONE, 1.0)

    def variances(self, S):
        """The diagonal of S S^T."""
        a, b, c = S.inner
        p = Vec3(a @ a + S.column.x**2, b @ b + S.column.y**2, c @ c + S.column.z**2)
        return Vec4(p, S.row @ S.row + S.corner**2)


@part
class AnyNumber(NamedTuple):
    """n parameters, as arrays."""

    n: int

    def vector(self, numbers, k):
        """n numbers from k on, where they are."""
        return Vector(numbers[k : k + self.n])

    def matrix(self, numbers, k):
        """n rows of n from k on, where they are."""
        return Matrix(numbers[k : k + self.n * self.n].reshape(self.n, self.n))

    def put_vector(self, numbers, k, v):
        """Writes a vector from k on."""
        for i in range(self.n):
            numbers[k + i] = v.of[i]

    def put_matrix(self, numbers, k, A):
        """Writes a matrix from k on, row by row."""
        for i in range(self.n):
            for j in range(self.n):
                numbers[k + i * self.n + j] = A.of[i, j]

    def axis(self, i):
        """The unit vector of parameter i."""
        out = np.zeros(self.n)
        out[i] = 1.0
        return Vector(out)

    def identity(self):
        """The unit matrix."""
        return Matrix(np.eye(self.n))

    def variances(self, S):
        """The diagonal of S S^T."""
        out = np.zeros(self.n)
        for i in range(self.n):
            for j in range(self.n):
                out[i] += S.of[i, j] ** 2
        return Vector(out)


Size = Three | Four | AnyNumber


def size_of(n: int) -> Size:
    """The part for n parameters."""
    return Three() if n == 3 else Four() if n == 4 else AnyNumber(n)
