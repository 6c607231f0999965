"""The state of an estimator of n parameters, as one flat array that a kernel changes in place.

In this order: theta, root, left, passed, heard, white, added, six statistics, floor, even. See `ErrorCovariance`; floor
is the inverse of each initial variance, even that of their sum, n times.
"""

import numpy as np

from palpate._jit import law
from palpate.arrays import Array
from palpate.identifiers.kernels.error_covariance import NOTHING, ErrorCovariance
from palpate.identifiers.kernels.square_root import held

_STATISTICS = 6
"""Numbers that stand behind theta in the state: what is known of the residuals."""


def known_first(theta: Array, P: Array) -> Array:
    """The state before the first sample: the initial estimate and its covariance, shapes (n,) and (n, n)."""
    n = len(theta)
    root, identity = np.linalg.cholesky(P).ravel(), np.eye(n).ravel()
    heard, nothing, even = np.zeros(n * n), np.zeros(n + _STATISTICS), np.full(n, 1.0 / np.trace(P))
    return np.concatenate(
        [theta, root, root, identity, heard, NOTHING * root, nothing, 1.0 / np.diag(P), even]
    )


@law
def statistics_at(n):
    """Where the six statistics stand."""
    return 5 * n * n + 2 * n


@law
def length(n):
    """How many numbers the state of n parameters has."""
    return statistics_at(n) + _STATISTICS + 2 * n


@law
def error_covariance_in(state, size):
    """The doubt as a state has it."""
    n = size.n
    k, m, s = n + n * n, n * n, statistics_at(n)
    return ErrorCovariance(
        size.matrix(state, k),
        size.matrix(state, k + m),
        size.matrix(state, k + 2 * m),
        size.matrix(state, k + 3 * m),
        size.vector(state, s - n),
        state[s],
        state[s + 1],
        state[s + 2],
        state[s + 3],
        state[s + 4],
        state[s + 5],
    )


def covariance_in(state: Array, n: int) -> Array:
    """S S^T, shape (n, n)."""
    root = state[n : n + n * n].reshape(n, n)
    return np.asarray(root @ root.T)


@law
def put(state, size, theta, S, doubt):
    """Writes an estimate, its root and its doubt into a state."""
    n = size.n
    k, m, s = n + n * n, n * n, statistics_at(n)
    size.put_vector(state, 0, theta)
    size.put_matrix(state, n, S)
    size.put_matrix(state, k, doubt.left)
    size.put_matrix(state, k + m, doubt.passed)
    size.put_matrix(state, k + 2 * m, doubt.heard)
    size.put_matrix(state, k + 3 * m, doubt.white)
    size.put_vector(state, s - n, doubt.added)
    state[s], state[s + 1], state[s + 2] = doubt.weight, doubt.squares, doubt.products
    state[s + 3], state[s + 4], state[s + 5] = doubt.last, doubt.blocks, doubt.filled


@law
def bounded(S, floor, even, size):
    """S held on every axis, once its variances add up to more than at the start, as they are or each over its own."""
    v = size.variances(S)
    if v @ floor > size.n or v @ even > 1.0:
        for i in range(size.n):
            S = held(S, size.axis(i), floor)
    return S
