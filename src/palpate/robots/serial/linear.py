"""Positive definite systems of any small size, in place: no array is made inside a loop."""

from palpate._jit import law
from palpate._vector import sqrt


@law
def factorise(A, L):
    """Fills the lower triangle of L with that of A = L L^T, shape (n, n)."""
    n = len(A)
    for i in range(n):
        for j in range(i + 1):
            total = A[i, j]
            for k in range(j):
                total -= L[i, k] * L[j, k]
            L[i, j] = sqrt(total) if i == j else total / L[j, j]


@law
def forward(L, b):
    """b becomes L^-1 b, shape (n,)."""
    for i in range(len(b)):
        total = b[i]
        for k in range(i):
            total -= L[i, k] * b[k]
        b[i] = total / L[i, i]


@law
def backward(L, b):
    """b becomes L^-T b, shape (n,)."""
    n = len(b)
    for back in range(n):
        i = n - 1 - back
        total = b[i]
        for k in range(i + 1, n):
            total -= L[k, i] * b[k]
        b[i] = total / L[i, i]
