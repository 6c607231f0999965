"""A norm in which matrices contract: of one from Lyapunov's equation, of several at once by an interior point.

What these functions find is not trusted: `cells` checks it by norms alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

EPS = float(np.finfo(np.float64).eps)
_STEPS = 60
_MARGIN = 1e-9
_HEAVIER, _HEAVIEST = 8.0, 1e13
_ROWS = 16
"""Of a product at a time: below the size from which BLAS starts threads, which cost more than they bring here."""


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
        return _root(_summed(Phi / rate, weight))
    scale = _balanced(Phi)
    P = _summed(Phi / scale[:, None] * scale / rate, np.eye(len(Phi)))
    return _root(P / np.outer(scale, scale))


def weight_of(L: Array, Phi: Array) -> Array:
    """W with which Lyapunov's equation of Phi has L for an answer: near Phi, others have one as good by it."""
    P, rate = L @ L.T, _rate(Phi) or 1.0
    return np.asarray(P - Phi.T @ P @ Phi / rate**2)


def _rate(Phi: Array) -> float | None:
    radius = float(np.abs(np.linalg.eigvals(Phi)).max())
    return 0.5 * (1.0 + radius) if radius < 1.0 else None


def _summed(A: Array, W: Array) -> Array:
    """P = W + A^T P A of a stable A: the sum of all A^T^k W A^k, with twice as many terms at each step.

    For one matrix of this size several times as fast as SciPy's solvers.
    """
    P = W
    for _ in range(_STEPS):
        more = A.T @ P @ A
        P, A = P + more, A @ A
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
    """The same where all of these come near to a matrix that keeps one combination of the state for ever.

    With a gain, or a stiffness, of next to nothing the integrator stands still: P - Phi^T P Phi has to vanish in its
    direction r, so that P r is the left eigenvector l. P is then a block for all that l leaves out, and one number.

    Args:
        matrices: each of shape (n, n).
        still: with one eigenvalue 1, all others inside the unit circle, shape (n, n).
    """
    U, _, Vt = np.linalg.svd(still - np.eye(len(still)))
    left, right = U[:, -1], Vt[-1]
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
    basis = _symmetric(n, apart)
    images = np.array([[*basis, slack], *([*(basis - _turned(basis, M[None])), slack] for M in Phi)])
    P, unit = 0.5 * np.eye(n), np.linalg.inv(np.linalg.cholesky(slack))
    s = 2.0 * float(np.linalg.eigvalsh(unit @ (_turned(P, Phi) - P) @ unit.T).max()) + 1.0
    weight = 1.0
    for _ in range(_STEPS):
        for _ in range(4):
            gradient, hessian = _barrier(P, s, Phi, images)
            gradient[-1] += weight
            step = _newton(hessian, gradient)
            if step is None:
                return P if _contracts(P, Phi) else None
            decrement = float(-gradient @ step)
            P, s = _along(P, s, step, Phi, images[0])
            if s < 0.0 and _contracts(P, Phi):
                return P
            if decrement < 0.3:
                break
        # On the central path s is within (sum of all sizes)/weight of the least there is.
        if s > 2.0 * n * (len(Phi) + 2) / weight or weight > _HEAVIEST:
            return None
        weight *= _HEAVIER
    return None


def _barrier(P: Array, s: float, Phi: Array, images: Array) -> tuple[Array, Array]:
    """Gradient and Hessian, by P's free elements and s, of -log det of P, 1 - P and all P - Phi^T P Phi + s W.

    With F = C C^T the Hessian is that of the images C^-1 dF C^-T, as long vectors, with each other.
    """
    eye, m = np.eye(len(P)), images.shape[1] - 1
    factors = np.linalg.cholesky(np.concatenate([[P, eye - P], _constraints(P, s, Phi, images[0, -1])]))
    gradient, hessian = np.zeros(m + 1), np.zeros((m + 1, m + 1))
    for i, back in enumerate(np.linalg.inv(factors)):
        D = images[0, :-1] if i < 2 else images[i - 1]
        turned = _whitened(D, back)
        k = len(D)
        gradient[:k] += (1.0 if i == 1 else -1.0) * np.trace(turned, axis1=1, axis2=2)
        long = _long(turned)
        for row in range(0, k, _ROWS):
            hessian[row : min(row + _ROWS, k), :k] += long[row : row + _ROWS] @ long.T
    return gradient, hessian


def _whitened(D: Array, back: Array) -> Array:
    """back D_k back^T of many symmetric D_k, shape (k, n, n), by two products of long matrices."""
    half = (D.reshape(-1, len(back)) @ back.T).reshape(D.shape)
    return (half.transpose(0, 2, 1).reshape(-1, len(back)) @ back.T).reshape(D.shape)


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


def _turned(P: Array, Phi: Array) -> Array:
    return Phi.transpose(0, 2, 1) @ P @ Phi


def _constraints(P: Array, s: float, Phi: Array, W: Array) -> Array:
    return P - _turned(P, Phi) + s * W


def _along(P: Array, s: float, step: Array, Phi: Array, basis: Array) -> tuple[Array, float]:
    """As far along a step as all constraints stay met."""
    dP, ds = np.tensordot(step[:-1], basis[:-1], axes=1), float(step[-1])
    length = 1.0
    for _ in range(40):
        Q, t = P + length * dP, s + length * ds
        if _positive(np.concatenate([[Q, np.eye(len(P)) - Q], _constraints(Q, t, Phi, basis[-1])])):
            return (Q, t) if length == 1.0 else (P + 0.9 * length * dP, s + 0.9 * length * ds)
        length *= 0.7
    return P, s


def _contracts(P: Array, Phi: Array) -> bool:
    return _positive(P) and _positive((1.0 - _MARGIN) * P - _turned(P, Phi))


def _positive(F: Array) -> bool:
    """Whether all of these matrices are positive definite, shape (..., n, n)."""
    try:
        np.linalg.cholesky(F)
    except np.linalg.LinAlgError:
        return False
    return True


def _symmetric(n: int, apart: int) -> Array:
    """Matrices of length 1 that all symmetric ones are sums of, shape (m, n, n); see `_interior` for `apart`."""
    rows, columns = np.triu_indices(n)
    free = (columns < n - apart) | (rows == columns)
    rows, columns = rows[free], columns[free]
    basis, index = np.zeros((len(rows), n, n)), np.arange(len(rows))
    basis[index, rows, columns] = basis[index, columns, rows] = np.where(rows == columns, 1.0, np.sqrt(0.5))
    return basis


def _long(matrices: Array) -> Array:
    """Symmetric matrices as vectors of the same length, shape (k, n (n + 1)/2)."""
    rows, columns, lengths = _upper(matrices.shape[-1])
    return lengths * matrices[:, rows, columns]


@cache
def _upper(n: int) -> tuple[NDArray[np.intp], NDArray[np.intp], Array]:
    rows, columns = np.triu_indices(n)
    return rows, columns, np.where(rows == columns, 1.0, np.sqrt(2.0))


def _balanced(Phi: Array) -> Array:
    """Units in which rows and columns are of one size, shape (n,)."""
    scale = np.ones(len(Phi))
    for _ in range(20):
        sized = np.abs(Phi / scale[:, None] * scale)
        np.fill_diagonal(sized, 0.0)
        rows, columns = sized.sum(axis=1), sized.sum(axis=0)
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
