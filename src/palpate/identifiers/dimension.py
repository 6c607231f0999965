"""How many parameters there are: a part for each way to hold them, which reads and writes them in flat arrays.

Kernels are handed one of these and are compiled for it: three and four parameters by value, which makes no arrays,
other numbers of them as arrays. Four are a `Vec3` and one more: a surface with mass, damping, stiffness and an offset
has four. Vectors and matrices of any size have the operators of
`Vec3` and `Mat3`: NumPy's own do the same where laws run as they stand, but compiled, each expression of theirs costs
half a second to compile, and several arrays each time it runs; one of these makes one array, and all of them compile
in the time of three of those.
"""

from typing import NamedTuple

import numpy as np

from palpate._jit import law, part
from palpate._vector import Mat3, Vec3
from palpate.arrays import Array


@law
def eliminate(A, b):
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
        """The matrix product from the left."""
        out = np.zeros(len(b.of))
        for i in range(len(out)):
            for j in range(len(out)):
                out[i] += A.of[i, j] * b.of[j]
        return Vector(out)

    def map_outer(a, b):
        """The outer product a b^T."""
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
        """The matrix product from the left."""
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
        return Vector(eliminate(A.of.copy(), b.of.copy()))


Vector.__array_ufunc__ = Matrix.__array_ufunc__ = None  # type: ignore[attr-defined]  # NumPy leaves the operators alone


@part
class Vec4(NamedTuple):
    """Four components; `+ - /` work element by element, `@` is the dot product."""

    v: Vec3
    w: float

    def __add__(a, b):
        return Vec4(a.v + b.v, a.w + b.w)

    def __sub__(a, b):
        return Vec4(a.v - b.v, a.w - b.w)

    def __rmul__(a, k):
        return Vec4(k * a.v, k * a.w)

    def __truediv__(a, b):
        return Vec4(a.v / b.v, a.w / b.w)

    def __matmul__(a, b):
        return a.v @ b.v + a.w * b.w

    def map_left(b, A):
        """The matrix product from the left."""
        return Vec4(Vec3(A.r1 @ b, A.r2 @ b, A.r3 @ b), A.r4 @ b)

    def map_outer(a, b):
        """The outer product a b^T."""
        return Mat4(a.v.x * b, a.v.y * b, a.v.z * b, a.w * b)


@part
class Mat4(NamedTuple):
    """Four rows; `+ -` work element by element, `@` takes a `Vec4` or a `Mat4`."""

    r1: Vec4
    r2: Vec4
    r3: Vec4
    r4: Vec4

    def __add__(A, B):
        return Mat4(A.r1 + B.r1, A.r2 + B.r2, A.r3 + B.r3, A.r4 + B.r4)

    def __sub__(A, B):
        return Mat4(A.r1 - B.r1, A.r2 - B.r2, A.r3 - B.r3, A.r4 - B.r4)

    def __rmul__(A, k):
        return Mat4(k * A.r1, k * A.r2, k * A.r3, k * A.r4)

    def __matmul__(A, b):
        return b.map_left(A)

    def map_left(B, A):
        """The matrix product from the left."""
        C = B.T
        return Mat4(C @ A.r1, C @ A.r2, C @ A.r3, C @ A.r4)

    @property
    def T(A):
        """The transpose of the matrix."""
        a, b, c, d = A.r1, A.r2, A.r3, A.r4
        return Mat4(
            Vec4(Vec3(a.v.x, b.v.x, c.v.x), d.v.x),
            Vec4(Vec3(a.v.y, b.v.y, c.v.y), d.v.y),
            Vec4(Vec3(a.v.z, b.v.z, c.v.z), d.v.z),
            Vec4(Vec3(a.w, b.w, c.w), d.w),
        )

    def map_solve(A, b):
        """x with A x = b."""
        numbers, right = np.empty((4, 4)), np.empty(4)
        numbers[0, 0], numbers[0, 1], numbers[0, 2], numbers[0, 3] = A.r1.v.x, A.r1.v.y, A.r1.v.z, A.r1.w
        numbers[1, 0], numbers[1, 1], numbers[1, 2], numbers[1, 3] = A.r2.v.x, A.r2.v.y, A.r2.v.z, A.r2.w
        numbers[2, 0], numbers[2, 1], numbers[2, 2], numbers[2, 3] = A.r3.v.x, A.r3.v.y, A.r3.v.z, A.r3.w
        numbers[3, 0], numbers[3, 1], numbers[3, 2], numbers[3, 3] = A.r4.v.x, A.r4.v.y, A.r4.v.z, A.r4.w
        right[0], right[1], right[2], right[3] = b.v.x, b.v.y, b.v.z, b.w
        x = eliminate(numbers, right)
        return Vec4(Vec3(x[0], x[1], x[2]), x[3])


Vec4.__array_ufunc__ = Mat4.__array_ufunc__ = None  # type: ignore[attr-defined]  # NumPy leaves the operators alone


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
        """The unit matrix of this size."""
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
        a, b = self.vector(numbers, k), self.vector(numbers, k + 4)
        return Mat4(a, b, self.vector(numbers, k + 8), self.vector(numbers, k + 12))

    def put_vector(self, numbers, k, v):
        """Writes a vector from k on."""
        numbers[k], numbers[k + 1], numbers[k + 2], numbers[k + 3] = v.v.x, v.v.y, v.v.z, v.w

    def put_matrix(self, numbers, k, A):
        """Writes a matrix from k on, row by row."""
        self.put_vector(numbers, k, A.r1)
        self.put_vector(numbers, k + 4, A.r2)
        self.put_vector(numbers, k + 8, A.r3)
        self.put_vector(numbers, k + 12, A.r4)

    def axis(self, i):
        """The unit vector of parameter i."""
        return Vec4(_AXES[i], 0.0) if i < 3 else Vec4(_NONE, 1.0)

    def identity(self):
        """The unit matrix of this size."""
        return Mat4(self.axis(0), self.axis(1), self.axis(2), self.axis(3))

    def variances(self, S):
        """The diagonal of S S^T."""
        return Vec4(Vec3(S.r1 @ S.r1, S.r2 @ S.r2, S.r3 @ S.r3), S.r4 @ S.r4)


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
        """The unit matrix of this size."""
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
