"""Positive definite systems of any small size, in place: no array is made inside a loop.

The factor's diagonal holds reciprocals, so that solving divides by nothing.
"""

from palpate._jit import law
from palpate._vector import sqrt


@law
def factorise(A, L):
    """Fills the lower triangle of L with that of A = L L^T, its diagonal inverted, shape (n, n)."""
    n = len(A)
    for j in range(n):
        total = A[j, j]
        for k in range(j):
            total -= L[j, k] * L[j, k]
        share = 1.0 / sqrt(total)
        L[j, j] = share
        for i in range(j + 1, n):
            total = A[i, j]
            for k in range(j):
                total -= L[i, k] * L[j, k]
            L[i, j] = share * total


@law
def forward(L, b):
    """b becomes L^-1 b, shape (n,)."""
    for i in range(len(b)):
        total = b[i]
        for k in range(i):
            total -= L[i, k] * b[k]
        b[i] = total * L[i, i]


@law
def backward(L, b):
    """b becomes L^-T b, shape (n,)."""
    n = len(b)
    for back in range(n):
        i = n - 1 - back
        b[i] *= L[i, i]
        for k in range(i):
            b[k] -= L[i, k] * b[i]
