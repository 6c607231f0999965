"""Vectors and matrices of three kinds, which mean the same: by value, bordered, and of any size."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate._vector import outer, solve
from palpate.identifiers.dimension import AnyNumber, Four, Three, eliminate

KINDS = [Three(), Four(), AnyNumber(3), AnyNumber(4), AnyNumber(6)]
kinds = pytest.mark.parametrize("size", KINDS, ids=str)


def numbers(n, seed=0):
    random = np.random.default_rng(seed)
    return random.standard_normal(n), random.standard_normal(n), *random.standard_normal((2, n, n))


def of(size, array):
    """The array as this kind has it."""
    return (size.vector if array.ndim == 1 else size.matrix)(array.ravel(), 0)


def back(size, value, shape):
    out = np.full(size.n ** len(shape) + 2, 7.0)
    (size.put_vector if len(shape) == 1 else size.put_matrix)(out, 1, value)
    assert out[0] == out[-1] == 7.0
    return out[1:-1].reshape(shape)


@kinds
def test_operators_are_those_of_arrays(size):
    a, b, A, B = numbers(size.n)
    u, v, M, N = (of(size, array) for array in (a, b, A, B))
    for ours, theirs in {
        "u + v": (u + v, a + b),
        "2 u": (2.0 * u, 2.0 * a),
        "u / v": (u / v, a / b),
        "M + N": (M + N, A + B),
        "M - N": (M - N, A - B),
        "2 M": (2.0 * M, 2.0 * A),
        "M u": (M @ u, A @ a),
        "M^T u": (M.T @ u, A.T @ a),
        "M N": (M @ N, A @ B),
        "M N^T": (M @ N.T, A @ B.T),
        "u v^T": (outer(u, v), np.outer(a, b)),
        "M^-1 u": (solve(M, u), np.linalg.solve(A, a)),
        "1": (size.identity(), np.eye(size.n)),
        "e_2": (size.axis(2), np.eye(size.n)[2]),
        "e_last": (size.axis(size.n - 1), np.eye(size.n)[-1]),
        "variances": (size.variances(M), np.diag(A @ A.T)),
    }.values():
        np.testing.assert_allclose(back(size, ours, theirs.shape), theirs, rtol=1e-12, atol=1e-13)
    assert u @ v == pytest.approx(a @ b, rel=1e-13)


@given(st.integers(1, 7), st.integers(0, 10_000), st.booleans())
def test_elimination_solves_whatever_the_pivots(n, seed, sparse):
    random = np.random.default_rng(seed)
    A, b = random.standard_normal((n, n)) + 0.1 * np.eye(n), random.standard_normal(n)
    if sparse:  # zeros on the diagonal: there is no going on without a swap
        A = random.permutation(np.eye(n)) * random.uniform(0.1, 10.0, n)
    x = eliminate(A.copy(), b.copy())
    np.testing.assert_allclose(A @ x, b, rtol=1e-7, atol=1e-9 * np.linalg.cond(A))
