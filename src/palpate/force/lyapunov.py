"""A norm in which matrices contract: of one from Lyapunov's equation, of several at once by an interior point.

What these functions find is not trusted: `cells` checks it by norms alone.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_STEPS = 60
_MARGIN = 1e-9
_HEAVIER, _HEAVIEST = 8.0, 1e13
_ROWS = 16
"""Of a product at a time: below the size from which BLAS starts threads, which cost more than they bring here."""


def single(Phi: Array) -> Array | None:
    """L with |L^T Phi L^-T| < 1, shape (n, n); None if Phi is not stable.

    Lyapunov's equation of Phi over a rate between its spectral radius and 1, so that what is near Phi contracts too.
    """
    from scipy.linalg import solve_discrete_lyapunov

    radius = float(np.abs(np.linalg.eigvals(Phi)).max())
    if not radius < 1.0:
        return None
    rate = 0.5 * (1.0 + radius)
    scale = _balanced(Phi)
    scaled = Phi / scale[:, None] * scale
    P = solve_discrete_lyapunov(scaled.T / rate, np.eye(len(Phi)))
    return _root(P / np.outer(scale, scale))


def common(matrices: Sequence[Array], near: Array) -> Array | None:
    """L with |L^T Phi L^-T| < 1 for all of these matrices, shape (n, n); None if none is found.

    Newton's method on the barrier -log det of P - Phi_i^T P Phi_i + s, of P and of 1 - P, s being made small.

    Args:
        matrices: each of shape (n, n).
        near: of which the search takes its coordinates: one of them, or of their mean; stable.
    """
    start = single(near)
    if start is None:
        return None
    back = np.linalg.inv(start.T)
    inside = [start.T @ Phi @ back for Phi in matrices]
    P = _interior(inside)
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
    n = len(S)
    P = _interior(inside, np.array([D for D in _symmetric(n) if not D[:-1, -1].any()]))
    return None if P is None else (T @ into).T @ _chol(P)


def _interior(matrices: Sequence[Array], basis: Array | None = None) -> Array | None:
    n = len(matrices[0])
    basis = _symmetric(n) if basis is None else basis  # (m, n, n)
    m = len(basis)
    flat = basis.reshape(m, -1)
    images = [flat - (Phi.T @ basis @ Phi).reshape(m, -1) for Phi in matrices]
    P = 0.5 * np.eye(n)
    s = 2.0 * max(float(np.linalg.eigvalsh(Phi.T @ P @ Phi - P)[-1]) for Phi in matrices) + 1.0
    weight = 1.0
    for _ in range(_STEPS):
        for _ in range(4):
            gradient, hessian = np.zeros(m + 1), np.zeros((m + 1, m + 1))
            gradient[m] = weight
            for D, Phi in [(flat, None), (-flat, None), *zip(images, matrices, strict=True)]:
                F = _value(P, s, D, Phi, flat)
                _add(gradient, hessian, np.asarray(np.linalg.inv(F)), D, Phi is not None)
            step = _newton(hessian, gradient)
            if step is None:
                return P if _contracts(P, matrices) else None
            decrement = float(-gradient @ step)
            P, s = _along(P, s, step, basis, matrices)
            if s < 0.0 and _contracts(P, matrices):
                return P
            if decrement < 0.3:
                break
        # On the central path s is within (sum of all sizes)/weight of the least there is.
        if s > 2.0 * n * (len(matrices) + 2) / weight or weight > _HEAVIEST:
            return None
        weight *= _HEAVIER
    return None


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


def _value(P: Array, s: float, D: Array, Phi: Array | None, flat: Array) -> Array:
    n = len(P)
    if Phi is not None:
        return P - Phi.T @ P @ Phi + s * np.eye(n)
    return P if D is flat else np.eye(n) - P


def _add(gradient: Array, hessian: Array, G: Array, D: Array, slack: bool) -> None:
    """Gradient and Hessian of -log det of one constraint, G being its inverse."""
    m, n = len(D), len(G)
    turned = (G @ D.reshape(m, n, n) @ G).reshape(m, -1)
    gradient[:m] -= D @ G.ravel()
    for row in range(0, m, _ROWS):
        some = slice(row, min(row + _ROWS, m))
        hessian[some, :m] += turned[some] @ D.T
    if slack:
        square = G @ G
        gradient[m] -= np.trace(G)
        across = D @ square.ravel()
        hessian[:m, m] += across
        hessian[m, :m] += across
        hessian[m, m] += np.trace(square)


def _along(P: Array, s: float, step: Array, basis: Array, matrices: Sequence[Array]) -> tuple[Array, float]:
    """As far along a step as all constraints stay met."""
    n = len(P)
    dP, ds = np.tensordot(step[:-1], basis, axes=1), float(step[-1])
    length = 1.0
    for _ in range(40):
        Q, t = P + length * dP, s + length * ds
        if all(
            _positive(F)
            for F in (Q, np.eye(n) - Q, *(Q - Phi.T @ Q @ Phi + t * np.eye(n) for Phi in matrices))
        ):
            return (Q, t) if length == 1.0 else (P + 0.9 * length * dP, s + 0.9 * length * ds)
        length *= 0.7
    return P, s


def _contracts(P: Array, matrices: Sequence[Array]) -> bool:
    return _positive(P) and all(_positive((1.0 - _MARGIN) * P - Phi.T @ P @ Phi) for Phi in matrices)


def _positive(F: Array) -> bool:
    try:
        np.linalg.cholesky(F)
    except np.linalg.LinAlgError:
        return False
    return True


def _symmetric(n: int) -> Array:
    rows, columns = np.triu_indices(n)
    basis = np.zeros((len(rows), n, n))
    index = np.arange(len(rows))
    basis[index, rows, columns] = basis[index, columns, rows] = np.where(rows == columns, 1.0, np.sqrt(0.5))
    return basis


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
