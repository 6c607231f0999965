"""Constant modes, separated from the moving ones."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from palpate.arrays import Array

Complex = NDArray[np.complex128]
CONSTANT = 1e-5
"""Change in a period, in steps of `Motion`, under which a combination of the state is taken for one that never changes.

Above what differences leave of an exact zero, below what an integrator of a minute's time constant does.
"""


def change(scaled: Array) -> tuple[Array, Array, Array]:
    """transition - 1 in units of the steps, by its singular values, those of constants left out: U, s, V^T.

    Where the tip stuck to the surface, an integral that nothing feeds, weights that make no difference: such a
    combination of the state has the eigenvalue 1, which says nothing of stability. The range of transition - 1 is
    an invariant subspace without them.
    """
    U, s, Vt = np.linalg.svd(scaled - np.eye(len(scaled)))
    moves = s > CONSTANT
    return U[:, moves], s[moves], Vt[moves]


def moving(transition: Array, steps: Array) -> tuple[Complex, Complex]:
    """Eigenvalues of all that moves, shape (m,), and their vectors, shape (m, n).

    Args:
        transition: of the state over a period, shape (n, n).
        steps: units of the state's elements that make it well scaled, shape (n,).
    """
    kept = effective_states(transition)
    scaled = (transition / steps[:, None] * steps)[np.ix_(kept, kept)]
    into, _, _ = change(scaled)
    values, inside = np.linalg.eig(into.T @ scaled @ into)
    vectors = np.zeros((len(values), len(steps)), complex)
    vectors[:, kept] = (steps[kept, None] * (into @ inside)).T
    return values.astype(complex), vectors


def effective_states(transition: Array) -> NDArray[np.intp]:
    """Indices of states that affect others or decay alone: not of integrals without effect."""
    others = transition - np.diag(np.diag(transition))
    return np.flatnonzero(others.any(axis=0) | (np.abs(np.diag(transition) - 1.0) > CONSTANT))
