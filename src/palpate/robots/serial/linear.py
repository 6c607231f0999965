"""Positive definite systems of any small size, in place: no array is made inside a loop, and no root is taken.

A = L D L^T with ones on L's diagonal. One array holds L below its diagonal, 1/D on it, and D L^T above it.
"""

from palpate._jit import law


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
