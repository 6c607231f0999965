"""A norm in which matrices contract: of one from Lyapunov's equation, of several at once by an interior point.

What these functions find is not trusted: `cells` checks it by norms alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from palpate.arrays import Array

EPS = float(np.finfo(np.float64).eps)
_STEPS = 60
_ROWS = 16
"""Rows of a product at a time: below the size from which BLAS starts threads, which cost more than they bring."""
_MARGIN = 1e-9
_HEAVIER, _HEAVIEST = 8.0, 1e13


def single(Phi: Array, weight: Array | None = None) -> Array | None:
    """L with |L^T Phi L^-T| < 1, shape (n, n); None if Phi is not stable.

    Lyapunov's equation P = W + Phi^T P Phi of Phi over a rate between its spectral radius and 1, so that what is near
    Phi contracts too.

    Args:
        Phi: shape (n, n).
        weight: W, shape (n, n); one in units in which Phi is balanced if left out.
    """
    rate = _rate(Phi)
    if rate is None:
        return None
    if weight is not None:
        return _root(_lyapunov_sum(Phi / rate, weight))
    scale = _balance(Phi)
    P = _lyapunov_sum(Phi / scale[:, None] * scale / rate, np.eye(len(Phi)))
    return _root(P / np.outer(scale, scale))


def weight_of(L: Array, Phi: Array) -> Array:
    """W with which Lyapunov's equation of Phi has L for an answer: near Phi, others have one as good by it."""
    P = L @ L.T
    rate = _rate(Phi) or 1.0
    return np.asarray(P - Phi.T @ P @ Phi / rate**2)


def _rate(Phi: Array) -> float | None:
    radius = float(np.abs(np.linalg.eigvals(Phi)).max())
    return 0.5 * (1.0 + radius) if radius < 1.0 else None


def _lyapunov_sum(A: Array, W: Array) -> Array:
    """P = W + A^T P A of a stable A: the sum of all A^T^k W A^k, with twice as many terms at each step.

    For one matrix of this size several times as fast as SciPy's solvers.
    """
    P = W
    for _ in range(_STEPS):
        more = A.T @ P @ A
        P = P + more
        A = A @ A
        if np.trace(more) <= EPS * np.trace(P):
            break
    return P


def common(matrices: Sequence[Array], near: Array) -> Array | None:
    """L with |L^T Phi L^-T| < 1 for all of these matrices, shape (n, n); None if none is found.

    Newton's method on the barrier -log det of P - Phi_i^T P Phi_i + s W, of P and of 1 - P, s being made small; W is
    what `near` contracts by in its own norm, so that a slow direction is asked for no more than it can.

    Args:
        matrices: each of shape (n, n).
        near: of which the search takes its coordinates: one of them, or of their mean; stable.
    """
    start = single(near)
    if start is None:
        return None
    back = np.linalg.inv(start.T)
    inside = [start.T @ Phi @ back for Phi in matrices]
    middle = start.T @ near @ back
    P = _interior(inside, np.eye(len(middle)) - middle.T @ middle)
    if P is None:
        return None
    return start @ _chol(P)


def common_beside(matrices: Sequence[Array], still: Array) -> Array | None:
    """L as of `common`, where all matrices come near to one that keeps one combination of the state for ever.

    With a gain, or a stiffness, of next to nothing the integrator stands still: P - Phi^T P Phi has to vanish in its
    direction r, so that P r is the left eigenvector l. P is then a block for all that l leaves out, and one number.

    Args:
        matrices: each of shape (n, n).
        still: with one eigenvalue 1, all others inside the unit circle, shape (n, n).
    """
    U, _, Vt = np.linalg.svd(still - np.eye(len(still)))
    left = U[:, -1]
    right = Vt[-1]
    S = np.column_stack([U[:, :-1], right / (left @ right)])
    into = np.asarray(np.linalg.inv(S))
    start = single((into @ still @ S)[:-1, :-1])
    if start is None:
        return None
    T = np.eye(len(S))
    T[:-1, :-1] = start.T
    back = np.asarray(np.linalg.inv(T))
    inside = [T @ into @ Phi @ S @ back for Phi in matrices]
    apart = max(inside, key=lambda M: float(np.linalg.norm(M[:-1, -1])))
    T[-1, -1] = np.sqrt(np.linalg.norm(apart[:-1, -1]) / max(float(np.linalg.norm(apart[-1, :-1])), 1e-300))
    back = np.asarray(np.linalg.inv(T))
    inside = [T @ into @ Phi @ S @ back for Phi in matrices]
    P = _interior(inside, np.eye(len(S)), apart=1)
    return None if P is None else (T @ into).T @ _chol(P)


def _interior(matrices: Sequence[Array], slack: Array, apart: int = 0) -> Array | None:
    """P, 0 < P < 1, with Phi^T P Phi < P for all.

    Args:
        matrices: each of shape (n, n).
        slack: W > 0 in P - Phi^T P Phi + s W, of which s is brought below 0, shape (n, n).
        apart: rows of P, the last ones, that have nothing beside the diagonal.
    """
    Phi = np.array(matrices)
    n = Phi.shape[1]
    basis = _Symmetric.of(n, apart)
    P = 0.5 * np.eye(n)
    unit = np.linalg.inv(np.linalg.cholesky(slack))
    s = 2.0 * float(np.linalg.eigvalsh(unit @ (_map_through(P, Phi) - P) @ unit.T).max()) + 1.0
    weight = 1.0
    for _ in range(_STEPS):
        for _ in range(4):
            gradient, hessian = _barrier(P, s, Phi, slack, basis)
            gradient[-1] += weight
            step = _newton(hessian, gradient)
            if step is None:
                return P if _contracts(P, Phi) else None
            decrement = float(-gradient @ step)
            P, s = _along(P, s, (basis.matrix(step[:-1]), float(step[-1])), Phi, slack)
            if s < 0.0 and _contracts(P, Phi):
                return P
            if decrement < 0.3:
                break
        # On the central path s is within (sum of all sizes)/weight of the least there is.
        if s > 2.0 * n * (len(Phi) + 2) / weight or weight > _HEAVIEST:
            return None
        weight *= _HEAVIER
    return None


@dataclass(frozen=True)
class _Symmetric:
    """Coordinates of a symmetric matrix: an element on or above the diagonal each, in units of one length.

    Args:
        rows: of the elements, shape (k,).
        columns: shape (k,).
        unit: half a unit of each, beside its own transpose, shape (k,).
    """

    rows: NDArray[np.intp]
    columns: NDArray[np.intp]
    unit: Array

    @classmethod
    def of(cls, n: int, apart: int) -> _Symmetric:
        """Coordinates of matrices of shape (n, n); see `_interior` for `apart`."""
        rows, columns = np.triu_indices(n)
        free = (columns < n - apart) | (rows == columns)
        rows = rows[free]
        columns = columns[free]
        return cls(rows, columns, np.where(rows == columns, 0.5, np.sqrt(0.5)))

    def matrix(self, numbers: Array) -> Array:
        """The matrix that has these coordinates, shape (n, n)."""
        n = int(self.rows[-1]) + 1
        half = np.zeros((n, n))
        half[self.rows, self.columns] = self.unit * numbers
        return half + half.T

    def inner(self, M: Array) -> Array:
        """Inner products of the unit of each with M, shape (k, ...) of (n, n, ...)."""
        both = M[self.rows, self.columns] + M[self.columns, self.rows]
        return np.asarray(self.unit.reshape(-1, *[1] * (M.ndim - 2)) * both)


def _barrier(P: Array, s: float, Phi: Array, W: Array, basis: _Symmetric) -> tuple[Array, Array]:
    """Gradient and Hessian, by P's coordinates and s, of -log det of P, 1 - P and all P - Phi^T P Phi + s W.

    With S the inverse of a constraint, T = S Phi^T and U = Phi T, its part of the Hessian is tr S E S F - tr T E T^T F
    - tr T F T^T E + tr U E U F for units E and F: of all constraints together, Kronecker squares.
    """
    k = len(basis.rows)
    back = Phi.transpose(0, 2, 1)
    ends = np.linalg.inv(np.array([P, np.eye(len(P)) - P]))
    S = np.linalg.inv(_constraints(P, s, Phi, W))
    T = S @ back
    U = Phi @ T
    R = S @ W @ S
    gradient = np.empty(k + 1)
    hessian = np.empty((k + 1, k + 1))
    gradient[:k] = basis.inner(ends[1] - ends[0] - S.sum(axis=0) + U.sum(axis=0))
    gradient[k] = -np.sum(S * W)
    block = basis.inner(basis.inner(_kronecker(np.concatenate([ends, S, U]), T)).transpose(1, 2, 0))
    hessian[:k, :k] = 0.5 * (block + block.T)
    hessian[k, :k] = hessian[:k, k] = basis.inner((R - Phi @ R @ back).sum(axis=0))
    hessian[k, k] = np.sum(R * W)
    return gradient, hessian


def _kronecker(squared: Array, twice: Array) -> Array:
    """Sum of all S x S less 2 T x T, shape (n, n, n, n), by products of long matrices."""
    n = squared.shape[-1]
    a = squared.reshape(len(squared), -1)
    b = twice.reshape(len(twice), -1)
    both = np.empty((n * n, n * n))
    for row in range(0, n * n, _ROWS):
        rows = slice(row, row + _ROWS)
        both[rows] = a[:, rows].T @ a - 2.0 * (b[:, rows].T @ b)
    return both.reshape(n, n, n, n).transpose(0, 2, 1, 3)


def _newton(hessian: Array, gradient: Array) -> Array | None:
    """The step, by Cholesky; None where rounding won.

    `numpy.linalg.solve` starts threads for a matrix of this size.
    """
    from scipy.linalg import LinAlgError, cho_factor, cho_solve

    scale = 1.0 / np.sqrt(np.diag(hessian))
    try:
        factor = cho_factor(hessian * np.outer(scale, scale), check_finite=False)
    except LinAlgError:
        return None
    step = -scale * cho_solve(factor, scale * gradient, check_finite=False)
    return step if np.isfinite(step).all() else None


def _map_through(P: Array, Phi: Array) -> Array:
    return Phi.transpose(0, 2, 1) @ P @ Phi


def _constraints(P: Array, s: float, Phi: Array, W: Array) -> Array:
    return P - _map_through(P, Phi) + s * W


def _along(P: Array, s: float, step: tuple[Array, float], Phi: Array, W: Array) -> tuple[Array, float]:
    """Go along a step as far as all constraints stay met."""
    length = 1.0
    for _ in range(40):
        Q = P + length * step[0]
        t = s + length * step[1]
        if _positive(np.concatenate([[Q, np.eye(len(P)) - Q], _constraints(Q, t, Phi, W)])):
            return (Q, t) if length == 1.0 else (P + 0.9 * length * step[0], s + 0.9 * length * step[1])
        length *= 0.7
    return P, s


def _contracts(P: Array, Phi: Array) -> bool:
    return _positive(P) and _positive((1.0 - _MARGIN) * P - _map_through(P, Phi))


def _positive(F: Array) -> bool:
    """True if all of these matrices are positive definite, shape (..., n, n)."""
    try:
        np.linalg.cholesky(F)
    except np.linalg.LinAlgError:
        return False
    return True


def _balance(Phi: Array) -> Array:
    """Units in which rows and columns are of one size, shape (n,)."""
    scale = np.ones(len(Phi))
    for _ in range(20):
        sized = np.abs(Phi / scale[:, None] * scale)
        np.fill_diagonal(sized, 0.0)
        rows = sized.sum(axis=1)
        columns = sized.sum(axis=0)
        both = (rows > 0.0) & (columns > 0.0)
        scale[both] *= np.sqrt(rows[both] / columns[both])
    return scale


def _root(P: Array) -> Array | None:
    try:
        return _chol(0.5 * (P + P.T))
    except np.linalg.LinAlgError:
        return None


def _chol(P: Array) -> Array:
    return np.asarray(np.linalg.cholesky(P))
